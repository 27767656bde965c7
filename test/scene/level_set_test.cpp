// Distances from a surface are no density, whatever the scene allows.

#include <openvdb/openvdb.h>

#include "fixture.h"

namespace photosphere::scene {
namespace {

using test::contains;
using test::TemporaryFolder;

volume::Grid levelSet(bool negative) {
  const auto grid = openvdb::FloatGrid::create(0.3f);
  for (int x = -3; x <= 3; ++x)
    for (int y = -3; y <= 3; ++y) {
      const float distance = 0.1f * static_cast<float>(std::abs(x) + std::abs(y) - 2);
      grid->tree().setValueOn(openvdb::Coord(x, y, 0), negative ? distance : std::abs(distance));
    }
  grid->setName("density");
  grid->setGridClass(openvdb::GRID_LEVEL_SET);
  return volume::Grid(grid);
}

TEST(LevelSet, IsNoDensity) {
  const TemporaryFolder folder;
  for (const bool negative : {true, false}) {
    const std::string file = (folder / "surface.vdb").string();
    volume::writeVdb(file, {levelSet(negative)});
    for (const bool allowed : {true, false}) {
      SceneFile scene = parseScene(test::ballScene(file, Vec3d(0), 1), "test.toml", folder.path());
      scene.allowInvalid = allowed;
      std::string message;
      try {
        setUpFrame(scene, 1);
      } catch (const InputError& error) {
        message = error.what();
      }
      // One that has none below zero may be smoke under a wrong name.
      EXPECT_EQ(contains(message, "is a level set"), negative) << message;
      EXPECT_EQ(contains(message, file), negative) << message;
    }
  }
}

}  // namespace
}  // namespace photosphere::scene
