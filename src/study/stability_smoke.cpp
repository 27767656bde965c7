#include "stability_smoke.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>

#include "photosphere/core/error.h"
#include "photosphere/core/rng.h"
#include "photosphere/volume/grid_variants.h"
#include "photosphere/volume/particle_set.h"
#include "photosphere/volume/vdb_file.h"

namespace photosphere::study {

using volume::Grid;

namespace {

double lobe(const Vec3d& q, const Vec3d& center, double radius) {
  const double s = std::max(0.0, 1 - glm::dot(q - center, q - center) / (radius * radius));
  return s * s;
}

// Density in a cube of edge 1 about the origin.
double blobDensity(const Vec3d& q) {
  return lobe(q, {-0.08, -0.05, 0.04}, 0.38) + 0.7 * lobe(q, {0.16, 0.14, -0.1}, 0.28);
}

Vec3d asVector(const std::vector<double>& list, const Vec3d& fallback) {
  if (list.empty()) return fallback;
  if (list.size() == 1) return Vec3d(list[0]);
  return {list[0], list[1], list.size() > 2 ? list[2] : list[1]};
}

Mat4d translation(const Vec3d& offset) {
  Mat4d m(1.0);
  m[3] = glm::dvec4(offset, 1.0);
  return m;
}

// Where a grid's voxels lie, in the file and in the world, and which of them the smoke needs.
struct Lattice {
  Mat4d fileFromIndex{1.0}, worldFromIndex{1.0};
  Vec3i first{0}, count{0};
};

class Smoke {
 public:
  explicit Smoke(const SmokeSpec& spec)
      : m_spec(spec),
        m_kind(spec.text("kind", "blob")),
        m_size(spec.number("size", 1)),
        m_center(asVector(spec.list("center"), Vec3d(0.0))) {}

  void write(const std::filesystem::path& path) {
    std::vector<Grid> grids;
    if (m_kind != "points") {
      grids.push_back(density());
      if (m_spec.numbers.contains("flame"))
        grids.push_back(volume::renamed(filled(m_spec.number("flame", 1)), "flame"));
      if (m_spec.numbers.contains("velocity")) grids.push_back(velocity());
    }
    const double points = m_spec.number("points", m_kind == "points" ? 256 : 512);
    if (points > 0) grids.push_back(particles(static_cast<std::size_t>(points)));
    volume::writeVdb(path, grids);
  }

 private:
  Vec3i dims() const {
    return Vec3i(asVector(m_spec.list("dims"), Vec3d(m_spec.number("voxels", 16))));
  }

  Lattice lattice() const {
    Lattice l;
    const Vec3d extent = asVector(m_spec.list("extent"), Vec3d(m_size));
    const Vec3d edge = extent / Vec3d(dims());
    Mat4d linear(1.0);
    const std::vector<double> rows = m_spec.list("matrix", {1, 0, 0, 0, 1, 0, 0, 0, 1});
    for (int i = 0; i < 9; ++i)
      linear[i % 3][i / 3] = rows.at(static_cast<std::size_t>(i));
    Mat4d scene(1.0);
    if (const std::vector<double> all = m_spec.list("scene_matrix"); all.size() == 16)
      for (int i = 0; i < 16; ++i)
        scene[i % 4][i / 4] = all[static_cast<std::size_t>(i)];
    Mat4d scale(1.0);
    for (int a = 0; a < 3; ++a)
      scale[a][a] = edge[a];
    const Vec3d middle = 0.5 * Vec3d(dims()) - 0.5;
    const Vec3d center = transformPoint(glm::inverse(scene), m_center);
    l.fileFromIndex = translation(center) * linear * scale * translation(-middle);
    l.worldFromIndex = scene * l.fileFromIndex;
    if (m_kind != "blob") {
      l.count = dims();
      return l;
    }
    const Box3d box = transformBox(glm::inverse(l.worldFromIndex),
                                   {m_center - 0.5 * m_size, m_center + 0.5 * m_size});
    l.first = Vec3i(glm::floor(box.min));
    l.count = Vec3i(glm::ceil(box.max)) - l.first + 1;
    return l;
  }

  double densityAt(const Vec3d& world) const {
    if (m_kind == "zeros") return 0;
    return m_kind == "blob" ? blobDensity((world - m_center) / m_size) : 1.0;
  }

