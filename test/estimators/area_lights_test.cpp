// Lamps with a surface and pictures of the surroundings, in every estimator, against path tracing.

#include <gtest/gtest.h>

#include "photosphere/image/exr.h"
#include "support/frames.h"
#include "support/support.h"

namespace photosphere::test {
namespace {

using namespace estimators;

// A dim gradient with a small bright sun.
std::string writeSky(const TemporaryFolder& folder) {
  image::Image picture(64, 32);
  picture.addLayer("", image::ChannelKind::color);
  for (int y = 0; y < 32; ++y)
    for (int x = 0; x < 64; ++x) {
      const bool sun = y >= 6 && y < 8 && x >= 10 && x < 12;
      for (const char* channel : {"R", "G", "B"})
        picture.channel(channel)[picture.index(x, y)] =
            sun ? 400.0f : 0.3f + 0.02f * static_cast<float>(32 - y);
    }
  const std::string path = (folder / "sky.exr").string();
  image::writeExr(path, picture);
  return path;
}

struct Row {
  const char* type;
  std::vector<std::pair<std::string, std::string>> options;
};

TEST(AreaLights, AgreeWithPathTracing) {
  const RunOnly runOnly;
  const TemporaryFolder folder;
  const Row rows[] = {
      {"rect",
       {{"position", "[1.2, -0.4, 1]"},
        {"target", "[0, 0, 0]"},
        {"size", "[1, 0.6]"},
        {"intensity", "20"}}},
      {"disk",
       {{"position", "[-1, -1, 0.4]"},
        {"target", "[0, 0, 0]"},
        {"radius", "0.5"},
        {"intensity", "20"}}},
      {"sphere", {{"position", "[0.9, 0.3, 0.5]"}, {"radius", "0.25"}, {"intensity", "30"}}},
      {"point", {{"position", "[-1, 0.7, 0.8]"}, {"radius", "0.3"}, {"intensity", "8"}}},
      {"spot",
       {{"position", "[1, -1, 0.8]"},
        {"target", "[0, 0, 0]"},
        {"cone_angle", "25"},
        {"cone_edge", "8"},
        {"radius", "0.25"},
        {"intensity", "12"}}},
      {"environment", {{"file", writeSky(folder)}, {"intensity", "1"}}},
  };
  for (const Row& row : rows) {
    TestScene scene = plumeScene(0.5, 64, 48);
    scene.lights.clear();
    scene.lights.push_back(makeLight(row.type, row.options));
    const Truth truth = pathTruth(scene, 96);
    LightFieldLayout layout;
    layout.channels = 1;
    layout.unscattered = true;
    PhotonMapLayout map;
    map.channels = 1;
    map.radius = 0.03;
    map.unscattered = true;
    const auto check = [&](const char* way, const render::FrameLayers& frame, double mean) {
      EXPECT_EQ(frame.nanSamples + frame.negativeSamples, 0u) << row.type;
      const LayerError single = truth.errorOf(frame, &render::FrameLayers::single);
      const LayerError multiple = truth.errorOf(frame, &render::FrameLayers::multiple);
      std::printf("  %-12s %-12s single %.4f %.5f  multiple %.4f %.5f\n", row.type, way,
                  single.meanRatio, single.relMse, multiple.meanRatio, multiple.relMse);
      EXPECT_NEAR(single.meanRatio, 1, mean) << row.type << ", " << way;
      EXPECT_NEAR(multiple.meanRatio, 1, mean) << row.type << ", " << way;
      EXPECT_LT(multiple.relMse, 0.1) << row.type << ", " << way;
    };
    check("photosphere", renderPhotosphere(scene, layout, 200'000, 5).layers, 0.035);
    check("photon map", renderPhotonMap(scene, map, 200'000, 5).layers, 0.06);
  }
}

}  // namespace
}  // namespace photosphere::test
