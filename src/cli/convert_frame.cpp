#include "convert_frame.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "merge_content.h"
#include "photosphere/core/error.h"
#include "photosphere/core/interrupt.h"
#include "photosphere/core/log.h"
#include "photosphere/core/resources.h"
#include "photosphere/volume/invalid_values.h"
#include "photosphere/volume/rasterize.h"
#include "photosphere/volume/vdb_file.h"
#include "print.h"

namespace photosphere::cli {

using volume::Grid;
using volume::ParticleSet;

namespace {

/// Name of the point grid that convert writes.
constexpr const char* kPointGrid = "points";
/// Agreement of particle and grid mass that rasterizing promises (relative).
constexpr double kMassTolerance = 1e-5;

bool hasRow(const caches::CacheFormat& format, const std::string& name) {
  return std::any_of(format.params.begin(), format.params.end(),
                     [&](const Param& row) { return row.name == name; });
}

/// Those of the given options that the format has.
ParamValues valuesFor(const caches::CacheFormat& format, const ConvertOptions& options) {
  ParamValues values(format.params);
  for (const auto& [name, value] : options.formatOptions)
    if (hasRow(format, name)) values.setText(name, value, "--format-option");
  return values;
}

/// What no renderer takes does not go on unseen.
void heedInvalid(caches::CacheContent& file, const std::string& path,
                 const ConvertOptions& options) {
  for (Grid& grid : file.grids) {
    if (grid.kind() != volume::GridKind::scalar && grid.kind() != volume::GridKind::vector)
      continue;
    const bool negatives = grid.name() == options.density;
    const volume::InvalidValues found = volume::findInvalid(grid, negatives);
    if (found.total() == 0) continue;
    const std::string what = fmt::format("grid '{}' holds {}", grid.name(), found.text());
    if (!options.allowInvalid)
      throw InputError(path, what + "; clean the cache, or give --allow-invalid to write zeros");
    log::warning("{}: {}; zeros are written", path, what);
    grid = volume::withInvalidAsZero(grid, negatives);
  }
}

/// Floats do not hold what some values become here; that is nothing to write.
/// @param remedy  what the user can do
void checkRange(const Grid& grid, const std::string& path, std::string_view remedy) {
  const volume::InvalidValues found = volume::findInvalid(grid, false);
  if (found.total() > 0)
    throw InputError(path, fmt::format("grid '{}' would hold {}, which floats cannot; {}",
                                       grid.name(), found.text(), remedy));
}

caches::CacheContent readInputs(const std::vector<std::string>& inputs,
                                const ConvertOptions& options) {
  caches::CacheContent content;
  for (const std::string& path : inputs) {
    const caches::CacheFormat& format = caches::detectFormat(path);
    if (!format.read)
      throw InputError(path, fmt::format("format {} is written, not read", format.name));
    caches::CacheContent file = format.read(path, valuesFor(format, options));
    for (const std::string& note : file.notes)
      log::info("{}: {}", path, note);
    heedInvalid(file, path, options);
    try {
      place(file, options.placement, format);
    } catch (const ConfigError& error) {
      throw ConfigError(fmt::format("{}: moved by --origin: {}", path, error.what()));
    }
    if (options.placement.velocityScale != 1)
      for (const Grid& grid : file.grids)
        if (grid.kind() == volume::GridKind::vector)
          checkRange(grid, path, "give a smaller --velocity-scale");
    mergeContent(content, std::move(file), path);
    throwIfInterrupted();
  }
  content.notes.clear();
  return content;
}

const Grid* findGrid(const caches::CacheContent& content, const std::string& name) {
  for (const Grid& grid : content.grids)
    if (grid.name() == name && grid.kind() == volume::GridKind::scalar) return &grid;
  return nullptr;
}

/// One particle set under one name, whatever the inputs called theirs.
void joinParticles(caches::CacheContent& content) {
  if (content.particles.empty()) return;
  if (content.particles.size() > 1) {
    printLine("  joined     {} particle sets ({})", content.particles.size(),
              fmt::join(content.particleNames, ", "));
    ParticleSet all = mergeParticles(content.particles);
    content.particles.push_back(std::move(all));
  }
  content.particleNames = {kPointGrid};
  if (content.particles.front().size() == 0) log::warning("there are no particles in this frame");
}

std::string radiusRule(const volume::RasterizeResult& result, const ConvertOptions& options) {
  if (options.radius > 0) return "as asked";
  if (result.radiusFromSpacing)
    return fmt::format("twice the median spacing of {:.6g}", result.spacing);
  return fmt::format("the particles' pscale, {:.6g} to {:.6g}", result.radiusMin, result.radiusMax);
}

/// What cannot be rasterized is the file's doing where the sizes are chosen from it.
volume::RasterizeResult rasterized(const ParticleSet& set, const std::string& path,
                                   const ConvertOptions& options) {
  try {
    return volume::rasterize(set, {.voxelSize = options.voxelSize,
                                   .radius = options.radius,
                                   .leaveOutStrays = !options.keepStrays});
  } catch (const ConfigError& error) {
    if (options.voxelSize == 0 && options.radius == 0) throw InputError(path, error.what());
    throw ConfigError(fmt::format("{}: {}", path, error.what()));
  } catch (const MemoryError& error) {
    throw MemoryError(fmt::format("{}: {}", path, error.what()));
  }
}

/// @param path  of the particles, for messages
void addDensity(caches::CacheContent& content, const std::string& path,
                const ConvertOptions& options) {
  ParticleSet& set = content.particles.front();
  volume::RasterizeResult result = rasterized(set, path, options);
  checkRange(result.density, path,
             "scale the particles' mass, or give a larger --radius and --voxel-size");
  const double difference =
      result.massParticles > 0 ? std::abs(result.massGrid / result.massParticles - 1) : 0;
  printLine("  radius     median {:.6g}: {}", result.radiusMedian, radiusRule(result, options));
  printLine("  voxel size {:.6g}: {}", result.voxelSize,
            options.voxelSize > 0 ? "as asked" : "half the median radius, or what memory allows");
  printLine("  mass       particles {:.9g}, grid {:.9g}, relative difference {:.1e}",
            result.massParticles, result.massGrid, difference);
  if (difference > kMassTolerance)
    log::warning("the density grid misses the particles' mass by {:.1e}, more than {:.0e}",
                 difference, kMassTolerance);
  if (result.skipped > 0)
    log::warning(
        "{} particles have a position, radius or mass that is negative or not finite; "
        "they are kept as points and left out of the density",
        result.skipped);
  if (result.strays)
    log::warning("{}; kept as points, and left out of the density (--keep-strays keeps them there)",
                 result.strays->text("particles"));
  if (!set.find("pscale"))
    // Renderers take the radius from here: without it the points would not say what they weigh.
    set.add({"pscale", 1, std::vector<float>(set.size(), static_cast<float>(result.radiusMedian))});
  content.grids.push_back(options.density == "density"
                              ? result.density
                              : volume::renamed(result.density, options.density));
}

/// Position, mass, radius and density, first in lists that grow and then as points of a grid.
void checkSeedMemory(std::uint64_t particles) {
  constexpr std::uint64_t kBytesEach = 150;
  const std::uint64_t free = availableMemoryBytes();
  if (particles > free / kBytesEach)
    throw MemoryError(fmt::format(
        "--particles {}: so many take {} bytes each, and {} of memory are free; ask for "
        "fewer than {}",
        particles, kBytesEach, formatBytes(free), free / kBytesEach));
}

/// @param path  of the grids, for messages
void addParticles(caches::CacheContent& content, const std::string& path,
                  const ConvertOptions& options) {
  const Grid* density = findGrid(content, options.density);
  if (!density || options.particles == 0) {
    if (!density)
      log::warning("no scalar grid is named '{}', so no particles are seeded (--density NAME)",
                   options.density);
    return;
  }
  if (!density->isAffine())
    throw InputError(path, fmt::format("grid '{}' has a frustum transform, in which no particles "
                                       "are seeded; resample it to a regular grid in the software "
                                       "that wrote it, or give --particles 0 to keep it as it is",
                                       density->name()));
  checkSeedMemory(options.particles);
  ParticleSet set = volume::seedParticles(*density, options.particles, options.seed);
  double mass = 0;
  if (const volume::Attribute* column = set.find("mass"))
    for (std::size_t i = 0; i < set.size(); ++i)
      mass += column->number(i);
  printLine("  seeded     {} particles in proportion to '{}', mass {:.9g} in equal shares",
            set.size(), options.density, mass);
  content.particles.push_back(std::move(set));
  content.particleNames = {kPointGrid};
}

void printContent(const caches::CacheContent& content) {
  for (const Grid& grid : content.grids)
    printLine("  grid       {} ({}): {} voxels of {}, {}", grid.name(), grid.valueType(),
              grid.activeVoxels(), formatVec(grid.voxelSize()), formatBox(grid.worldBounds()));
  for (const ParticleSet& set : content.particles) {
    std::vector<std::string> names{"P"};
    for (const volume::Attribute& attribute : set.attributes)
      names.push_back(attribute.name);
    printLine("  points     {} with {}, {}", set.size(), fmt::join(names, " "),
              formatBox(set.bounds()));
  }
}

/// Particles and density, whichever the inputs lack.
/// @param path  of an input, for messages
void complete(caches::CacheContent& content, const std::string& path, const ConvertOptions& options,
              bool gridsCanBeKept) {
  joinParticles(content);
  if (content.particles.empty())
    addParticles(content, path, options);
  else if (gridsCanBeKept && content.particles.front().size() > 0 &&
           !findGrid(content, options.density))
    addDensity(content, path, options);
}

}  // namespace

void checkFormatOptions(const ConvertOptions& options, const std::vector<std::string>& inputs,
                        const std::string& output) {
  if (options.formatOptions.empty()) return;
  std::vector<const caches::CacheFormat*> formats{&caches::formatForWriting(output)};
  for (const std::string& input : inputs)
    formats.push_back(&caches::detectFormat(input));
  for (const auto& [name, value] : options.formatOptions) {
    std::vector<std::string_view> known;
    bool found = false;
    for (const caches::CacheFormat* format : formats) {
      found = found || hasRow(*format, name);
      for (const Param& row : format->params)
        known.push_back(row.name);
    }
    if (!found)
      throw ConfigError(fmt::format(
          "--format-option: unknown option '{}'{} (known: {})", name, suggestion(name, known),
          known.empty() ? "none for these files" : fmt::format("{}", fmt::join(known, ", "))));
  }
}

void convertFrame(const std::vector<std::string>& inputs, const std::string& output,
                  const ConvertOptions& options) {
  const Stopwatch watch;
  const caches::CacheFormat& writer = caches::formatForWriting(output);
  printLine("{} -> {}", fmt::join(inputs, " + "), output);
  caches::CacheContent content = readInputs(inputs, options);
  if (content.grids.empty() && content.particles.empty())
    throw InputError(inputs.front(), "holds neither grids nor particles; nothing to convert");
  const double readSeconds = watch.seconds();
  // Of the formats that can be written, .vdb alone holds grids.
  const bool keepsGrids = writer.name == "vdb";
  complete(content, inputs.front(), options, keepsGrids);
  throwIfInterrupted();
  if (!keepsGrids && !content.grids.empty() && !content.particles.empty()) {
    log::info("{}: {} holds no grids; write .vdb to keep them", output, writer.name);
    content.grids.clear();
  }
  printContent(content);
  const double workSeconds = watch.seconds();
  writer.write(output, content, valuesFor(writer, options));
  std::error_code unknown;
  const std::uintmax_t bytes = std::filesystem::file_size(output, unknown);
  printLine(
      "  wrote      {} in {:.2f} s (read {:.2f}, convert {:.2f}, write {:.2f}), peak memory {}",
      unknown ? "output" : formatBytes(bytes), watch.seconds(), readSeconds,
      workSeconds - readSeconds, watch.seconds() - workSeconds, formatBytes(peakMemoryBytes()));
}

}  // namespace photosphere::cli
