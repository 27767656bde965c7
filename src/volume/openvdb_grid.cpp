#include "openvdb_grid.h"

#include <fmt/format.h>

#include <cmath>
#include <mutex>

#include "photosphere/core/error.h"

namespace photosphere::volume {

void initializeOpenVdb() {
  static std::once_flag once;
  std::call_once(once, [] { openvdb::initialize(); });
}

openvdb::Mat4d toOpenVdb(const Mat4d& m) {
  openvdb::Mat4d result;
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 4; ++j)
      result(i, j) = m[i][j];
  return result;
}

Mat4d fromOpenVdb(const openvdb::Mat4d& m) {
  Mat4d result;
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 4; ++j)
      result[i][j] = m(i, j);
  return result;
}

openvdb::math::Transform::Ptr makeTransform(const Mat4d& worldFromIndex) {
  bool finite = true;
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 4; ++j)
      finite = finite && std::isfinite(worldFromIndex[i][j]);
  const bool affine = worldFromIndex[0][3] == 0 && worldFromIndex[1][3] == 0 &&
                      worldFromIndex[2][3] == 0 && worldFromIndex[3][3] == 1;
  if (!finite || !affine)
    throw ConfigError("a grid's transform must be a finite affine matrix with bottom row 0 0 0 1");
  try {
    return openvdb::math::Transform::createLinearTransform(toOpenVdb(worldFromIndex));
  } catch (const openvdb::Exception&) {
    throw ConfigError(
        "a grid's transform must have an inverse; this one flattens the volume, or its voxels are "
        "smaller than about 1e-5 scene units, which OpenVDB takes for flat: use larger units");
  }
}

std::string describe(const Grid& grid) {
  return fmt::format("{} grid \"{}\"", grid.valueType(), grid.name());
}

}  // namespace photosphere::volume
