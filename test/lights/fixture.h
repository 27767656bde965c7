#pragma once
// Lights made from scene-file text, for the tests of this folder.

#include <fmt/format.h>

#include <cmath>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "photosphere/core/registry.h"
#include "photosphere/core/rng.h"
#include "photosphere/core/sampling.h"
#include "photosphere/lights/light.h"
#include "support/support.h"

namespace photosphere::lights {

using Options = std::vector<std::pair<std::string, std::string>>;

inline std::unique_ptr<Light> makeLight(const std::string& type, const Options& options,
                                        const LocalSpace& space = {}) {
  const LightPlugin& plugin = findPlugin(lightModels(), type, "light", "test");
  ParamValues values(plugin.params);
  for (const auto& [name, value] : options)
    values.setText(name, value, "test");
  return plugin.create(values, space);
}

inline Vec4f uniform4(Rng& rng) {
  const Vec2f a = rng.uniform2();
  const Vec2f b = rng.uniform2();
  return {a.x, a.y, b.x, b.y};
}

/// Mean and the standard error of a mean.
class Mean {
 public:
  void add(double x) {
    m_count += 1;
    const double d = x - m_mean;
    m_mean += d / m_count;
    m_squares += d * (x - m_mean);
  }
  double mean() const { return m_mean; }
  double error() const { return std::sqrt(m_squares / m_count / m_count); }

 private:
  double m_count = 0, m_mean = 0, m_squares = 0;
};

}  // namespace photosphere::lights
