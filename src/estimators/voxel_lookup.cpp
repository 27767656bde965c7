#include "voxel_lookup.h"

#include <algorithm>

#include "photosphere/core/parallel.h"

namespace photosphere::estimators {

std::vector<float> sampleAtParticles(const LightField& field, const std::vector<Vec3f>& positions) {
  const auto stride = static_cast<std::size_t>(field.layout.valuesPerCarrier());
  std::vector<float> out(positions.size() * stride, 0.0f);
  const transport::SupportLattice& lattice = field.lattice;
  parallelFor(positions.size(), 256, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Vec3d u = (Vec3d(positions[i]) - lattice.origin()) / lattice.edge() - 0.5;
      const Vec3d base = glm::floor(u);
      const Vec3f f(u - base);
      const Vec3i v(glm::clamp(base, Vec3d(-1e9), Vec3d(1e9)));
      float* target = out.data() + i * stride;
      float total = 0.0f;
      for (int corner = 0; corner < 8; ++corner) {
        const Vec3i c(corner & 1, corner >> 1 & 1, corner >> 2);
        const std::int32_t n = lattice.number(v + c);
        const float w = (c.x ? f.x : 1 - f.x) * (c.y ? f.y : 1 - f.y) * (c.z ? f.z : 1 - f.z);
        if (n < 0 || !(w > 0.0f)) continue;
        const float* source = field.values.data() + static_cast<std::size_t>(n) * stride;
        for (std::size_t k = 0; k < stride; ++k)
          target[k] += w * source[k];
        total += w;
      }
      if (total > 0.0f)
        for (std::size_t k = 0; k < stride; ++k)
          target[k] /= total;
    }
  });
  return out;
}

}  // namespace photosphere::estimators
