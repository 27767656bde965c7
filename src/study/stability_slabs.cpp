#include "stability_slabs.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>

#include "photosphere/core/error.h"
#include "photosphere/core/shipped_data.h"

namespace photosphere::study {

namespace {

// Half the slab's width, beyond which its sides would show, and of what the camera sees [m].
double halfWidth(double tau) {
  return 3 * tau + 18;
}
constexpr double kSeen = 3;
// Of efforts beyond the first.
constexpr const char* kPhotons[] = {"estimator.photons=8000000", "estimator.photons=32000000"};

}  // namespace

SmokeSpec SlabRadiance::smoke() const {
  // Eight light voxels deep or more, and no deeper than a quarter of a free path each.
  const double layers = std::max(16.0, std::ceil(tau / 0.25));
  SmokeSpec spec;
  spec.texts["kind"] = "box";
  spec.numbers["dims"] = {8, 8, layers};
  spec.numbers["extent"] = {2 * halfWidth(tau), 2 * halfWidth(tau), tau};
  spec.numbers["points"] = {0};
  return spec;
}

std::vector<std::string> SlabRadiance::settings(const Direction& d, std::size_t effort) const {
  const double s = std::sqrt(std::max(0.0, 1 - d.mu * d.mu)), side = d.top ? 1 : -1;
  const double far = 4 * halfWidth(tau);
  // Across the plane in which the view is tilted, more of the slab is seen at the same distance
  // from its sides.
  const bool faint = effort == kDim.size();
  const int rows = faint ? 8 * std::max(1, static_cast<int>(halfWidth(tau) / (3 * kSeen))) : 8;
  std::vector<std::string> sets{
      "volume.0.density_scale=1", fmt::format("volume.0.albedo={}", albedo),
      fmt::format("volume.0.phase={{ type = \"henyey_greenstein\", g = {} }}", g),
      "light=[{ type = \"directional\", position = [0, 0, 1], target = [0, 0, 0] }]",
      fmt::format("camera={{ type = \"orthographic\", position = [{}, 0, {}], look_at = [0, 0, "
                  "0], up = [0, 1, 0], width = {}, resolution = [8, {}] }}",
                  s * far, side * d.mu * far, 2 * kSeen, rows)};
  if (effort > 0) sets.emplace_back(kPhotons[effort - 1]);
  return sets;
}

std::vector<SlabRadiance> slabRadiances(double g, bool quick) {
  constexpr const char* kTable = "reference/slab.csv";
  std::ifstream in(findShipped(kTable).value_or(kTable));
  if (!in)
    throw InputMissingError(kTable,
                            "the reference values that are shipped with this tool are not there; "
                            "set PHOTOSPHERE_DATA to the folder that holds reference/");
  std::vector<SlabRadiance> slabs;
  std::string line;
  std::getline(in, line);
  while (std::getline(in, line)) {
    std::stringstream fields(line);
    std::string f[7];
    for (std::string& field : f)
      std::getline(fields, field, ',');
    const bool top = f[4] == "L_top";
    if (f[0] != "beam" || (!top && f[4] != "L_bottom") || std::stod(f[3]) != g) continue;
    const double tau = std::stod(f[1]), albedo = std::stod(f[2]), mu = std::stod(f[5]);
    if (tau > 8 || mu < 0.3) continue;
    if (quick && (tau != 2 || albedo != 0.9 || (mu != 0.3 && mu != 0.6 && mu != 1))) continue;
    const auto same = [&](const SlabRadiance& slab) {
      return slab.tau == tau && slab.albedo == albedo;
    };
    auto slab = std::find_if(slabs.begin(), slabs.end(), same);
    if (slab == slabs.end()) slab = slabs.insert(slabs.end(), {tau, albedo, g, {}});
    slab->directions.push_back({top, mu, std::stod(f[6])});
  }
  return slabs;
}

}  // namespace photosphere::study
