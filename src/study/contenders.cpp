#include "contenders.h"

#include <fmt/format.h>

#include <algorithm>

#include "photosphere/core/error.h"

namespace photosphere::study {

namespace {

Family basisOnly(std::string_view name, std::string_view title, std::string_view basis,
                 std::vector<std::string> sets) {
  sets.insert(sets.begin(), fmt::format("estimator.basis={}", basis));
  return {name, title, std::move(sets), Work::photons, false, true};
}

}  // namespace

const std::vector<Family>& families() {
  static const std::vector<Family> table = {
      {"view", "photosphere, view", {"estimator.basis=view"}},
      {"view_fine",
       "photosphere, view, fine light voxels",
       {"estimator.basis=view", "estimator.light_voxel=1"}},
      {"view_mean",
       "photosphere, view, mean of plain and density-weighted smoothing",
       {"estimator.basis=view", "estimator.smoothing=mean"}},
      basisOnly("view_smoothed", "photosphere, view, directions smoothed over 0.2 rad", "view",
                {"estimator.kernel=epanechnikov", "estimator.bandwidth=0.2"}),
      {"histogram_32", "photosphere, 32 bins", {"estimator.basis=histogram", "estimator.rows=2"}},
      {"histogram_128", "photosphere, 128 bins", {"estimator.basis=histogram", "estimator.rows=4"}},
      {"harmonics",
       "photosphere, harmonics of order 4",
       {"estimator.basis=spherical_harmonics", "estimator.order=4"}},
      {"histogram_32_gather",
       "photosphere, 32 bins, looked up after the first bounce",
       {"estimator.basis=histogram", "estimator.rows=2", "estimator.photons=1000000"},
       Work::gatherRays},
      basisOnly("histogram_8_means", "photosphere, 8 bins and their mean directions", "histogram",
                {"estimator.rows=1", "estimator.representative=mean"}),
      basisOnly("histogram_32_means", "photosphere, 32 bins and their mean directions", "histogram",
                {"estimator.rows=2", "estimator.representative=mean"}),
      basisOnly("histogram_512", "photosphere, 512 bins", "histogram", {"estimator.rows=8"}),
      basisOnly("harmonics_2", "photosphere, harmonics of order 2", "spherical_harmonics",
                {"estimator.order=2"}),
      basisOnly("harmonics_8", "photosphere, harmonics of order 8", "spherical_harmonics",
                {"estimator.order=8"}),
      {"particles_view",
       "photosphere on particles, view",
       {"estimator.carrier=particles", "estimator.basis=view"},
       Work::photons,
       true},
      {"particles_collision",
       "photosphere on particles, collisions, 32 bins",
       {"estimator.carrier=particles", "estimator.deposit=collision", "estimator.basis=histogram",
        "estimator.rows=2"},
       Work::photons,
       true},
      {"paper",
       "photosphere, settings of the paper",
       {"estimator.preset=paper"},
       Work::photons,
       true},
      {"photon_map", "photon map", {"estimator.type=photon_map"}},
      {"photon_map_progressive",
       "photon map, 8 progressive passes",
       {"estimator.type=photon_map", "estimator.passes=8"}},
      {"path_traced", "path tracing", {"estimator.type=path_traced"}, Work::samples},
      {"light_traced", "light tracing", {"estimator.type=light_traced"}, Work::samples},
      {"until_error",
       "photosphere, until its estimated error",
       {"estimator.photons=200000", "render.time_limit=10"},
       Work::errorTarget},
      {"single", "single scattering alone", {"estimator.type=single"}, Work::none},
  };
  return table;
}

std::string familyTitle(const std::string& name) {
  for (const Family& family : families())
    if (family.name == name) return std::string(family.title);
  return name;
}

SweepSize SweepSize::full() {
  return {{16'000, 64'000, 256'000, 1'024'000, 4'096'000, 16'384'000},
          {4, 16, 64, 256, 1024, 4096},
          {10, 20, 40},
          {}};
}

SweepSize SweepSize::quick() {
  return {{1'000, 4'000},
          {1, 4},
          {2},
          {"view", "histogram_32", "path_traced", "until_error", "single"}};
}

SweepSize SweepSize::hardCase(bool quick) {
  SweepSize size{{64'000, 1'024'000},
                 {16, 256},
                 {10, 20},
                 {"view", "view_smoothed", "histogram_32", "particles_view", "photon_map",
                  "path_traced", "light_traced", "until_error", "single"}};
  if (quick) size = {{1'000}, {2}, {}, {"view", "path_traced"}};
  return size;
}

SweepSize SweepSize::bases(bool quick) {
  SweepSize size{
      {1'024'000}, {256}, {}, {"view", "view_smoothed", "path_traced", "histogram_32_gather"}};
  for (const char* basis :
       {"histogram_8_means", "histogram_32", "histogram_32_means", "histogram_128", "histogram_512",
        "harmonics_2", "harmonics", "harmonics_8"})
    size.families.emplace_back(basis);
  if (quick)
    size = {{1'000}, {2}, {}, {"view", "histogram_32", "histogram_32_means", "path_traced"}};
  return size;
}

std::string formatCount(std::int64_t count) {
  if (count >= 1'000'000) return fmt::format("{:.3g}M", static_cast<double>(count) / 1e6);
  if (count >= 1000) return fmt::format("{:.4g}k", static_cast<double>(count) / 1e3);
  return std::to_string(count);
}

std::vector<std::string> neutralSettings(const scene::SceneFile& scene) {
  std::vector<std::string> sets;
  const ParamValues defaults(scene.estimator.rows());
  for (const Param& row : scene.estimator.rows())
    if (scene.estimator.given(row.name))
      sets.push_back(fmt::format("estimator.{}={}", row.name, defaults.format(row.name)));
  for (const char* name : {"target_error", "time_limit"})
    if (scene.render.real(name) > 0) sets.push_back(fmt::format("render.{}=0", name));
  if (scene.output.given("aovs")) sets.emplace_back("output.aovs=[]");  // `error` needs a target
  return sets;
}

namespace {

void checkNames(const SweepSize& size) {
  std::vector<std::string_view> known;
  for (const Family& family : families())
    known.push_back(family.name);
  for (const std::string& name : size.families)
    if (std::find(known.begin(), known.end(), name) == known.end())
      throw ConfigError(fmt::format("--family: unknown family '{}'{} (known: {})", name,
                                    suggestion(name, known), fmt::join(known, ", ")));
}

Contender contender(const Family& family, int level, std::int64_t work) {
  Contender c{&family, level, work, family.sets, std::string(family.title)};
  if (family.work == Work::photons) {
    c.sets.push_back(fmt::format("estimator.photons={}", work));
    c.label += fmt::format(", {} photons", formatCount(work));
  } else if (family.work == Work::samples) {
    c.sets.push_back(fmt::format("estimator.samples={}", work));
    c.label += fmt::format(", {} samples a pixel", work);
  } else if (family.work == Work::gatherRays) {
    c.sets.push_back(fmt::format("estimator.final_gather={}", work));
    c.label += fmt::format(", {} rays a pixel", work);
  } else if (family.work == Work::errorTarget) {
    c.sets.push_back(fmt::format("render.target_error={}", 1.0 / static_cast<double>(work)));
    c.label += fmt::format(" is {:.3g} %", 100.0 / static_cast<double>(work));
  }
  return c;
}

std::vector<std::int64_t> worksOf(Work work, const SweepSize& size) {
  switch (work) {
    case Work::photons:
      return size.photons;
    case Work::samples:
    case Work::gatherRays:
      return size.samples;
    case Work::errorTarget:
      return size.targets;
    case Work::none:
      break;
  }
  return {0};
}

// The scene refuses what it does not serve, or why it does.
bool accepts(const SceneSource& scene, const Contender& c, std::string& why) {
  try {
    scene.open(c.sets);
    return true;
  } catch (const ConfigError& error) {
    why = error.what();
    return false;
  }
}

}  // namespace

std::vector<Contender> contenders(const SceneSource& scene, const SweepSize& size,
                                  const std::vector<std::string>& particleSets,
                                  std::vector<LeftOut>& leftOut) {
  checkNames(size);
  const SceneSource neutral = scene.with(neutralSettings(scene.open()));
  std::vector<Contender> found;
  for (const Family& family : families()) {
    const bool wanted =
        (size.families.empty() && !family.byNameAlone) ||
        std::find(size.families.begin(), size.families.end(), family.name) != size.families.end();
    if (!wanted) continue;
    const std::vector<std::int64_t> works = worksOf(family.work, size);
    for (std::size_t level = 0; level < works.size(); ++level) {
      Contender c = contender(family, static_cast<int>(level), works[level]);
      if (family.needsParticles)
        c.sets.insert(c.sets.end(), particleSets.begin(), particleSets.end());
      std::string why;
      if (!accepts(neutral, c, why)) {
        leftOut.push_back({std::string(family.title), why});
        break;
      }
      const std::vector<std::string> reset = neutralSettings(scene.open());
      c.sets.insert(c.sets.begin(), reset.begin(), reset.end());
      found.push_back(std::move(c));
    }
  }
  std::stable_sort(found.begin(), found.end(),
                   [](const Contender& a, const Contender& b) { return a.level < b.level; });
  return found;
}

}  // namespace photosphere::study
