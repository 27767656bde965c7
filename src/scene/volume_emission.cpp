#include "volume_emission.h"

#include <fmt/format.h>

#include <atomic>
#include <cmath>

#include "photosphere/core/error.h"
#include "photosphere/image/blackbody.h"
#include "photosphere/image/color.h"

namespace photosphere::scene {

namespace {

using Scalars = volume::BrickField<float>;
using Colours = volume::BrickField<Vec4f>;

// Visible glow begins about here (Draper 1847) [K].
constexpr double kGlows = 800.0;
// A black body colder than this sends out under 1e-12 of the light that one of kGlows does [K];
// it counts as dark.
constexpr double kDark = 300.0;

// The field whose nodes are a function of another's.
template <class Function>
Colours mapNodes(const Scalars& from, const Function& function) {
  std::vector<Vec3i> candidates;
  const Vec3i& bricks = from.bricks();
  for (int z = 0; z < bricks.z && !from.empty(); ++z)
    for (int y = 0; y < bricks.y; ++y)
      for (int x = 0; x < bricks.x; ++x)
        if (from.brickAt({x, y, z}) >= 0) candidates.push_back({x, y, z});
  return Colours(from.origin(), bricks, candidates, [&](const Vec3i& brick, Vec4f* nodes) {
    const float* values = from.nodes(from.brickAt(brick));
    for (int i = 0; i < Scalars::kBrickSize; ++i)
      nodes[i] = transport::emissionNode(values[i] != 0.0f ? function(values[i]) : Rgb(0.0f));
  });
}

image::Chromaticities primaries(const std::string& space, const std::string& where) {
  std::optional<image::Chromaticities> found = image::knownChromaticities(space);
  if (!found) found = image::ColorConfig::load().chromaticities(space);
  if (!found)
    throw ConfigError(fmt::format(
        "{}: 'emission' by temperature needs the primaries of the rendering space, and those of "
        "output.colorspace = \"{}\" are not known; use a linear space such as \"ACEScg\"",
        where, space));
  return *found;
}

Colours glow(const Scalars& values, const VolumeEntry& entry, const std::string& path,
             const std::string& colorspace, std::vector<std::string>& notes) {
  const ParamValues& e = entry.emission;
  const double kelvinScale = e.real("kelvin_scale"), kelvinOffset = e.real("kelvin_offset");
  const auto kelvin = [&](float value) {
    const double k = static_cast<double>(value) * kelvinScale + kelvinOffset;
    return k > kDark ? k : 0.0;
  };
  double lowest = 1e30, highest = 0;
  volume::forEachNode(values, [&](float value) {
    const double k = value != 0.0f ? kelvin(value) : 0.0;
    if (!(k > 0)) return;
    lowest = std::min(lowest, k);
    highest = std::max(highest, k);
  });
  if (highest > 1e8)
    throw ConfigError(
        fmt::format("{}: 'emission' makes the largest temperature {:.3g} K; lower "
                    "kelvin_scale",
                    entry.where, highest));
  if (highest < kGlows) {
    notes.push_back(
        fmt::format("emission: no temperature in {} reaches {} K, under which nothing "
                    "glows visibly; kelvin_scale turns a solver's numbers into kelvin",
                    path, kGlows));
    if (!(highest > 0)) return {};
  }
  const image::BlackbodyTable table(primaries(colorspace, entry.where), lowest, highest);
  const double scale = e.real("scale");
  std::atomic<std::uint64_t> clipped{0};
  std::atomic<double> deepest{0.0};
  Colours field = mapNodes(values, [&](float value) {
    const Vec3d j = scale * table.at(kelvin(value));
    const double below = maxComponent(-j);
    if (below > 0) {
      clipped.fetch_add(1, std::memory_order_relaxed);
      double known = deepest;
      while (known < below && !deepest.compare_exchange_weak(known, below)) {
      }
    }
    return Rgb(glm::max(j, Vec3d(0.0)));
  });
  // Cool nodes lie outside many spaces and shine next to nothing: no news.
  const double share = deepest / std::max(scale * maxComponent(table.at(highest)), 1e-300);
  if (share > 1e-5)
    notes.push_back(fmt::format(
        "emission: {} nodes have a colour outside {}; what is negative in them, at most {:.2g} of "
        "the brightest node, is clipped to 0",
        clipped.load(), colorspace, share));
  return field;
}

}  // namespace

transport::VolumeEmission placeEmission(const VolumeEntry& entry, const VolumeSource& source,
                                        const Mat4d& localFromWorld, const std::string& colorspace,
                                        std::uint64_t budgetBytes,
                                        std::vector<std::string>& notes) {
  transport::VolumeEmission placed;
  const bool thermal = !entry.emission.text("temperature").empty();
  const Scalars values =
      volume::bricksFromGrid(source.emission, 0, source.path, thermal, budgetBytes, kReadAsChecked);
  if (values.empty()) return placed;
  if (thermal) {
    placed.field = glow(values, entry, source.path, colorspace, notes);
  } else {
    const Rgb unit = entry.emission.rgb("color") * static_cast<float>(entry.emission.real("scale"));
    placed.field = mapNodes(values, [&](float value) { return value * unit; });
  }
  Mat4d nodeShift(1.0);
  nodeShift[3] = glm::dvec4(Vec3d(values.origin()), 1.0);
  placed.localFromNode = localFromWorld * source.worldFromIndex(source.emission) * nodeShift;
  return placed;
}

}  // namespace photosphere::scene
