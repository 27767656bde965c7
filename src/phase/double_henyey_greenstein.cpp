// Two lobes, such as a forward and a backward one.

#include "rows.h"

namespace photosphere::phase::plugins {

namespace {

constexpr Param params[] = {
    cosineRow("g1", "0.8", "mean cosine of the first lobe; the ends are excluded"),
    cosineRow("g2", "-0.3", "mean cosine of the second lobe; the ends are excluded"),
    {.name = "mix",
     .unit = "",
     .defaultText = "0.2",
     .help = "share of the second lobe; the first has the rest",
     .min = 0.0,
     .max = 1.0},
};

PhaseFunction create(const ParamValues& values) {
  return PhaseFunction(Draine(values.real("g1")), Draine(values.real("g2")), values.real("mix"));
}

}  // namespace

extern const PhasePlugin double_henyey_greenstein;
const PhasePlugin double_henyey_greenstein = {
    .name = "double_henyey_greenstein",
    .help = "two Henyey-Greenstein lobes",
    .params = params,
    .create = create,
};

}  // namespace photosphere::phase::plugins
