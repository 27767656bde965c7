#include "photosphere/volume/particle_set.h"

#include <gtest/gtest.h>

namespace photosphere::volume {
namespace {

TEST(HoudiniName, TranslatesWhatOtherSoftwareWrites) {
  EXPECT_EQ(houdiniName("Position"), "P");
  EXPECT_EQ(houdiniName("world_position"), "P");
  EXPECT_EQ(houdiniName("Velocity"), "v");
  EXPECT_EQ(houdiniName("vel"), "v");
  EXPECT_EQ(houdiniName("pradius"), "pscale");
  EXPECT_EQ(houdiniName("RGB"), "Cd");
  EXPECT_EQ(houdiniName("particleId"), "id");
  EXPECT_EQ(houdiniName("LifeSpan"), "life");
  EXPECT_EQ(houdiniName("photon_histogram"), "photon_histogram");
  EXPECT_EQ(houdiniName(""), "");
}

TEST(ParticleSet, AddReplacesAndFindsByName) {
  ParticleSet set;
  set.positions.resize(2);
  set.add({"v", 3, std::vector<float>{1, 2, 3, 4, 5, 6}});
  EXPECT_EQ(set.find("v")->size(), 2u);
  EXPECT_EQ(set.find("v")->number(1, 2), 6);
  set.add({"v", 1, std::vector<std::int32_t>{7, 8}});
  ASSERT_EQ(set.attributes.size(), 1u);
  EXPECT_EQ(set.find("v")->number(1), 8);
  EXPECT_EQ(set.find("id"), nullptr);
  set.add({"label", 1, std::vector<std::string>{"a", "b"}});
  EXPECT_EQ(set.find("label")->number(0), 0);
}

}  // namespace
}  // namespace photosphere::volume
