// Scatters alike into all directions.

#include "photosphere/phase/phase.h"

namespace photosphere::phase::plugins {

namespace {

PhaseFunction create(const ParamValues&) {
  return HenyeyGreenstein(0.0);
}

}  // namespace

extern const PhasePlugin isotropic;
const PhasePlugin isotropic = {
    .name = "isotropic",
    .help = "the same in all directions",
    .params = {},
    .create = create,
};

}  // namespace photosphere::phase::plugins
