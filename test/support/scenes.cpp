#include "support/scenes.h"

#include "photosphere/volume/vdb_file.h"
#include "support/support.h"

namespace photosphere::test {

TestScene columnScene(int pixels) {
  TestScene scene;
  const std::string path = projectFile("data/caches/column_0042.vdb").string();
  const volume::VdbFile file = volume::readVdb(path);
  const volume::Grid& grid = file.find("density");
  transport::MediumVolume v;
  v.density = volume::bricksFromGrid(grid, 0, path, false, 0);
  const Mat4d nodes = glm::dmat4(1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, v.density.origin().x,
                                 v.density.origin().y, v.density.origin().z, 1);
  v.localFromNode = grid.worldFromIndex() * nodes;
  v.localFromNode[3] += glm::dvec4(-2 + 0.025, -2 + 0.025, -1.6 + 0.025, 0);
  v.densityScale = 12;
  v.albedo = Rgb(0.9f);
  v.phase = phase::HenyeyGreenstein(0.7);
  scene.medium = std::make_unique<transport::Medium>(makeMedium(std::move(v)));
  scene.lights.push_back(makeLight("point", {{"position", "[5, 3, 2.9]"}, {"intensity", "1600"}}));
  scene.camera = perspectiveCamera({0, -11, 0.4}, 24, pixels);
  return scene;
}

}  // namespace photosphere::test
