// Water droplets: the fit of a Henyey-Greenstein and a Draine lobe to Mie theory by Jendersie and
// d'Eon 2023, "An approximate Mie scattering function for fog and cloud rendering", eqs. 4 to 7.

#include <cmath>

#include "photosphere/phase/phase.h"

namespace photosphere::phase::plugins {

namespace {

constexpr Param params[] = {
    {.name = "droplet_diameter",
     .unit = "micrometres",
     .defaultText = "10.0",
     .help = "of the droplets: fog 5 to 20, clouds up to 50",
     .min = 5.0,
     .max = 50.0},
};

PhaseFunction create(const ParamValues& values) {
  const double d = values.real("droplet_diameter");
  const double gHg = std::exp(-0.0990567 / (d - 1.67154));
  const double gDraine = std::exp(-2.20679 / (d + 3.91029) - 0.428934);
  const double alpha = std::exp(3.62489 - 8.29288 / (d + 5.52825));
  const double weight = std::exp(-0.599085 / (d - 0.641583) - 0.665888);
  return PhaseFunction(Draine(gHg), Draine(gDraine, alpha), weight);
}

}  // namespace

extern const PhasePlugin mie_fog;
const PhasePlugin mie_fog = {
    .name = "mie_fog",
    .help = "water droplets, an approximation of Mie theory",
    .params = params,
    .create = create,
};

}  // namespace photosphere::phase::plugins
