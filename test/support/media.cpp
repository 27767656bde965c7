#include "support/media.h"

#include "photosphere/core/registry.h"

namespace photosphere::test {

using transport::MediumVolume;
using Field = volume::BrickField<float>;

namespace {

MediumVolume withOptions(const MediumOptions& options) {
  MediumVolume v;
  v.albedo = Rgb(static_cast<float>(options.albedo));
  v.phase = phase::HenyeyGreenstein(options.g);
  v.densityScale = options.extinction;
  return v;
}

std::vector<Vec3i> allBricks(const Vec3i& bricks) {
  std::vector<Vec3i> all;
  for (int z = 0; z < bricks.z; ++z)
    for (int y = 0; y < bricks.y; ++y)
      for (int x = 0; x < bricks.x; ++x)
        all.push_back({x, y, z});
  return all;
}

Mat4d placement(const Vec3d& size, const Vec3i& cells) {
  Mat4d m(1.0);
  for (int a = 0; a < 3; ++a) {
    m[a][a] = size[a] / cells[a];
    m[3][a] = -0.5 * size[a];
  }
  return m;
}

template <class T, class At>
volume::BrickField<T> sampleNodes(int cells, const Mat4d& localFromNode, const At& at) {
  const Vec3i bricks(cells / 8);
  return {Vec3i(0), bricks, allBricks(bricks), [&](const Vec3i& brick, T* nodes) {
            for (int z = 0; z < 9; ++z)
              for (int y = 0; y < 9; ++y)
                for (int x = 0; x < 9; ++x)
                  *nodes++ = at(transformPoint(localFromNode, Vec3d(brick * 8 + Vec3i(x, y, z))));
          }};
}

// Smooth value noise of unit lattice, in [0, 1].
double valueNoise(const Vec3d& p, unsigned seed) {
  const Vec3d base = glm::floor(p);
  const Vec3d f = p - base;
  auto at = [&](int x, int y, int z) {
    std::uint32_t h = static_cast<std::uint32_t>(static_cast<int>(base.x) + x) * 73856093u ^
                      static_cast<std::uint32_t>(static_cast<int>(base.y) + y) * 19349663u ^
                      static_cast<std::uint32_t>(static_cast<int>(base.z) + z) * 83492791u ^ seed;
    h ^= h >> 16;
    h *= 0x7feb352du;
    h ^= h >> 15;
    h *= 0x846ca68bu;
    h ^= h >> 16;
    return static_cast<double>(h) / 4294967295.0;
  };
  auto s = [](double t) { return t * t * (3 - 2 * t); };
  double sum = 0;
  for (int c = 0; c < 8; ++c) {
    const int x = c & 1, y = c >> 1 & 1, z = c >> 2;
    sum += at(x, y, z) * (x ? s(f.x) : 1 - s(f.x)) * (y ? s(f.y) : 1 - s(f.y)) *
           (z ? s(f.z) : 1 - s(f.z));
  }
  return sum;
}

}  // namespace

MediumVolume boxVolume(const Vec3d& size, const Vec3i& cells, const MediumOptions& options) {
  MediumVolume v = withOptions(options);
  const Vec3i bricks = cells / 8;
  v.density = Field(Vec3i(0), bricks, allBricks(bricks), [](const Vec3i&, float* nodes) {
    std::fill_n(nodes, Field::kBrickSize, 1.0f);
  });
  v.localFromNode = placement(size, cells);
  return v;
}

MediumVolume sampledVolume(double edge, int cells, const MediumOptions& options,
                           const std::function<double(const Vec3d&)>& density) {
  MediumVolume v = withOptions(options);
  v.localFromNode = placement(Vec3d(edge), Vec3i(cells));
  v.density = sampleNodes<float>(cells, v.localFromNode,
                                 [&](const Vec3d& p) { return static_cast<float>(density(p)); });
  return v;
}

transport::VolumeEmission sampledEmission(double edge, int cells,
                                          const std::function<Rgb(const Vec3d&)>& j) {
  transport::VolumeEmission e;
  e.localFromNode = placement(Vec3d(edge), Vec3i(cells));
  e.field = sampleNodes<Vec4f>(cells, e.localFromNode,
                               [&](const Vec3d& p) { return transport::emissionNode(j(p)); });
  return e;
}

transport::VolumeMotion sampledMotion(double edge, int cells,
                                      const std::function<Vec3d(const Vec3d&)>& v) {
  transport::VolumeMotion motion;
  motion.localFromNode = placement(Vec3d(edge), Vec3i(cells));
  motion.velocity = sampleNodes<Vec4f>(cells, motion.localFromNode,
                                       [&](const Vec3d& p) { return Vec4f(Vec3f(v(p)), 0.0f); });
  volume::forEachNode(motion.velocity, [&](const Vec4f& node) {
    motion.fastest = std::max(motion.fastest, glm::length(Vec3d(node)));
  });
  return motion;
}

double plumeDensity(const Vec3d& p) {
  const double height = p.z + 0.5;  // 0 to 1
  const double width = 0.08 + 0.3 * height;
  const double sway = 0.06 * std::sin(7 * height);
  const double r = std::sqrt((p.x - sway) * (p.x - sway) + p.y * p.y) / width;
  double body = 1 - r;
  double amplitude = 0.9;
  double frequency = 6;
  for (unsigned octave = 0; octave < 4; ++octave) {
    body += amplitude * (valueNoise(p * frequency + 31.7, octave) - 0.62);
    amplitude *= 0.55;
    frequency *= 2.1;
  }
  const double ends = std::min({1.0, height * 12, (1 - height) * 6});
  const double side = std::min(1.0, 10 * (0.49 - std::max(std::abs(p.x), std::abs(p.y))));
  return std::clamp(1.4 * body, 0.0, 1.0) * std::max(0.0, std::min(ends, side));
}

transport::Medium makeMedium(MediumVolume volume) {
  std::vector<MediumVolume> volumes;
  volumes.push_back(std::move(volume));
  return transport::Medium(std::move(volumes));
}

std::unique_ptr<lights::Light> makeLight(
    const std::string& type, const std::vector<std::pair<std::string, std::string>>& options) {
  const lights::LightPlugin& plugin = findPlugin(lights::lightModels(), type, "light", "test");
  ParamValues values(plugin.params);
  for (const auto& [name, text] : options)
    values.setText(name, text, "test");
  return plugin.create(values, lights::LocalSpace{});
}

transport::LightList lampsBesideAndWithin() {
  transport::LightList lights;
  lights.push_back(makeLight("point", {{"position", "[3, 1, 2]"}}));
  lights.push_back(makeLight("point", {{"position", "[0.1, 0.1, 0.1]"}}));
  return lights;
}

}  // namespace photosphere::test
