#include "photosphere/phase/phase.h"

#include <fmt/format.h>

#include <cmath>

#include "photosphere/core/error.h"

namespace photosphere::phase {

HenyeyGreenstein::HenyeyGreenstein(double g) : m_g(g) {
  const double absG = std::abs(g);
  if (!(absG < 1.0))  // also true for NaN
    throw ConfigError(fmt::format("phase: g = {} is not a mean cosine; use -1 < g < 1", g));
  m_absG = static_cast<float>(absG);
  m_sign = g < 0 ? -1.0f : 1.0f;
  m_oneMinusAbsG = static_cast<float>(1.0 - absG);
  m_oneMinusAbsGSquared = static_cast<float>((1.0 - absG) * (1.0 - absG));
  m_numerator = static_cast<float>((1.0 - absG) * (1.0 + absG) / (4.0 * kPi));
}

}  // namespace photosphere::phase
