// Which layouts have a meaning.

#include <fmt/format.h>

#include <algorithm>

#include "photosphere/core/error.h"
#include "photosphere/estimators/light_field.h"

namespace photosphere::estimators {

namespace {

void refuse(bool wrong, const char* message) {
  if (wrong) throw ConfigError(message);
}

// The cells nearest to a wished number of restored directions.
void checkDirections(int wished) {
  for (int n = 1; 8 * n * n <= wished; ++n)
    if (8 * n * n == wished) return;
  int n = 1;
  while (8 * (n + 1) * (n + 1) < wished)
    ++n;
  throw ConfigError(fmt::format(
      "directions = {}: restored directions are the cells of a partition, 8 n^2; the nearest are "
      "{} and {}",
      wished, 8 * n * n, 8 * (n + 1) * (n + 1)));
}

}  // namespace

void checkLayout(const LightFieldLayout& l) {
  const bool particles = l.carrier == Carrier::particles;
  const bool smooths = l.angularKernel != sphere::AngularKernel::none;
  refuse(l.energy == EnergyRule::scatter && !l.holdsPower(),
         "energy = \"scatter\" needs carrier = \"particles\" and deposit = \"collision\"; other "
         "carriers hold no energy to share out");
  refuse(l.merge == Merge::sampled && !particles,
         "merge = \"sampled\" draws one bin of each particle: it needs carrier = \"particles\"");
  refuse(
      l.smoothing == Smoothing::visible && l.holdsPower(),
      "smoothing = \"visible\" weighs fluence on voxels: it needs carrier = \"voxels\" or deposit "
      "= \"track_length\"");
  refuse(l.smoothing != Smoothing::twicing && l.smoothing != Smoothing::visible &&
             (particles || l.evaluate == Evaluate::perStep),
         "smoothing = \"plain\", \"density\" and \"mean\" are of fluence on voxels, once for each "
         "view: they need carrier = \"voxels\" and evaluate = \"per_view\"");
  if (l.basis == Basis::view) {
    refuse(l.evaluate != Evaluate::perView,
           "evaluate = \"per_step\" reads directions at every step, and basis = \"view\" keeps "
           "none: choose \"histogram\" or \"spherical_harmonics\"");
  }
  if (l.basis != Basis::histogram) {
    refuse(l.direction != sphere::DirectionDeposit::nearest,
           "'direction' chooses bins: it needs basis = \"histogram\"");
    refuse(l.representative != Representative::bin,
           "'representative' is a bin's direction: it needs basis = \"histogram\"");
    refuse(l.merge != Merge::full, "'merge' joins bins: it needs basis = \"histogram\"");
    if (smooths) l.directionKernel();
    return;
  }
  refuse(
      l.direction == sphere::DirectionDeposit::kernel && !smooths,
      "direction = \"kernel\" spreads a photon over bins by 'kernel': choose \"epanechnikov\" or "
      "\"gaussian\" for it");
  l.directionKernel();  // bandwidth and truncation make a kernel
  if (l.merge == Merge::sampled && l.evaluate == Evaluate::perStep) checkDirections(l.directions);
}

}  // namespace photosphere::estimators
