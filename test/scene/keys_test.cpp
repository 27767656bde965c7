// Keys over time: values between them, what the reader refuses, and cameras from files.

#include "photosphere/scene/keys.h"

#include "fixture.h"
#include "photosphere/scene/frame_setup.h"

namespace photosphere::test {
namespace {

using namespace scene;

SceneFile sceneOf(const std::string& text, const std::vector<std::string>& sets = {}) {
  return parseScene(text, "shot.toml", "/shots", sets);
}

const std::string kLit = "[[volume]]\nfile = \"a.vdb\"\n[[light]]\ntype = \"spot\"\n";

TEST(Keys, AreLinearBetweenAndHeldOutside) {
  const SceneFile s = sceneOf(
      kLit,
      {"camera.position=[{ frame = 1, value = [0, 0, 5] }, { frame = 48, value = [1, 0, 6] }]",
       "camera.fov=[{ frame = 0, value = 30 }, { frame = 10, value = 50 }]",
       "light.0.color=[{ frame = 1, value = 1 }, { frame = 3, value = [0, 0.5, 1] }]",
       "volume.0.density_scale=[{ frame = 0, value = 1 }, { frame = 4, value = 3 }]",
       "volume.0.albedo=[{ frame = 0, value = 1 }, { frame = 3, value = 0.1 }]",
       "volume.0.phase={ g = [{ frame = 0, value = 0.1 }, { frame = 2, value = 0.3 }] }",
       "volume.0.emission={ grid = \"f\", scale = [{ frame = 2, value = 1 }, "
       "{ frame = 4, value = 5 }] }"});
  EXPECT_FALSE(s.framesSmoke());
  const double t = 9.0 / 47;
  const SceneFile ten = sceneAt(s, 10);
  EXPECT_LT(glm::length(ten.camera.vec3("position") - Vec3d(t, 0, 5 + t)), 1e-15);
  EXPECT_EQ(ten.camera.real("fov"), 50);
  EXPECT_DOUBLE_EQ(sceneAt(s, 2.5).camera.real("fov"), 35);
  EXPECT_EQ(sceneAt(s, -7).camera.real("fov"), 30);
  EXPECT_EQ(sceneAt(s, 1).camera.vec3("position"), Vec3d(0, 0, 5));
  EXPECT_EQ(sceneAt(s, 48).camera.vec3("position"), Vec3d(1, 0, 6));
  EXPECT_EQ(sceneAt(s, 480).camera.vec3("position"), Vec3d(1, 0, 6));
  const SceneFile two = sceneAt(s, 2);
  EXPECT_EQ(two.lights[0].values.rgb("color"), Rgb(0.5f, 0.75f, 1));
  EXPECT_EQ(two.volumes[0].values.vec3("density_scale"), Vec3d(2));
  EXPECT_NEAR(two.volumes[0].values.vec3("albedo").y, 0.4, 1e-15);
  EXPECT_EQ(two.volumes[0].phaseValues.real("g"), 0.3);
  EXPECT_EQ(sceneAt(s, 3).volumes[0].emission.real("scale"), 3);
  // The keys stay: a scene of one frame can be asked for another.
  EXPECT_EQ(dumpScene(sceneAt(ten, 2)), dumpScene(two));
  EXPECT_DOUBLE_EQ(sceneAt(ten, 2.5).camera.real("fov"), 35);
}

std::string rowMajor(const Mat4d& m) {
  std::string text = "[";
  for (int i = 0; i < 16; ++i)
    text += fmt::format("{}{:.17g}", i ? ", " : "", m[i % 4][i / 4]);
  return text + "]";
}

Mat4d turnedAbout(const Vec3d& axis, double angle) {
  Mat4d m(1.0);
  for (int i = 0; i < 3; ++i) {
    Vec3d e(0.0);
    e[i] = 1;
    m[i] = glm::dvec4(e * std::cos(angle) + glm::cross(axis, e) * std::sin(angle) +
                          axis * (glm::dot(axis, e) * (1 - std::cos(angle))),
                      0);
  }
  return m;
}

double difference(const Mat4d& a, const Mat4d& b) {
  double most = 0;
  for (int i = 0; i < 4; ++i)
    most = std::max(most, glm::length(a[i] - b[i]));
  return most;
}

// Two placements that differ by one turn: part of the time is part of the angle about the same
// axis.
TEST(Keys, MatricesTurnEvenlyTheShorterWay) {
  const Vec3d axis = glm::normalize(Vec3d(1, -2, 3));
  const Mat4d start = turnedAbout(glm::normalize(Vec3d(0.3, 1, 0)), 0.7);
  for (const double angle : {1e-7, 0.4, 2.0, 3.1, 4.0}) {
    Mat4d end = turnedAbout(axis, angle) * start;
    end[3] = glm::dvec4(4, -8, 2, 1);
    const SceneFile s = sceneOf(
        kLit, {fmt::format("camera.matrix=[{{ frame = 1, value = {} }}, {{ frame = 5, value "
                           "= {} }}]",
                           rowMajor(start), rowMajor(end))});
    for (const double t : {0.25, 0.5, 0.9}) {
      const double turn = angle > kPi ? (angle - 2 * kPi) * t : angle * t;
      Mat4d expected = turnedAbout(axis, turn) * start;
      expected[3] = glm::dvec4(4 * t, -8 * t, 2 * t, 1);
      EXPECT_LT(difference(sceneAt(s, 1 + 4 * t).camera.matrix("matrix"), expected), 1e-12)
          << angle << ' ' << t;
    }
    EXPECT_EQ(sceneAt(s, 5).camera.matrix("matrix"), end) << "keys are met exactly";
  }
}

// Stretch is linear in the frame that turns; a mirror stays one.
TEST(Keys, MatricesStretchWhileTheyTurn) {
  for (const double side : {1.0, -1.0}) {
    const Mat4d turn = turnedAbout({0, 0, 1}, kPi / 2), half = turnedAbout({0, 0, 1}, kPi / 4);
    Mat4d narrow(1.0), wide(1.0), middle(1.0);
    narrow[0][0] = side;
    wide[0][0] = 3 * side;
    wide[1][1] = 2;
    middle[0][0] = 2 * side;
    middle[1][1] = 1.5;
    const SceneFile s = sceneOf(
        kLit, {fmt::format("volume.0.transform=[{{ frame = 0, value = {} }}, {{ frame = 2, value = "
                           "{} }}]",
                           rowMajor(narrow), rowMajor(turn * wide))});
    EXPECT_LT(difference(sceneAt(s, 1).volumes[0].values.matrix("transform"), half * middle), 1e-12)
        << side;
  }
}

TEST(Keys, ComplaintsNameFileLineAndKey) {
  const auto has = [](const std::string& camera, const std::string& part) {
    const std::string message = complaint([&] { sceneOf("[camera]\n" + camera); });
    EXPECT_TRUE(contains(message, part)) << camera << message;
  };
  has("fov = [\n  { frame = 3, value = 30 },\n  { frame = 2, value = 40 },\n]\n",
      "shot.toml:4: [camera]: the keys of 'fov' must stand in the order of their frames");
  has("fov = [\n  { frame = 3, value = 30 },\n  { frame = 3, value = 40 },\n]\n",
      "3 comes after 3");
  has("position = [{ frame = 1, value = [0, 5] }]\n",
      "shot.toml:2: [camera]: 'position' must be [x, y, z]");
  has("fov = [{ frame = 1, value = 30 },\n { frame = 2, value = 300 }]\n", "shot.toml:3");
  has("fov = [{ frame = 1, value = 30, ease = 1 }]\n", "a table of two");
  has("fov = [{ frame = 1 }]\n", "a table of two");
  has("fov = [{ frame = \"1\", value = 30 }]\n", "a table of two");
  has("fov = [{ frame = 1, value = 30 }, 40]\n", "a table of two");
  has("fov = [{ frame = nan, value = 30 }]\n", "no finite frame");
  has("fov = [{ frame = 1, value = [{ frame = 1, value = 2 }] }]\n", "'fov'");
  has("resolution = [{ frame = 1, value = [10, 10] }]\n", "cannot have keys");
  has("file = [{ frame = 1, value = \"a\" }]\n", "cannot have keys");
  has("matrix = [{ frame = 1, value = [1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1] },\n"
      "{ frame = 2, value = [1,0,0,0, 0,1,0,0, 0,0,0,0, 0,0,0,1] }]\n",
      "'matrix': the key at frame 2 must be affine and invertible");
  has("matrix = [{ frame = 1, value = [1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1] },\n"
      "{ frame = 2, value = [1,0,0,0, 0,1,0,0, 0,0,-1,0, 0,0,0,1] }]\n",
      "some keys mirror");
  EXPECT_TRUE(contains(complaint([] { sceneOf(kLit, {"render.step=[{ frame = 1, value = 1 }]"}); }),
                       "cannot have"));
  EXPECT_TRUE(
      contains(complaint([] { sceneOf(kLit, {"light.0.size=[{ frame = 1, value = [1, 1] }]"}); }),
               "'size' is an option of light type rect"));
  EXPECT_TRUE(contains(complaint([] { sceneOf(kLit, {"camera.up=[{frame=1,value=[1]}]"}); }),
                       "--set camera.up=[{frame=1,value=[1]}]: [camera]: 'up' must be"));
  EXPECT_TRUE(contains(
      complaint([] { sceneOf(kLit, {"camera.fov=[{frame=2,value=3},{frame=1,value=3}]"}); }),
      "[camera]: the keys of 'fov'"));
}

TEST(Keys, AreWrittenBackAndHashed) {
  const std::vector<std::string> sets = {
      "camera.position=[{ frame = 1, value = [0, 0, 5] }, { frame = 48.5, value = [1, 0, 5] }]",
      "light.0.intensity=[{ frame = 1, value = 1 }, { frame = 2, value = 3 }]",
      "volume.0.phase={ g = [{ frame = 0, value = 0.1 }, { frame = 2, value = 0.3 }] }",
      "volume.0.transform=[{ frame = 0, value = [1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1] }, { frame = "
      "2, value = [1,0,0,5, 0,1,0,0, 0,0,1,0, 0,0,0,1] }]",
      "volume.0.emission={ grid = \"f\", color = [{ frame = 2, value = [1, 0, 0] }] }"};
  const SceneFile s = sceneOf(kLit, sets);
  const std::string text = dumpScene(s);
  const SceneFile again = parseScene(text, "dump.toml", "/elsewhere");
  EXPECT_EQ(dumpScene(again), text);
  EXPECT_EQ(again.hash(), s.hash());
  EXPECT_EQ(sceneAt(again, 1.7).camera.vec3("position"), sceneAt(s, 1.7).camera.vec3("position"));
  EXPECT_EQ(sceneAt(s, 30).hash(), s.hash()) << "a scene's name is not that of a frame";
  for (const char* set :
       {"camera.position=[{ frame = 1, value = [0, 0, 5] }, { frame = 48, value = [1, 0, 5] }]",
        "light.0.intensity=[{ frame = 1, value = 1 }, { frame = 2, value = 3.5 }]",
        "volume.0.phase.g=[{ frame = 0, value = 0.1 }, { frame = 2, value = 0.4 }]",
        "volume.0.emission.color=[{ frame = 2, value = [1, 0, 0] }, { frame = 3, value = 1 }]"}) {
    std::vector<std::string> more = sets;
    more.emplace_back(set);
    EXPECT_NE(sceneOf(kLit, more).hash(), s.hash()) << set;
  }
}

class ShotTest : public ::testing::Test {
 protected:
  // A camera that goes 0.2 to the right a frame, 6 before the smoke.
  void write(const std::string& text) { writeText(m_folder / "shot.chan", text); }
  SceneFile scene(std::vector<std::string> sets) {
    sets.emplace_back("estimator.light_voxel=2");
    return parseScene(ballScene(m_ball, Vec3d(0), 1), "test.toml", m_folder.path(), sets);
  }
  // The same without a place for the camera.
  SceneFile shot(const std::vector<std::string>& sets) {
    std::string text = ballScene(m_ball, Vec3d(0), 1);
    const std::size_t begin = text.find("position"), end = text.find("resolution");
    text.erase(begin, end - begin);
    return parseScene(text, "test.toml", m_folder.path(), sets);
  }

