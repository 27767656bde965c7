// One lobe, forward or backward, of a given mean cosine.

#include "rows.h"

namespace photosphere::phase::plugins {

namespace {

constexpr Param params[] = {
    cosineRow("g", "0.0",
              "mean cosine of the scattering angle: 0 even, toward 1 forward, toward -1 backward; "
              "the ends are excluded"),
};

PhaseFunction create(const ParamValues& values) {
  return HenyeyGreenstein(values.real("g"));
}

}  // namespace

extern const PhasePlugin henyey_greenstein;
const PhasePlugin henyey_greenstein = {
    .name = "henyey_greenstein",
    .help = "one lobe of mean cosine g",
    .params = params,
    .create = create,
};

}  // namespace photosphere::phase::plugins
