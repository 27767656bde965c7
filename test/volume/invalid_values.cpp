// What no coefficient can be is found, named and, where asked, zeroed.

#include <limits>

#include "openvdb_instances.h"
#include "photosphere/core/error.h"
#include "photosphere/volume/grid_variants.h"
#include "photosphere/volume/invalid_values.h"
#include "photosphere/volume/vdb_file.h"
#include "support/support.h"

namespace photosphere::test {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInf = std::numeric_limits<float>::infinity();

volume::Grid withValues(const std::vector<float>& values) {
  return volume::denseToGrid("density", {static_cast<int>(values.size()), 1, 1}, values, Mat4d(1.0),
                             {5, 6, 7}, 0);
}

TEST(InvalidValues, AreCountedByKindAndTheFirstIsNamed) {
  const volume::InvalidValues found =
      volume::findInvalid(withValues({1, 2, -3, kNan, kInf, -kInf, kNan}), true);
  EXPECT_EQ(found.nans, 2u);
  EXPECT_EQ(found.infinities, 2u);
  EXPECT_EQ(found.negatives, 1u);
  EXPECT_EQ(found.first, Vec3i(7, 6, 7));
  EXPECT_EQ(found.firstValue, -3);
  EXPECT_EQ(found.largest, 2);
  EXPECT_EQ(found.text(),
            "2 NaN, 2 infinite and 1 negative values, the first (-3) at voxel (7, 6, 7)");
  EXPECT_EQ(volume::findInvalid(withValues({1, 2, -3}), false).total(), 0u);
}

TEST(InvalidValues, DenormalAndHugeOnesAreValid) {
  const volume::InvalidValues found = volume::findInvalid(withValues({1e-42f, 1e30f}), true);
  EXPECT_EQ(found.total(), 0u);
  EXPECT_EQ(found.largest, 1e30f);
}

TEST(InvalidValues, BecomeZeroAndStayActive) {
  const volume::Grid clean = volume::withInvalidAsZero(withValues({1, kNan, -3, kInf, 4}), true);
  EXPECT_EQ(volume::findInvalid(clean, true).total(), 0u);
  EXPECT_EQ(clean.activeVoxels(), 5u);
  EXPECT_EQ(volume::statistics(clean).max, 4);
  EXPECT_EQ(volume::statistics(volume::withInvalidAsZero(withValues({kNan, -3}), false)).min, -3);
}

TEST(InvalidValues, OfAVectorCountOnceByItsWorstComponent) {
  const volume::Grid grid =
      volume::denseVectorToGrid("v", {2, 1, 1}, {1, -2, kNan, -1, 2, 3}, Mat4d(1.0));
  const volume::InvalidValues found = volume::findInvalid(grid, true);
  EXPECT_EQ(found.nans, 1u);
  EXPECT_EQ(found.negatives, 1u);
  EXPECT_EQ(volume::statistics(volume::withInvalidAsZero(grid, false)).nans, 0u);
}

TEST(InvalidValues, OfATileCountWithAllItsVoxels) {
  const volume::Grid tile =
      volume::constantGrid("density", {Vec3i(0), Vec3i(127)}, kNan, Mat4d(1.0));
  EXPECT_EQ(volume::findInvalid(tile, true).nans, 128ull * 128 * 128);
}

TEST(InvalidValues, BeyondAFloatAreInfinite) {
  openvdb::initialize();
  auto grid = openvdb::DoubleGrid::create();
  grid->getAccessor().setValue({1, 2, 3}, 1e300);
  EXPECT_EQ(volume::findInvalid(volume::Grid(grid), true).infinities, 1u);
}

TEST(GridVariants, KeepTheValues) {
  const volume::Grid from = withValues({1, 2.4f, 1000});
  const std::map<std::string, std::string> types{{"float", "float"},   {"half", "float (half)"},
                                                 {"double", "double"}, {"int32", "int32"},
                                                 {"int64", "int64"},   {"bool", "bool"}};
  for (const auto& [type, stored] : types) {
    const volume::Grid to = volume::ofType(from, type);
    EXPECT_EQ(to.valueType(), stored);
    EXPECT_EQ(to.activeBounds().min, from.activeBounds().min);
    EXPECT_EQ(to.activeVoxels(), 3u);
    EXPECT_EQ(volume::statistics(to).max, type == "bool" ? 1 : 1000) << type;
  }
  EXPECT_THROW(volume::ofType(from, "quad"), InputError);
  const volume::Grid block =
      volume::denseToGrid("density", Vec3i(3), std::vector<float>(27, 1.0f), Mat4d(1.0));
  EXPECT_FALSE(volume::inFrustum(block).isAffine());
}

}  // namespace
}  // namespace photosphere::test
