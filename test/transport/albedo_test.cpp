// The largest albedo that a medium reports: of the smoke, not of the grid around it.

#include <gtest/gtest.h>

#include "photosphere/transport/medium.h"

namespace photosphere::test {
namespace {

using namespace transport;

// 3 x 1 x 1 bricks of nodes `edge` apart, from a function of the node.
template <class Value>
volume::BrickField<float> field(const Value& value) {
  const std::vector<Vec3i> candidates{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}};
  return volume::BrickField<float>(Vec3i(0), Vec3i(3, 1, 1), candidates,
                                   [&](const Vec3i& brick, float* nodes) {
                                     for (int z = 0; z < 9; ++z)
                                       for (int y = 0; y < 9; ++y)
                                         for (int x = 0; x < 9; ++x)
                                           *nodes++ = value(brick * 8 + Vec3i(x, y, z));
                                   });
}

MediumVolume smoke() {
  MediumVolume v;
  v.density = field([](const Vec3i& n) { return n.x >= 4 && n.x <= 12 ? 1.0f : 0.0f; });
  return v;
}

TEST(MediumAlbedo, OfAGridIsItsLargestWhereThereIsSmoke) {
  MediumVolume v = smoke();
  // Smoke reaches from node 3 to node 13; beyond it the grid holds more.
  v.albedoFields.push_back(
      field([](const Vec3i& n) { return n.x <= 13 ? 0.01f * static_cast<float>(n.x) : 0.9f; }));
  EXPECT_FLOAT_EQ(Medium({v}).maximumAlbedo(), 0.13f);
  // The same grid under another placement: what lies over the smoke is another part of it.
  v.localFromAlbedoNode[3].x = -1.0;
  EXPECT_FLOAT_EQ(Medium({v}).maximumAlbedo(), 0.9f);
  v.localFromAlbedoNode = glm::dmat4(2.0);
  v.localFromAlbedoNode[3].w = 1.0;
  EXPECT_FLOAT_EQ(Medium({v}).maximumAlbedo(), 0.07f);
}

TEST(MediumAlbedo, OfAGridThatIsZeroInTheSmokeIsZero) {
  MediumVolume v = smoke();
  v.albedoFields.push_back(field([](const Vec3i& n) { return n.x > 13 ? 0.9f : 0.0f; }));
  EXPECT_EQ(Medium({v}).maximumAlbedo(), 0.0f);
  v.albedoFields.push_back(field([](const Vec3i& n) { return n.x == 8 ? 0.25f : 0.0f; }));
  EXPECT_EQ(Medium({v}).maximumAlbedo(), 0.25f);
}

TEST(MediumAlbedo, OfSeveralVolumesIsTheLargestOfThoseWithSmoke) {
  MediumVolume dark = smoke(), empty = smoke();
  dark.albedo = Rgb(0.1f, 0.3f, 0.2f);
  empty.density = {};
  empty.albedo = Rgb(0.8f);
  EXPECT_FLOAT_EQ(Medium({dark, empty}).maximumAlbedo(), 0.3f);
}

}  // namespace
}  // namespace photosphere::test
