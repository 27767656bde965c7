#include <algorithm>
#include <cmath>

#include "openvdb_grid.h"
#include "photosphere/core/error.h"
#include "photosphere/volume/vdb_file.h"

namespace photosphere::volume {

namespace {

template <class Value>
double magnitude(const Value& value) {
  if constexpr (openvdb::VecTraits<Value>::IsVec)
    return openvdb::Vec3d(value).length();
  else
    return static_cast<double>(value);
}

struct Accumulator {
  GridStatistics result;
  double sum = 0;
  std::uint64_t finite = 0;

  void add(double value, std::uint64_t voxels, const openvdb::Coord& at) {
    if (!std::isfinite(value)) {
      if (result.nans + result.infinities == 0) result.firstInvalid = fromOpenVdb(at);
      (std::isnan(value) ? result.nans : result.infinities) += voxels;
      return;
    }
    if (value < 0) result.negatives += voxels;
    result.min = finite ? std::min(result.min, value) : value;
    result.max = finite ? std::max(result.max, value) : value;
    sum += value * static_cast<double>(voxels);
    finite += voxels;
  }
};

}  // namespace

GridStatistics statistics(const Grid& grid) {
  if (!grid) throw InputError("grid", "is missing");
  Accumulator accumulator;
  const auto visit = [&](const auto& typed) {
    for (auto it = typed.cbeginValueOn(); it; ++it)
      accumulator.add(magnitude(*it), it.getVoxelCount(), it.getCoord());
  };
  if (!visitScalarGrid(*grid.base(), visit) && !visitVectorGrid(*grid.base(), visit))
    throw InputError(describe(grid), "has no scalar or vector values");
  if (accumulator.finite > 0)
    accumulator.result.mean = accumulator.sum / static_cast<double>(accumulator.finite);
  return accumulator.result;
}

}  // namespace photosphere::volume
