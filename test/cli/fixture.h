#pragma once
// Files that the tests of the command line feed to the program.

#include <fmt/format.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <set>
#include <string>
#include <vector>

#include "photosphere/image/exr.h"
#include "photosphere/volume/particle_set.h"
#include "photosphere/volume/vdb_file.h"
#include "support/support.h"

namespace photosphere::test {

namespace fs = std::filesystem;

/// A ball of smoke, 12 voxels wide, denser in the middle, not symmetric.
inline volume::Grid ballOfSmoke(double voxelSize, const std::string& name = "density") {
  constexpr int n = 12;
  std::vector<float> values;
  for (int z = 0; z < n; ++z)
    for (int y = 0; y < n; ++y)
      for (int x = 0; x < n; ++x) {
        const double d = glm::length(Vec3d(x, y, z) - Vec3d(0.5 * (n - 1))) / (0.5 * n);
        values.push_back(d < 1 ? static_cast<float>((1 - d) * (1 + 0.1 * x)) : 0.0f);
      }
  Mat4d worldFromIndex(voxelSize);
  worldFromIndex[3][3] = 1;
  return volume::denseToGrid(name, Vec3i(n), values, worldFromIndex);
}

/// Frames smoke.0001.vdb to smoke.000`last`.vdb of that ball, which grows.
inline void writeSmokeFrames(const TemporaryFolder& folder, int last) {
  for (int i = 1; i <= last; ++i)
    volume::writeVdb(folder / ("smoke.000" + std::to_string(i) + ".vdb"),
                     {ballOfSmoke(0.05 * (1 + i))});
}

/// A scene of those frames, lit by one lamp.
/// @param volume, estimator  more keys of them, a line each
inline std::string litSmoke(int width, int height, int photons = 2000,
                            const std::string& volume = {}, const std::string& estimator = {}) {
  return fmt::format(R"([scene]
seed_per_frame = false
[camera]
position = [0.6, 0.5, 5]
look_at = [0.6, 0.5, 0.5]
fov = 30
resolution = [{}, {}]
[estimator]
photons = {}
{}
[[volume]]
file = "smoke.####.vdb"
density_scale = 4
{}
[[light]]
type = "point"
position = [3, 3, 2]
intensity = 50
)",
                     width, height, photons, estimator, volume);
}

/// The first channel in which two pictures differ by any bit; empty where they are the same.
inline std::string differingChannel(const fs::path& a, const fs::path& b) {
  const image::Image x = image::readExr(a).image, y = image::readExr(b).image;
  if (x.channels().size() != y.channels().size() || x.pixelCount() != y.pixelCount())
    return "their channels or sizes differ";
  for (std::size_t c = 0; c < x.channels().size(); ++c)
    if (x.channels()[c].name != y.channels()[c].name ||
        std::memcmp(x.channels()[c].pixels.data(), y.channels()[c].pixels.data(),
                    x.pixelCount() * sizeof(float)) != 0)
      return x.channels()[c].name;
  return {};
}

inline double massOf(const volume::Grid& grid) {
  const Vec3d h = grid.voxelSize();
  return volume::statistics(grid).mean * static_cast<double>(grid.activeVoxels()) * h.x * h.y * h.z;
}

/// `count` particles in a wavy ribbon, with the attributes that simulations have.
inline volume::ParticleSet ribbon(int count, bool withRadius) {
  volume::ParticleSet set;
  std::vector<float> velocity, radius, mass;
  std::vector<std::int32_t> id;
  for (int i = 0; i < count; ++i) {
    const double t = static_cast<double>(i) / count;
    set.positions.push_back({4 * t, std::sin(9 * t), 0.1 * (i % 7)});
    velocity.insert(velocity.end(), {1.5f, static_cast<float>(t), -0.25f});
    radius.push_back(0.05f + 0.05f * static_cast<float>(i % 3));
    mass.push_back(0.001f * static_cast<float>(1 + i % 5));
    id.push_back(1000 + i);
  }
  set.add({"v", 3, velocity});
  if (withRadius) set.add({"pscale", 1, radius});
  set.add({"mass", 1, mass});
  set.add({"id", 1, id});
  return set;
}

inline double massOf(const volume::ParticleSet& set) {
  double sum = 0;
  for (std::size_t i = 0; i < set.size(); ++i)
    sum += set.find("mass")->number(i);
  return sum;
}

/// Text PLY of positions and all numeric attributes.
inline void writePly(const fs::path& path, const volume::ParticleSet& set) {
  std::ofstream out(path);
  out.precision(9);
  out << "ply\nformat ascii 1.0\nelement vertex " << set.size()
      << "\nproperty double x\nproperty double y\nproperty double z\n";
  for (const volume::Attribute& a : set.attributes) {
    const bool whole = std::holds_alternative<std::vector<std::int32_t>>(a.data);
    const char* vectorNames[] = {"vx", "vy", "vz"};
    for (int c = 0; c < a.arity; ++c)
      out << "property " << (whole ? "int " : "float ") << (a.arity == 3 ? vectorNames[c] : a.name)
          << '\n';
  }
  out << "end_header\n";
  for (std::size_t i = 0; i < set.size(); ++i) {
    out << set.positions[i].x << ' ' << set.positions[i].y << ' ' << set.positions[i].z;
    for (const volume::Attribute& a : set.attributes)
      for (int c = 0; c < a.arity; ++c)
        out << ' ' << a.number(i, c);
    out << '\n';
  }
}

/// Names of everything in a folder, temporaries included.
inline std::set<std::string> namesIn(const fs::path& folder) {
  std::set<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder))
    names.insert(entry.path().filename().string());
  return names;
}

/// Cuts a file in half.
inline void truncate(const fs::path& path) {
  fs::resize_file(path, fs::file_size(path) / 2);
}

}  // namespace photosphere::test