  ShotTest() {
    m_ball = (m_folder / "ball.vdb").string();
    volume::writeVdb(m_ball, {ballGrid("density", Vec3d(0.0), 0.1)});
    write("1 0 0 6 0 0 0 30\n5 0.8 0 6 0 0 0 30\n");
  }

  TemporaryFolder m_folder;
  std::string m_ball;
};

const char* const kFlight =
    "camera.position=[{ frame = 1, value = [0, 0, 6] }, { frame = 5, value = [0.8, 0, 6] }]";
const char* const kTarget =
    "camera.look_at=[{ frame = 1, value = [0, 0, 0] }, { frame = 5, value = [0.8, 0, 0] }]";

TEST_F(ShotTest, AFileStandsForKeys) {
  const SceneFile file = shot({"camera.file=shot.chan"});
  EXPECT_FALSE(file.framesSmoke());
  const FrameSetup byFile = setUpFrame(file, 3), byKeys = setUpFrame(scene({kFlight, kTarget}), 3);
  EXPECT_LT(glm::length(byFile.camera->position() - Vec3d(0.4, 0, 6)), 1e-12);
  for (const Vec2d& raster : {Vec2d(0, 0), Vec2d(32, 10)}) {
    const cameras::CameraRay a = byFile.camera->ray(raster), b = byKeys.camera->ray(raster);
    EXPECT_LT(glm::length(a.direction - b.direction), 1e-12);
  }
  // Vertical: over a wide frame the horizontal one follows from its aspect.
  SetupOptions wide;
  wide.resolution = Vec2i(64, 32);
  const FrameSetup other = setUpFrame(file, 3, wide);
  const Vec3d top = other.camera->ray({32, 0}).direction;
  EXPECT_NEAR(top.y / -top.z, std::tan(kPi / 12), 1e-12);
  const Vec3d side = other.camera->ray({64, 16}).direction;
  EXPECT_NEAR(side.x / -side.z, 2 * std::tan(kPi / 12), 1e-12);
  // What the file holds counts, not its name nor the frame.
  const std::string hash = file.hash();
  EXPECT_EQ(sceneAt(file, 2).hash(), hash);
  EXPECT_EQ(dumpScene(sceneAt(file, 2)), dumpScene(file));
  std::filesystem::copy(m_folder / "shot.chan", m_folder / "other.chan");
  EXPECT_EQ(shot({"camera.file=other.chan"}).hash(), hash);
  write("1 0 0 6 0 0 0 30\n5 0.9 0 6 0 0 0 30\n");
  EXPECT_NE(shot({"camera.file=shot.chan"}).hash(), hash);
  const SceneFile again = parseScene(dumpScene(shot({"camera.file=shot.chan"})), "d.toml", "/x");
  EXPECT_EQ(again.resolvePath(again.camera.text("file")), (m_folder / "shot.chan").string());
  EXPECT_EQ(again.hash(), shot({"camera.file=shot.chan"}).hash());
}

TEST_F(ShotTest, AFileSuffersNoKeysBesideIt) {
  EXPECT_TRUE(contains(complaint([&] { scene({"camera.file=shot.chan"}); }),
                       "'file' says what 'position' does"));
  for (const char* set : {"camera.up=[0, 0, 1]", "camera.fov=20", "camera.focal_length=35",
                          "camera.matrix=[1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1]"})
    EXPECT_TRUE(contains(complaint([&] {
                           shot({"camera.file=shot.chan", set});
                         }),
                         "'file' says"))
        << set;
  write("1 0 0 6 0 0 0\n");
  EXPECT_EQ(complaint([&] { shot({"camera.file=shot.chan", "camera.fov=20"}); }), "");
  EXPECT_TRUE(contains(complaint([&] { shot({"camera.file=none.chan"}); }, ExitCode::inputMissing),
                       "none.chan"));
  write("1 0 0 6 0 0\n");
  EXPECT_TRUE(contains(complaint([&] { shot({"camera.file=shot.chan"}); }, ExitCode::inputInvalid),
                       "line 1"));
}

EffectState motionBlur(const FrameSetup& setup) {
  for (const EffectState& state : setup.effectStates)
    if (state.name == "motion_blur") return state;
  return {};
}

// 0.1 sideways over the shutter, 5 from the nearest face of the smoke's box.
TEST_F(ShotTest, MotionBlurIsPlannedFromItsPixels) {
  const FrameSetup moving = setUpFrame(scene({kFlight, kTarget}), 3);
  const double near = 6 - moving.worldBounds.max.z;
  const double pixels = 0.1 / near * 32 / (2 * std::tan(kPi / 12));
  EXPECT_TRUE(moving.effects.motionBlur);
  ASSERT_TRUE(moving.motion);
  EXPECT_NEAR(moving.motion->blur(moving.worldBounds), pixels, 0.02 * pixels);
  EXPECT_TRUE(contains(motionBlur(moving).why, fmt::format("{:.2g} pixels", pixels)))
      << motionBlur(moving).why;

  EXPECT_FALSE(setUpFrame(scene({kFlight, kTarget, "effects.motion_blur=off"}), 3).motion);
  EXPECT_FALSE(setUpFrame(scene({kFlight, kTarget, "camera.shutter=[0, 0]"}), 3).motion);
  const FrameSetup brief = setUpFrame(scene({kFlight, kTarget, "camera.shutter=[0, 5e-5]"}), 3);
  EXPECT_FALSE(brief.motion) << "a ten-thousandth of a pixel";
  EXPECT_FALSE(brief.effects.motionBlur);
  EXPECT_TRUE(
      setUpFrame(scene({kFlight, kTarget, "camera.shutter=[0, 5e-5]", "effects.motion_blur=on"}), 3)
          .effects.motionBlur);
  const FrameSetup still = setUpFrame(scene({"effects.motion_blur=on"}), 3);
  EXPECT_FALSE(still.effects.motionBlur) << "nothing moves";
  EXPECT_TRUE(contains(motionBlur(still).why, "stands still"));
  EXPECT_FALSE(setUpFrame(scene({kFlight, kTarget}), 9).effects.motionBlur)
      << "held after the keys";
  EXPECT_TRUE(setUpFrame(shot({"camera.file=shot.chan"}), 3).effects.motionBlur);
  EXPECT_NE(complaint([&] { setUpFrame(scene({"camera.shutter=[0.2, 0]"}), 3); }), "");
}

// The picture's matrices are those at the frame; light for one eye is for that in the middle.
TEST_F(ShotTest, TheViewIsThatOfTheMiddleOfTheShutter) {
  const FrameSetup later = setUpFrame(scene({kFlight, kTarget, "camera.shutter=[0, 1]"}), 3);
  EXPECT_LT(glm::length(later.camera->position() - Vec3d(0.4, 0, 6)), 1e-12);
  EXPECT_LT(glm::length(later.view.eye - Vec3d(0.5, 0, 6)), 1e-6);
  EXPECT_TRUE(later.notes.empty());
  EXPECT_EQ(later.layout.basis, estimators::Basis::view);
  // Far against its distance: 1.2 either way from 6.
  const char* const fast =
      "camera.position=[{ frame = -3, value = [-1.2, 0, 6] }, { frame = 9, value = [1.2, 0, 6] }]";
  const FrameSetup wide = setUpFrame(scene({fast, "camera.shutter=[-6, 6]"}), 3);
  EXPECT_EQ(wide.layout.basis, estimators::Basis::histogram);
  EXPECT_EQ(wide.layout.evaluate, estimators::Evaluate::perStep);
  ASSERT_EQ(wide.notes.size(), 1u);
  EXPECT_TRUE(contains(wide.notes[0], "bins of direction")) << wide.notes[0];
  // Every note about bins names as many as there are.
  const FrameSetup sharp =
      setUpFrame(scene({fast, "camera.shutter=[-6, 6]", "volume.0.phase={ g = 0.9 }"}), 3);
  EXPECT_EQ(sharp.layout.bins(), 128);
  ASSERT_EQ(sharp.notes.size(), 2u);
  for (const std::string& note : sharp.notes)
    EXPECT_TRUE(contains(note, "128 bins")) << note;
  const FrameSetup asked =
      setUpFrame(scene({fast, "camera.shutter=[-6, 6]", "estimator.basis=view"}), 3);
  EXPECT_EQ(asked.layout.basis, estimators::Basis::view);
  EXPECT_EQ(asked.notes.size(), 1u);
  // What is seen of opaque smoke is seen from all round, too.
  const FrameSetup seen =
      setUpFrame(scene({fast, "camera.shutter=[-6, 6]", "estimator.smoothing=visible"}), 3);
  EXPECT_EQ(seen.layout.basis, estimators::Basis::histogram);
  EXPECT_EQ(seen.layout.smoothing, estimators::Smoothing::visible);
  const FrameSetup resolved =
      setUpFrame(scene({fast, "camera.shutter=[-6, 6]", "estimator.smoothing=plain"}), 3);
  EXPECT_EQ(resolved.layout.evaluate, estimators::Evaluate::perView) << "which plain needs";
  // So is a lens that is wide where the smoke is.
  const FrameSetup lens = setUpFrame(scene({"camera.fstop=0.01"}), 3);
  EXPECT_EQ(lens.layout.evaluate, estimators::Evaluate::perStep);
  ASSERT_EQ(lens.notes.size(), 1u);
  EXPECT_TRUE(contains(lens.notes[0], "sees the lens under")) << lens.notes[0];
  EXPECT_EQ(setUpFrame(scene({"camera.fstop=2"}), 3).layout.basis, estimators::Basis::view);
}

TEST_F(ShotTest, FramesAreThoseOfTheirTime) {
  // A keyed scene at a frame is the scene with those values.
  const std::vector<std::string> off = {"effects.motion_blur=off"};
  std::vector<std::string> keyed = {
      kFlight, kTarget, "light.0.intensity=[{ frame = 1, value = 0 }, { frame = 5, value = 200 }]",
      "volume.0.density_scale=[{ frame = 1, value = 1 }, { frame = 5, value = 5 }]"};
  keyed.push_back(off[0]);
  const FrameResult at = renderScene(scene(keyed), 3);
  const FrameResult plain =
      renderScene(scene({"camera.position=[0.4, 0, 6]", "camera.look_at=[0.4, 0, 0]",
                         "light.0.intensity=100", "volume.0.density_scale=3", off[0]}),
                  3);
  EXPECT_TRUE(sameBits(at.layers.beauty, plain.layers.beauty));
  // A shutter that does not open is a still picture.
  keyed.back() = "camera.shutter=[0, 0]";
  EXPECT_TRUE(sameBits(renderScene(scene(keyed), 3).layers.beauty, plain.layers.beauty));
  // One that does is another, of as much light.
  keyed.back() = "camera.shutter=[-1, 1]";
  const FrameResult moving = renderScene(scene(keyed), 3);
  EXPECT_FALSE(sameBits(moving.layers.beauty, plain.layers.beauty));
  EXPECT_NEAR(moving.statistics.imageMean, plain.statistics.imageMean,
              0.03 * plain.statistics.imageMean);
  EXPECT_EQ(moving.ndcFromWorld, plain.ndcFromWorld) << "matrices are those at the frame";
}

// Light is kept with the lamps of its frame.
TEST_F(ShotTest, ALightCacheIsOfItsFrame) {
  std::vector<std::string> sets = {
      "light.0.intensity=[{ frame = 1, value = 50 }, { frame = 5, value = 200 }]",
      "estimator.photons=2000", "camera.resolution=[8, 8]"};
  const std::string path = (m_folder / "light.vdb").string();
  traceScene(scene(sets), 3, path);
  sets.push_back("estimator.cache=" + path);
  EXPECT_EQ(complaint([&] { renderScene(scene(sets), 3); }), "");
  EXPECT_NE(complaint([&] { renderScene(scene(sets), 4); }, ExitCode::inputInvalid), "");
}

}  // namespace
}  // namespace photosphere::test
