#include "paper_exhibits.h"

#include <fmt/format.h>

#include <cstdint>

#include "contenders.h"

namespace photosphere::study {

namespace {

using Sets = std::vector<std::string>;

/// Search radius of the exhibits whose captions name none [scene units].
constexpr double kRadius = 0.3;

Sets paperSets(std::int64_t photons, double radius, const Sets& more = {}) {
  Sets sets{"estimator.preset=paper", fmt::format("estimator.photons={}", photons),
            fmt::format("estimator.radius={}", radius)};
  sets.insert(sets.end(), more.begin(), more.end());
  return sets;
}

Sets mapSets(std::int64_t photons, double radius, const Sets& more = {}) {
  Sets sets{"estimator.type=photon_map", fmt::format("estimator.photons={}", photons),
            fmt::format("estimator.radius={}", radius)};
  sets.insert(sets.end(), more.begin(), more.end());
  return sets;
}

PaperFrame column(std::string label, double g, Sets sets, double paperValue = 0) {
  return {std::move(label), "column", 42, g, std::move(sets), paperValue};
}

ExhibitPlan tableOne(std::int64_t photons) {
  ExhibitPlan plan{
      "Table 1",
      "Seconds of rendering by search radius, g = 0.4, Gaussian smoothing",
      "On an Athlon 64 3500+: the photon map is faster than the photosphere with 32 "
      "directions at every radius, and than that with 8 at all but the largest.",
      "The photon map here sums the photons of a cell in vector instructions, each by one phase "
      "function, and so is further ahead of searching particles and drawing a bin of each. "
      "Restored directions, kernel and phase function fold into one weight for each bin, worked "
      "out "
      "once a ray, so that a step costs the search and one drawn bin. The paper gives "
      "neither its photon count, nor the scale of its radii, nor the size of its "
      "picture; ours are scene units of the column, which is 4 across.",
      "s",
      false,
      {}};
  const double radii[] = {0.4, 0.3, 0.2};
  const double map[] = {618.2, 353.9, 186.3}, eight[] = {539.4, 375.3, 223.8},
               thirtyTwo[] = {835.5, 572.6, 321.8};
  for (int i = 0; i < 3; ++i)
    plan.frames.push_back(column(fmt::format("photon map, radius {}", radii[i]), 0.4,
                                 mapSets(photons, radii[i]), map[i]));
  for (int i = 0; i < 3; ++i)
    plan.frames.push_back(column(fmt::format("photosphere, 8 directions, radius {}", radii[i]), 0.4,
                                 paperSets(photons, radii[i], {"estimator.rows=1"}), eight[i]));
  for (int i = 0; i < 3; ++i)
    plan.frames.push_back(column(fmt::format("photosphere, 32 directions, radius {}", radii[i]),
                                 0.4, paperSets(photons, radii[i]), thirtyTwo[i]));
  return plan;
}

ExhibitPlan tableTwo(std::int64_t photons) {
  return {
      "Table 2",
      "Seconds of rendering by kernel, radius 0.4, 32 directions, g = 0.4",
      "Epanechnikov's bounded support reads fewer bins than the Gaussian: 1.69 times faster.",
      "The kernel is part of a weight for each bin that is worked out once a ray (see table 1): "
      "a step costs the same with either, and there is nothing left to save.",
      "s",
      false,
      {column("Gaussian", 0.4, paperSets(photons, 0.4), 835.5),
       column("Epanechnikov", 0.4, paperSets(photons, 0.4, {"estimator.kernel=epanechnikov"}),
              495.75)}};
}

ExhibitPlan figureEleven(std::int64_t photons) {
  return {"Figure 11",
          "Smoothing over directions in the photon map, g = 0.7: before and after",
          "With it, light scattered in toward the eye comes out clearer beyond the highlight.",
          "Smoothing keeps energy here. At a forward peak it also spreads it, which is a bias: the "
          "errors beside the pictures say whether it pays.",
          "",
          true,
          {column("photon map, no smoothing", 0.7, mapSets(photons, kRadius)),
           column("photon map, Gaussian smoothing", 0.7,
                  mapSets(photons, kRadius,
                          {"estimator.kernel=gaussian", "estimator.bandwidth=0.3"}))}};
}

ExhibitPlan figureTwelve(std::int64_t photons) {
  ExhibitPlan plan{
      "Figure 12",
      "The column at two frames, g = 0.8: photosphere against photon map",
      "Indirect light outside the spot is clearer with the photosphere.",
      "The lamp and the smoke are ours, and both estimators are normalised: where they "
      "differ in brightness, the mean over the reference's says which is off.",
      "",
      true,
      {}};
  for (const int frame : {30, 42}) {
    plan.frames.push_back({fmt::format("photon map, frame {}", frame), "column", frame, 0.8,
                           mapSets(photons, kRadius)});
    plan.frames.push_back({fmt::format("photosphere, frame {}", frame), "column", frame, 0.8,
                           paperSets(photons, kRadius)});
  }
  return plan;
}

ExhibitPlan figureThirteen(std::int64_t photons) {
  return {"Figure 13",
          "The mushroom cloud, g = 0.6: photon map against photosphere",
          "The photosphere shows regions of indirect light that the photon map misses.",
          "As for figure 12.",
          "",
          true,
          {{"photon map", "mushroom", 38, 0.6, mapSets(photons, kRadius)},
           {"photosphere", "mushroom", 38, 0.6, paperSets(photons, kRadius)}}};
}

ExhibitPlan figureFourteen(std::int64_t photons) {
  const auto cut = [&](double truncation) {
    return column(
        fmt::format("Gaussian cut at {} sigma", truncation), 0.4,
        paperSets(photons, kRadius, {fmt::format("estimator.truncation={}", truncation)}));
  };
  return {"Figure 14",
          "Cutting the Gaussian over directions: full, 1.5 sigma, sigma",
          "The narrower the cut, the more multiple scattering is lost. (A planar Gaussian cut at "
          "1.5 sigma keeps 0.675 of its weight, at sigma 0.393.)",
          "The kernel is normalised after it is cut (eq. 8 divides by the count of all bins), so "
          "that no light is lost: the means should agree.",
          "",
          true,
          {cut(3), cut(1.5), cut(1)}};
}

ExhibitPlan figureFifteen(std::int64_t photons) {
  return {"Figure 15",
          "Gaussian against Epanechnikov, g = 0.4",
          "Both kernels give similar pictures.",
          "They should agree here as well.",
          "",
          true,
          {column("Gaussian", 0.4, paperSets(photons, kRadius)),
           column("Epanechnikov", 0.4,
                  paperSets(photons, kRadius, {"estimator.kernel=epanechnikov"}))}};
}

// Section 4.1.3. White light: one value a bin, as in the paper.
ExhibitPlan memory(std::int64_t photons) {
  constexpr double kPapersPhotosphere = 12'800'000, kPapersPhoton = 25;
  ExhibitPlan plan{"Memory (section 4.1.3)",
                   "Bytes of stored light: 100,000 particles with 32 directions against photons",
                   "128 bytes a particle whatever the photon count, 25 bytes a photon; energy and "
                   "representative directions are left out of its count.",
                   "A bin takes a 64-bit sum, so that the order of photons cannot change a bit of "
                   "the picture, and the float that is read; a stored photon carries its power in "
                   "three channels and the tree of the search. Both counts are whole. The peak is "
                   "that of the process, smoke and frame included.",
                   "bytes",
                   false,
                   {}};
  const Sets white{"light.0.color=[1, 1, 1]"};
  plan.frames.push_back(column("photosphere, 100,000 particles, 32 directions", 0.4,
                               paperSets(photons, kRadius, white), kPapersPhotosphere));
  plan.frames.back().particles = 100'000;
  plan.frames.back().stored = StoredLight::forecast;
  for (const double stored : {6e5, 1e6}) {
    plan.frames.push_back(column(fmt::format("photon map, {} stored photons",
                                             formatCount(static_cast<std::int64_t>(stored))),
                                 0.4, mapSets(photons, kRadius, white), kPapersPhoton * stored));
    plan.frames.back().stored = StoredLight::photons;
    plan.frames.back().photonsStored = static_cast<std::uint64_t>(stored);
  }
  return plan;
}

ExhibitPlan figureSixteen(std::int64_t photons) {
  ExhibitPlan plan{"Figure 16",
                   "Seconds of rendering by photon count, 60,000 particles",
                   "The photon map slows down with the photon count, the photosphere does not.",
                   "The figure's numbers are not in the text, so there is no ratio of the paper's "
                   "to compare with: what can be compared is the growth.",
                   "s",
                   false,
                   {}};
  for (const int factor : {1, 4, 16})
    plan.frames.push_back(
        column(fmt::format("photon map, {} photons", formatCount(photons * factor / 4)), 0.4,
               mapSets(photons * factor / 4, kRadius)));
  for (const int factor : {1, 4, 16})
    plan.frames.push_back(
        column(fmt::format("photosphere, {} photons", formatCount(photons * factor / 4)), 0.4,
               paperSets(photons * factor / 4, kRadius)));
  return plan;
}

}  // namespace

std::vector<ExhibitPlan> paperExhibits(std::int64_t photons) {
  return {tableOne(photons),      tableTwo(photons),       figureEleven(photons),
          figureTwelve(photons),  figureThirteen(photons), figureFourteen(photons),
          figureFifteen(photons), figureSixteen(photons),  memory(photons)};
}

}  // namespace photosphere::study
