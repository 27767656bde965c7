// Dust: Henyey-Greenstein's function times 1 + alpha cos^2 (Draine 2003).

#include "rows.h"

namespace photosphere::phase::plugins {

namespace {

constexpr Param params[] = {
    cosineRow("g", "0.0", "of Henyey-Greenstein's factor; the ends are excluded"),
    {.name = "a",
     .unit = "",
     .defaultText = "1.0",
     .help = "weight of cos^2: 0 is henyey_greenstein; with g = 0, 1 is rayleigh",
     .min = 0.0,
     .max = 1e6},
};

PhaseFunction create(const ParamValues& values) {
  return Draine(values.real("g"), values.real("a"));
}

}  // namespace

extern const PhasePlugin draine;
const PhasePlugin draine = {
    .name = "draine",
    .help = "henyey_greenstein times 1 + alpha cos^2",
    .params = params,
    .create = create,
};

}  // namespace photosphere::phase::plugins
