#pragma once
// Hard cases that are no frames of a scene file: fluxes through slabs, sums at the end of their
// range.

#include <string>

#include "photosphere/core/error.h"
#include "photosphere/study/stability.h"
#include "stability_catalogue.h"

namespace photosphere::study {

/// Runs a case of these kinds (StabilityCase::trace):
///
/// - `slab_flux`: photons through a slab of `tau`, `albedo`, `g`, sent in from all directions (by
///   their cosine) or, with `beam` = 1, straight. Oracles: diffusion, T of (4/3) / ((1-g) tau +
///   1.42); semi_infinite, R by Chandrasekhar's H function (albedo below 1, g = 0); conserved, R +
///   T + capped = 1 (albedo 1)
/// - `sums`: a lamp whose photons carry 2^`excess` times the power that it announces, so that a
///   thousand deposits weigh as much as any number; or, with `times`, a thousand photons into bins
///   that hold that many times as much. Oracles: counted, the light stored is in proportion, with
///   `times` every integer sum to the unit; error
///
/// The row is filled but for names. @throws ConfigError for another kind
void runStabilityTrace(const StabilityCase& c, bool quick, StabilityRow& row);

/// Judges a run that must be refused with the oracle's exit code and message.
void judgeRefusal(const StabilityCase& c, bool failed, ExitCode code, const std::string& message,
                  StabilityRow& row);

/// Reflectance of a semi-infinite medium that scatters evenly, for light from all directions by
/// their cosine, or straight down. Chandrasekhar, Radiative Transfer (1960), section 33.
double semiInfiniteReflectance(double albedo, bool beam);

}  // namespace photosphere::study