  // The smoke's shape times a factor, as floats.
  Grid filled(double factor) const {
    const Lattice l = lattice();
    if (m_kind == "tile")
      return volume::constantGrid("density", {l.first, l.first + l.count - 1},
                                  static_cast<float>(factor), l.fileFromIndex);
    if (m_kind == "empty") return volume::denseToGrid("density", Vec3i(1), {0.0f}, l.fileFromIndex);
    std::vector<float> values;
    for (int z = 0; z < l.count.z; ++z)
      for (int y = 0; y < l.count.y; ++y)
        for (int x = 0; x < l.count.x; ++x)
          values.push_back(static_cast<float>(
              factor *
              densityAt(transformPoint(l.worldFromIndex, Vec3d(l.first + Vec3i(x, y, z))))));
    const Vec3i middle = l.count / 2;
    const std::vector<double> bad = m_spec.list("bad");
    for (std::size_t i = 0; i < bad.size(); ++i) {
      const int x = middle.x - 2 + static_cast<int>(i);
      values.at(static_cast<std::size_t>((middle.z * l.count.y + middle.y) * l.count.x + x)) =
          static_cast<float>(bad[i]);
    }
    // A background that no voxel has: all stay active, zeros too.
    const float background = m_kind == "zeros" ? -1.0f : 0.0f;
    return volume::denseToGrid("density", l.count, values, l.fileFromIndex, l.first, background);
  }

  Grid density() const {
    const Grid grid =
        volume::ofType(filled(m_spec.number("value", 1)), m_spec.text("type", "float"));
    return m_spec.number("frustum", 0) > 0 ? volume::inFrustum(grid) : grid;
  }

  // Beyond the smoke's box lies a background that would carry it off.
  Grid velocity() const {
    const Lattice l = lattice();
    return volume::constantVectorGrid("v", {l.first, l.first + l.count - 1},
                                      Vec3f(asVector(m_spec.list("velocity"), Vec3d(0.0))),
                                      Vec3f(1e3f), l.fileFromIndex);
  }

  // Particles drawn from the blob's density, or all at one place.
  Grid particles(std::size_t count) const {
    volume::ParticleSet set;
    Rng rng(RandomKey::fromSeed(5, 0), RandomStream::photon, 0);
    const std::vector<double> at = m_spec.list("at");
    while (set.size() < count) {
      const Vec2f u = rng.uniform2();
      const Vec3d q = Vec3d(static_cast<double>(u.x), static_cast<double>(u.y),
                            static_cast<double>(rng.uniform())) -
                      0.5;
      const bool taken = static_cast<double>(rng.uniform()) < blobDensity(q) || m_kind == "box" ||
                         m_kind == "tile";
      if (!at.empty())
        set.positions.push_back(asVector(at, Vec3d(0.0)));
      else if (taken)
        set.positions.push_back(m_center + m_size * q);
    }
    if (m_spec.numbers.contains("stray")) {
      set.positions.push_back(asVector(m_spec.list("stray"), Vec3d(0.0)));
      ++count;
    }
    const double pscale = m_spec.number("pscale", 0.1 * m_size);
    std::vector<float> radii(count, static_cast<float>(pscale));
    const std::vector<double> bad = m_spec.list("bad_pscale");
    for (std::size_t i = 0; i < bad.size() && i < count; ++i)
      radii[i] = static_cast<float>(bad[i]);
    set.add({"pscale", 1, std::move(radii)});
    if (m_spec.numbers.contains("mass"))
      set.add({"mass", 1,
               std::vector<double>(count, m_spec.number("mass", 1) / static_cast<double>(count))});
    return volume::pointsToGrid(set, "points", 0);
  }

  const SmokeSpec& m_spec;
  std::string m_kind;
  double m_size;
  Vec3d m_center;
};

}  // namespace

void writeStabilitySmoke(const SmokeSpec& spec, const std::filesystem::path& path) {
  const std::string kind = spec.text("kind", "blob");
  for (const char* known : {"blob", "box", "tile", "empty", "zeros", "points"})
    if (kind == known) return Smoke(spec).write(path);
  throw ConfigError(fmt::format("smoke of kind '{}' is unknown", kind));
}

}  // namespace photosphere::study
