// Molecules, and smoke much finer than the wavelength: 3 / (16 pi) (1 + cos^2).

#include "photosphere/phase/phase.h"

namespace photosphere::phase::plugins {

namespace {

PhaseFunction create(const ParamValues&) {
  return Draine(0.0, 1.0);
}

}  // namespace

extern const PhasePlugin rayleigh;
const PhasePlugin rayleigh = {
    .name = "rayleigh",
    .help = "particles far smaller than the wavelength: as much forward as backward",
    .params = {},
    .create = create,
};

}  // namespace photosphere::phase::plugins
