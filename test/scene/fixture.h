#pragma once
// Small caches and scenes for the tests of module scene.

#include <fmt/format.h>

#include <cmath>
#include <cstring>
#include <string>

#include "photosphere/core/error.h"
#include "photosphere/scene/pipeline.h"
#include "photosphere/volume/vdb_file.h"
#include "support/support.h"

namespace photosphere::test {

/// A ball of smoke of radius 1 about `center`, on voxels of the given edge.
inline volume::Grid ballGrid(const std::string& name, const Vec3d& center, double edge,
                             float value = 1.0f) {
  const int n = static_cast<int>(std::lround(2.4 / edge));
  Mat4d worldFromIndex(edge);
  worldFromIndex[3] = glm::dvec4(center - edge * (n - 1) / 2.0, 1.0);
  std::vector<float> values;
  for (int z = 0; z < n; ++z)
    for (int y = 0; y < n; ++y)
      for (int x = 0; x < n; ++x) {
        const Vec3d p = (Vec3d(x, y, z) - (n - 1) / 2.0) * edge;
        values.push_back(glm::length(p) < 1.0 ? value : 0.0f);
      }
  return volume::denseToGrid(name, Vec3i(n), values, worldFromIndex);
}

/// Numbers of a scene with a ball of radius `unit` at `center`, a spot and a camera around it.
inline std::string ballScene(const std::string& file, const Vec3d& center, double unit,
                             const std::string& more = {}) {
  const auto at = [&](double x, double y, double z) {
    const Vec3d p = center + unit * Vec3d(x, y, z);
    return fmt::format("[{:.17g}, {:.17g}, {:.17g}]", p.x, p.y, p.z);
  };
  return fmt::format(
      "[scene]\nmeters_per_unit = {:.17g}\n"
      "[camera]\nposition = {}\nlook_at = {}\nfov = 30\nresolution = [32, 32]\n"
      "[[volume]]\nfile = \"{}\"\ndensity_scale = 3\nphase = {{ g = 0.3 }}\n"
      "[[light]]\ntype = \"spot\"\nposition = {}\ntarget = {}\nintensity = 100\n"
      "[estimator]\nphotons = 20000\n[render]\nsamples = 2\n{}",
      1.0 / unit, at(0, 0, 6), at(0, 0, 0), file, at(3, 4, 2), at(0, 0, 0), more);
}

/// What `action` complains about, or an empty string.
template <class Action>
std::string complaint(const Action& action, ExitCode code = ExitCode::usage) {
  try {
    action();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), code) << error.what();
    return error.what();
  }
  return {};
}

inline bool sameBits(const std::vector<Rgb>& a, const std::vector<Rgb>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(Rgb)) == 0;
}

inline bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

}  // namespace photosphere::test
