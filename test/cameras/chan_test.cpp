// Nuke's ASCII cameras: conventions, and what damaged text says.
#include "photosphere/cameras/chan.h"

#include <cmath>

#include "photosphere/cameras/camera.h"
#include "photosphere/core/error.h"
#include "photosphere/core/registry.h"
#include "support/support.h"

namespace photosphere::cameras {
namespace {

Mat3d turned(double rx, double ry, double rz) {
  return Mat3d(
      parseChan(fmt::format("1 0 0 0 {} {} {}\n", rx, ry, rz), "test").at(0).worldFromCamera);
}

void expectNear(const Vec3d& a, const Vec3d& b, const char* what) {
  EXPECT_LT(glm::length(a - b), 1e-14) << what << ": " << a.x << ' ' << a.y << ' ' << a.z;
}

// Single turns tell the signs, pairs of quarter turns the order: roll first, then tilt, then pan.
TEST(Chan, TurnsInTheOrderZxy) {
  const Vec3d x(1, 0, 0), y(0, 1, 0), z(0, 0, 1);
  expectNear(turned(0, 90, 0) * -z, -x, "a pan to the left");
  expectNear(turned(90, 0, 0) * -z, y, "a tilt upward");
  expectNear(turned(0, 0, 90) * x, y, "a roll");
  expectNear(turned(90, 90, 0) * -z, y, "the tilt comes before the pan");
  expectNear(turned(90, 0, 90) * x, z, "the roll comes before the tilt");
  expectNear(turned(0, 90, 90) * x, y, "the roll comes before the pan");
}

// A line against the matrix that it stands for, worked out by hand: pan 90, then 2 3 5 away.
TEST(Chan, GivesTheRaysOfTheMatrix) {
  const std::vector<ChanKey> keys =
      parseChan("# from a tracker\n\n101\t2 3 5 0 90 0 40.5\r\n102 2 3 6 +0 9e1 0 41", "test");
  ASSERT_EQ(keys.size(), 2u);
  EXPECT_EQ(keys[0].frame, 101);
  EXPECT_EQ(keys[0].verticalFov, 40.5);
  EXPECT_EQ(keys[1].frame, 102);
  ParamValues common(cameraParams());
  common.setText("matrix", "[0,0,1,2, 0,1,0,3, -1,0,0,5, 0,0,0,1]", "test");
  const CameraPlugin& plugin = findPlugin(cameraModels(), "perspective", "camera", "test");
  const ParamValues own(plugin.params);
  const auto byMatrix = plugin.create(own, worldFromCameraValues(common), {64, 48});
  const auto byLine = plugin.create(own, keys[0].worldFromCamera, {64, 48});
  for (const Vec2d& raster : {Vec2d(0, 0), Vec2d(32, 24), Vec2d(64, 13)}) {
    const CameraRay a = byMatrix->ray(raster), b = byLine->ray(raster);
    EXPECT_LT(glm::length(a.direction - b.direction), 1e-14);
    EXPECT_LT(glm::length(a.origin - b.origin), 1e-14);
  }
  EXPECT_EQ(parseChan("1 0 0 0 0 0 0", "test").at(0).verticalFov, 0);
  EXPECT_EQ(parseChan("\xEF\xBB\xBF"
                      "7 0 0 0 0 0 0",
                      "test")
                .at(0)
                .frame,
            7);
}

TEST(Chan, ComplaintsNameTheLine) {
  const auto complaint = [](const std::string& text) -> std::string {
    try {
      parseChan(text, "shot.chan");
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  };
  const auto has = [&](const std::string& text, const std::string& part) {
    const std::string message = complaint(text);
    EXPECT_NE(message.find(part), std::string::npos) << text << ": " << message;
    EXPECT_NE(message.find("shot.chan"), std::string::npos) << message;
  };
  has("1 0 0 0 0 0 0\n2 0 0 zero 0 0 0\n", "line 2 holds 'zero'");
  has("1 0 0 0 0 0\n", "line 1 holds 6 numbers");
  has("1 0 0 0 0 0 0 40 9\n", "line 1 holds more than 8");
  has("\n1 0 0 0 0 0 0 180\n", "line 2 has a field of view of 180");
  has("1 0 0 0 0 0 0 -5\n", "line 1 has a field of view of -5");
  has("1 0 0 0 0 0 0\n1 0 0 0 0 0 0\n", "line 2 is of frame 1, after frame 1");
  has("2 0 0 0 0 0 0\n1 0 0 0 0 0 0\n", "line 2 is of frame 1");
  has("1 0 0 0 0 0 0 40\n2 0 0 0 0 0 0\n", "line 2 has or lacks");
  has("1 0 nan 0 0 0 0\n", "line 1 holds 'nan'");
  has("1 0 1e999 0 0 0 0\n", "line 1 holds '1e999'");
  has("1 0 0,5 0 0 0 0\n", "line 1 holds '0,5'");
  has("# nothing\n", "no line of a camera");
  has("", "no line of a camera");
  has(std::string("1 0 0 0 0 0 0\0\n", 15), "line 1");
  has(std::string(100000, 'x'), "line 1 holds 'xxxxxxxxxx");
  const test::TemporaryFolder folder;
  EXPECT_THROW(readChan((folder / "none.chan").string()), InputMissingError);
  EXPECT_THROW(readChan(folder.path().string()), InputMissingError);
}

}  // namespace
}  // namespace photosphere::cameras
