#include "photosphere/volume/invalid_values.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "openvdb_grid.h"
#include "photosphere/core/error.h"

namespace photosphere::volume {

namespace {

// Largest magnitude that stays finite as float, whatever is rounded.
constexpr double kLargest = 3e38;

enum class Fault { none, negative, infinite, nan };

Fault faultOf(double v, bool negatives) {
  if (std::isnan(v)) return Fault::nan;
  if (!(std::abs(v) <= kLargest)) return Fault::infinite;
  return negatives && v < 0 ? Fault::negative : Fault::none;
}

// The worst component's, and which value it is.
template <class Value>
Fault worstFault(const Value& value, bool negatives, double& bad, double& largest) {
  if constexpr (openvdb::VecTraits<Value>::IsVec) {
    Fault worst = Fault::none;
    for (int c = 0; c < 3; ++c) {
      const auto v = static_cast<double>(value[c]);
      if (const Fault fault = faultOf(v, negatives); fault > worst) {
        worst = fault;
        bad = v;
      }
      if (worst == Fault::none) largest = std::max(largest, v);
    }
    return worst;
  } else {
    bad = static_cast<double>(value);
    const Fault fault = faultOf(bad, negatives);
    if (fault == Fault::none) largest = std::max(largest, bad);
    return fault;
  }
}

// @param base  of the grid, or of a copy of it
template <class Base, class Visit>
void visitValues(const Grid& grid, Base& base, const Visit& visit) {
  if (!visitScalarGrid(base, visit) && !visitVectorGrid(base, visit))
    throw InputError(describe(grid), "has no scalar or vector values");
}

void checkThere(const Grid& grid) {
  if (!grid) throw InputError("grid", "is missing");
}

}  // namespace

std::string InvalidValues::text() const {
  const bool isFinite = std::isfinite(firstValue) && std::abs(firstValue) > kLargest;
  return fmt::format(
      "{} NaN, {} infinite and {} negative values, the first ({}{}) at voxel ({}, {}, "
      "{})",
      nans, infinities, negatives, firstValue,
      isFinite ? fmt::format(", past {:.2g}, counts as infinite", kLargest) : "", first.x, first.y,
      first.z);
}

InvalidValues findInvalid(const Grid& grid, bool negatives) {
  InvalidValues found;
  checkThere(grid);
  visitValues(grid, *grid.base(), [&](const auto& typed) {
    for (auto it = typed.cbeginValueOn(); it; ++it) {
      double bad = 0;
      const Fault fault = worstFault(*it, negatives, bad, found.largest);
      if (fault == Fault::none) continue;
      if (found.total() == 0) {
        found.first = fromOpenVdb(it.getCoord());
        found.firstValue = bad;
      }
      (fault == Fault::nan        ? found.nans
       : fault == Fault::infinite ? found.infinities
                                  : found.negatives) += it.getVoxelCount();
    }
  });
  return found;
}

Grid withInvalidAsZero(const Grid& grid, bool negatives) {
  checkThere(grid);
  const openvdb::GridBase::Ptr copy = grid.base()->deepCopyGrid();
  const auto clean = [negatives]<class GridT>(GridT& typed) {
    using Value = typename GridT::ValueType;
    for (auto it = typed.beginValueOn(); it; ++it) {
      double bad = 0, largest = 0;
      if (worstFault(Value(*it), negatives, bad, largest) != Fault::none)
        it.setValue(openvdb::zeroVal<Value>());
    }
  };
  visitValues(grid, *copy, clean);
  return Grid(copy);
}

}  // namespace photosphere::volume
