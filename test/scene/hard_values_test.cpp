// Densities, particles and settings at the edge of what numbers hold, as a frame is set up.

#include <algorithm>

#include "fixture.h"
#include "photosphere/transport/support_lattice.h"
#include "photosphere/transport/tracking.h"
#include "photosphere/volume/optical_depth.h"
#include "photosphere/volume/rasterize.h"

namespace photosphere::test {
namespace {

using namespace scene;

class HardValues : public ::testing::Test {
 protected:
  std::string write(const std::string& name, const std::vector<volume::Grid>& grids) {
    const std::string path = (m_folder / name).string();
    volume::writeVdb(path, grids);
    return path;
  }
  FrameSetup setUp(const std::string& file, const std::vector<std::string>& sets = {}) {
    return setUpFrame(parseScene(ballScene(file, Vec3d(0), 1), "t.toml", m_folder.path(), sets), 1);
  }
  static bool notes(const FrameSetup& setup, const std::string& text) {
    for (const std::string& note : setup.notes)
      if (note.find(text) != std::string::npos) return true;
    return false;
  }
  TemporaryFolder m_folder;
};

TEST_F(HardValues, DensityPastMeasureIsCutAndSaid) {
  const FrameSetup setup = setUp(write("a.vdb", {ballGrid("density", Vec3d(0), 0.1, 1e30f)}));
  EXPECT_TRUE(notes(setup, "an optical depth of 3e+29 in one voxel"));
  // 1e4 optical depths in a voxel of 0.1 m.
  EXPECT_NEAR(static_cast<double>(setup.medium->majorants().maximum()), 1e5, 1);
  const FrameSetup plain = setUp(write("b.vdb", {ballGrid("density", Vec3d(0), 0.1, 3e4f)}));
  EXPECT_FALSE(notes(plain, "optical depth"));
  EXPECT_NEAR(static_cast<double>(plain.medium->majorants().maximum()), 9e4, 1);
}

TEST_F(HardValues, ScaleAndDensityNeedNotFitAFloatAlone) {
  const FrameSetup setup = setUp(write("a.vdb", {ballGrid("density", Vec3d(0), 0.1, 1e-40f)}),
                                 {"volume.0.density_scale=3e40"});
  EXPECT_NEAR(static_cast<double>(setup.medium->majorants().maximum()), 3.0, 1e-3);
}

TEST_F(HardValues, CarriersThatCoincideCountOnce) {
  volume::ParticleSet set;
  for (int i = 0; i < 10; ++i)
    set.positions.emplace_back(0.25 * (i % 3), 0, 0);
  const std::string file =
      write("a.vdb", {ballGrid("density", Vec3d(0), 0.1), volume::pointsToGrid(set, "points", 1)});
  const FrameSetup setup = setUp(file, {"estimator.carrier=particles"});
  EXPECT_EQ(setup.particles.size(), 3u);
  EXPECT_TRUE(notes(setup, "7 of 10 particles lie exactly where others do"));
}

// What light does inside a light voxel is lost: they are finer where that would be much.
TEST_F(HardValues, LightVoxelsFitTheSmoke) {
  const auto blob = [&](const char* name, double radius, float density) {
    return write(name, {ballGrid("density", Vec3d(0), 1 / radius, density)});
  };
  const std::string few = blob("few.vdb", 8, 0.1f), usual = blob("usual.vdb", 40, 0.1f);
  EXPECT_EQ(setUp(few).layout.lightVoxel, 0.5);
  EXPECT_TRUE(notes(setUp(few), "few voxels across"));
  EXPECT_EQ(setUp(blob("some.vdb", 20, 0.1f)).layout.lightVoxel, 1);
  EXPECT_EQ(setUp(usual).layout.lightVoxel, 2);
  EXPECT_FALSE(notes(setUp(usual), "estimator.light_voxel"));
  const std::string opaque = "volume.0.density_scale=3000";
  const FrameSetup thick =
      setUp(usual, {opaque, "estimator.smoothing=twicing", "estimator.basis=spherical_harmonics",
                    "estimator.order=0"});
  EXPECT_EQ(thick.layout.lightVoxel, 0.5);
  EXPECT_TRUE(notes(thick, "several mean free paths deep"));
  // It is enough to weigh light by what is seen.
  for (const char* basis : {"view", "histogram", "spherical_harmonics"}) {
    const FrameSetup seen = setUp(usual, {opaque, fmt::format("estimator.basis={}", basis)});
    EXPECT_EQ(seen.layout.smoothing, estimators::Smoothing::visible);
    EXPECT_EQ(seen.layout.lightVoxel, 2);
    EXPECT_TRUE(notes(seen, "estimator.smoothing"));
  }
  EXPECT_EQ(setUp(usual).layout.smoothing, estimators::Smoothing::twicing);
  EXPECT_EQ(setUp(usual, {opaque, "estimator.smoothing=twicing"}).layout.smoothing,
            estimators::Smoothing::twicing);
  // What is asked for is done; what would take much memory is not; others keep no such voxels.
  EXPECT_EQ(setUp(few, {"estimator.light_voxel=2"}).layout.lightVoxel, 2);
  EXPECT_EQ(setUp(few, {"estimator.basis=histogram", "estimator.rows=64"}).layout.lightVoxel, 2);
  EXPECT_FALSE(notes(setUp(few, {"estimator.type=photon_map"}), "estimator.light_voxel"));
}

// Light voxels of the shortest edge would be thousands for each of the smoke's.
TEST_F(HardValues, LightVoxelsOfLongOnesAreFew) {
  const std::string usual = write("usual.vdb", {ballGrid("density", Vec3d(0), 1 / 12.0, 0.1f)});
  const auto flat = [&](double height) {
    return fmt::format("volume.0.transform=[1,0,0,0, 0,{},0,0, 0,0,1,0, 0,0,0,1]", height);
  };
  EXPECT_LE(setUp(usual, {flat(0.25)}).layout.lightVoxel, 2);
  const FrameSetup sheet = setUp(usual, {flat(1e-3)});
  EXPECT_TRUE(notes(sheet, "much longer than wide"));
  EXPECT_GT(sheet.layout.lightVoxel, 2);
  const double edge = sheet.layout.lightVoxel * sheet.medium->voxelEdge();
  EXPECT_LT(transport::SupportLattice(*sheet.medium, edge, 0).size(), 8u << 20);
  EXPECT_EQ(setUp(usual, {flat(1e-3), "estimator.light_voxel=2"}).layout.lightVoxel, 2);
}

// Balls of two voxels radius that do not touch, in a box of `voxels` across.
volume::Grid cloudOfBalls(int voxels, double edge) {
  const auto inBall = [](const Vec3d& p) {
    return glm::length(glm::mod(p, Vec3d(6.0)) - Vec3d(3.0)) < 2.3 ? 1.0f : 0.0f;
  };
  std::vector<float> values;
  for (int z = 0; z < voxels; ++z)
    for (int y = 0; y < voxels; ++y)
      for (int x = 0; x < voxels; ++x)
        values.push_back(inBall(Vec3d(x, y, z)));
  Mat4d worldFromIndex(edge);
  worldFromIndex[3] = glm::dvec4(Vec3d(-edge * (voxels - 1) / 2.0), 1.0);
  return volume::denseToGrid("density", Vec3i(voxels), values, worldFromIndex);
}

// Smoke of many voxels may be of many parts of few.
TEST_F(HardValues, LightVoxelsFitClumps) {
  const std::string file = write("balls.vdb", {cloudOfBalls(60, 2.0 / 60)});
  const FrameSetup setup = setUp(file, {"volume.0.density_scale=10"});
  EXPECT_EQ(setup.layout.lightVoxel, 1);
  EXPECT_TRUE(notes(setup, "in clumps of about a light voxel"));
  if (kSanitized) return;
  const auto mean = [&](const std::vector<std::string>& sets) {
    std::vector<std::string> all{"volume.0.density_scale=10", "render.samples=16"};
    all.insert(all.end(), sets.begin(), sets.end());
    const SceneFile scene =
        parseScene(ballScene(file, Vec3d(0), 1), "t.toml", m_folder.path(), all);
    double sum = 0;
    for (const Rgb& pixel : renderScene(scene, 1).layers.multiple)
      sum += static_cast<double>(pixel.y);
    return sum;
  };
  const double truth = mean({"estimator.type=path_traced", "estimator.samples=128"});
  const double fine = mean({"estimator.photons=200000"}) / truth;
  const double coarse = mean({"estimator.photons=200000", "estimator.light_voxel=2"}) / truth;
  std::printf("  over path tracing: voxels of 1 %.4f, of 2 %.4f\n", fine, coarse);
  EXPECT_NEAR(fine, 1.0, 0.05);
  EXPECT_LT(coarse, fine);
}

TEST_F(HardValues, AKernelIsNoWiderThanCanBePaid) {
  const std::string file = write("a.vdb", {ballGrid("density", Vec3d(0), 0.1)});
  const FrameSetup wide = setUp(file, {"estimator.radius=100"});
  EXPECT_NEAR(wide.layout.radius, 8 * 0.2, 1e-6);
  EXPECT_TRUE(notes(wide, "spans 500 light voxels"));
  EXPECT_NEAR(setUp(file, {"estimator.radius=1.5"}).layout.radius, 1.5, 1e-6);
  EXPECT_EQ(wide.layout.lightVoxel, 2) << "finer voxels would narrow it";
  // A photon map searches what is there.
  EXPECT_FALSE(notes(setUp(file, {"estimator.radius=100", "estimator.type=photon_map"}), "spans"));
}

TEST_F(HardValues, OneHugeParticleIsNamed) {
  volume::ParticleSet set;
  for (int i = 0; i < 20; ++i)
    set.positions.emplace_back(0.1 * i, 0, 0);
  std::vector<float> radii(20, 0.1f);
  radii[5] = 1e6f;
  set.add({"pscale", 1, radii});
  const std::string file = write("a.vdb", {volume::pointsToGrid(set, "points", 1)});
  EXPECT_NE(complaint([&] { setUp(file); }, ExitCode::memory).find("1e+07 times their median"),
            std::string::npos);
  EXPECT_EQ(complaint([&] { setUp(file, {"volume.0.particle_radius=0.2"}); }), "");
}

// A kernel that meets no light voxel, or no photon, would leave out what is scattered many times,
// and one that is wider than the smoke nearly so: said, or mended where it can be.
TEST_F(HardValues, RadiiThatLoseLightAreNamed) {
  volume::ParticleSet set;
  for (int i = 0; i < 1000; ++i)
    set.positions.emplace_back(0.1 * (i % 10), 0.1 * (i / 10 % 10), 0.1 * (i / 100));
  set.add({"pscale", 1, std::vector<float>(1000, 0.1f)});
  const std::string file = write("a.vdb", {volume::pointsToGrid(set, "points", 1)});
  const auto withRadius = [&](const char* way, const char* radius) {
    return setUp(file, {way, std::string("estimator.radius=") + radius, "estimator.photons=20000"});
  };
  const char* const particles = "estimator.carrier=particles";
  const char* const map = "estimator.type=photon_map";
  const FrameSetup tiny = withRadius(particles, "1e-6");
  EXPECT_TRUE(notes(tiny, "estimator.radius = 1e-06 is less than light voxels are apart"));
  const double edge = tiny.layout.lightVoxel * tiny.medium->voxelEdge();
  EXPECT_GE(tiny.layout.radius, std::sqrt(0.75) * edge);
  EXPECT_LT(tiny.layout.radius, edge);
  EXPECT_TRUE(notes(withRadius(map, "1e-6"), "estimator.radius = 1e-06 holds"));
  for (const char* way : {particles, map}) {
    EXPECT_TRUE(notes(withRadius(way, "100"), "estimator.radius = 100 is wider than the smoke"));
    for (const char* usual : {"0", "0.3"})
      EXPECT_FALSE(notes(withRadius(way, usual), "estimator.radius")) << way << usual;
  }
  // One alone has no spacing to choose a radius by.
  set.positions.resize(1);
  set.attributes.clear();
  set.add({"pscale", 1, std::vector<float>{0.1f}});
  const FrameSetup alone =
      setUp(write("b.vdb", {volume::pointsToGrid(set, "points", 1)}), {particles});
  EXPECT_GE(alone.layout.radius,
            std::sqrt(0.75) * alone.layout.lightVoxel * alone.medium->voxelEdge());
  EXPECT_FALSE(notes(alone, "estimator.radius"));
}

// Particles at rest in a ball, and one that a simulation lost.
volume::ParticleSet withStray(double distance) {
  volume::ParticleSet set;
  for (int z = -8; z <= 8; ++z)
    for (int y = -8; y <= 8; ++y)
      for (int x = -8; x <= 8; ++x)
        if (const Vec3d p = Vec3d(x, y, z) / 8.0; glm::length(p) < 1) set.positions.push_back(p);
  set.positions.emplace_back(distance, -distance, distance);
  set.add({"pscale", 1, std::vector<float>(set.size(), 0.2f)});
  set.add({"v", 3, std::vector<float>(3 * set.size(), 1.0f)});
  return set;
}

TEST_F(HardValues, StraysAreLeftOutUnlessTheSceneKeepsThem) {
  const std::string points = write("a.vdb", {volume::pointsToGrid(withStray(1e7), "points", 1)});
  const std::vector<std::string> moving{"volume.0.velocity=v", "effects.motion_blur=on"};
  for (const auto& sets : {std::vector<std::string>{}, moving}) {
    const FrameSetup setup = setUp(points, sets);
    EXPECT_TRUE(notes(setup, "lies up to 1.732e+07 units away")) << sets.size();
    EXPECT_LT(maxComponent(setup.medium->bounds().extent()), 3.0);
    EXPECT_LT(glm::length(setup.space.center), 0.1);
    EXPECT_EQ(setup.medium->isMoving(), !sets.empty());
  }
  const std::string nearer = write("b.vdb", {volume::pointsToGrid(withStray(500), "points", 1)});
  EXPECT_LT(maxComponent(setUp(nearer).medium->bounds().extent()), 3.0);
  const FrameSetup kept = setUp(nearer, {"volume.0.strays=keep"});
  EXPECT_GT(maxComponent(kept.medium->bounds().extent()), 500.0);
  EXPECT_FALSE(notes(kept, "left out"));
  // Beside a grid, carriers out there are none either.
  const std::string both = write("c.vdb", {volume::rasterize(withStray(500), {}).density,
                                           volume::pointsToGrid(withStray(500), "points", 1)});
  const FrameSetup grid = setUp(both, {"estimator.carrier=particles"});
  EXPECT_LT(maxComponent(grid.medium->bounds().extent()), 3.0);
  EXPECT_EQ(grid.particles.size(), withStray(500).size() - 1);
}

// A camera that looks at nothing else sees them.
TEST_F(HardValues, StraysThatAloneAreInViewStay) {
  const std::string file = write("a.vdb", {volume::pointsToGrid(withStray(500), "points", 1)});
  const FrameSetup setup =
      setUp(file, {"camera.position=[500, -500, 505]", "camera.look_at=[500, -500, 500]"});
  EXPECT_GT(maxComponent(setup.medium->bounds().extent()), 499.0);
  EXPECT_FALSE(notes(setup, "left out"));
}

// Floats would not tell the voxels of one from those of the next a million units away.
TEST_F(HardValues, WhatIsSeenLiesInTheMiddleOfLocalSpace) {
  const std::string file = write("a.vdb", {ballGrid("density", Vec3d(0), 0.1)});
  const FrameSetup setup = setUp(file, {"volume.1.file=\"" + file + "\"",
                                        "volume.1.origin=[4e6, 0, 0]", "volume.1.density_scale=3"});
  EXPECT_EQ(setup.medium->volumes().size(), 1u);
  EXPECT_LT(glm::length(setup.space.center), 1e-6);
  EXPECT_LT(glm::length(setup.medium->bounds().center()), 1e-6);
}

// Photons of more light than floats hold would be no numbers.
TEST_F(HardValues, MoreLightThanPhotonsCarryIsRefused) {
  const std::string file = write("a.vdb", {ballGrid("density", Vec3d(0), 0.1)});
  EXPECT_EQ(complaint([&] { setUp(file, {"light.0.intensity=1e30"}); }), "");
  for (const char* intensity : {"3e38", "1e39"}) {
    const std::string said =
        complaint([&] { setUp(file, {fmt::format("light.0.intensity={}", intensity)}); });
    EXPECT_TRUE(contains(said, "t.toml") && contains(said, "light")) << said;
    EXPECT_TRUE(contains(said, "lower")) << said;
  }
  // Together they are too many.
  const std::string lamp = "{type=\"point\", position=[0, 3, 0], intensity=2e36}";
  EXPECT_EQ(complaint([&] { setUp(file, {"light=[" + lamp + "]"}); }), "");
  std::string many = lamp;
  for (int i = 0; i < 20; ++i)
    many += ", " + lamp;
  EXPECT_TRUE(contains(complaint([&] { setUp(file, {"light=[" + many + "]"}); }), "with it, "));
  const std::string hot =
      write("b.vdb", {ballGrid("density", Vec3d(0), 0.1), ballGrid("heat", Vec3d(0), 0.1, 1e8f)});
  const std::string glow =
      complaint([&] { setUp(hot, {"volume.0.emission={ grid = \"heat\", scale = 1e30 }"}); });
  EXPECT_TRUE(contains(glow, "emission.scale")) << glow;
}

TEST_F(HardValues, ABareCacheIsScaledWhateverItsUnits) {
  const auto scaleOf = [&](const std::string& file) {
    return sceneForVolume(file, {}, false).volumes.front().values.vec3("density_scale").x;
  };
  const double usual = scaleOf(write("a.vdb", {ballGrid("density", Vec3d(0), 0.1, 1.0f)}));
  for (const float value : {1e4f, 1e9f, 1e30f})
    EXPECT_NEAR(scaleOf(write("b.vdb", {ballGrid("density", Vec3d(0), 0.1, value)})) *
                    static_cast<double>(value) / usual,
                1, 1e-5)
        << value;
}

// What lies between is passed over: the depths that decide are those of whole rays.
TEST_F(HardValues, ABareCacheIsScaledByItsSmokeAlone) {
  const Vec3i size(20, 24, 96);
  std::vector<float> values;
  for (int z = 0; z < size.z; ++z)
    for (int y = 0; y < size.y; ++y)
      for (int x = 0; x < size.x; ++x) {
        const Vec3d p = Vec3d(x, y, z < size.z / 2 ? z : size.z - 1 - z) - Vec3d(9.5, 11.5, 9.5);
        values.push_back(glm::length(p) < 9 ? 0.2f + 0.01f * static_cast<float>(x + z) : 0.0f);
      }
  const std::string file =
      write("a.vdb", {volume::denseToGrid("density", size, values, Mat4d(1.0))});
  const FrameSetup setup = setUp(file, {"volume.0.density_scale=1", "camera.position=[10, 12, 400]",
                                        "camera.look_at=[10, 12, 48]"});
  const transport::Medium& medium = *setup.medium;
  ASSERT_FALSE(medium.bounds().empty());
  const Box3d& box = medium.bounds();
  std::vector<double> depths;
  for (int axis = 0; axis < 3; ++axis)
    for (int i = 0; i < 48 * 48; ++i) {
      Vec3d from = box.min;
      from[(axis + 1) % 3] += (i % 48 + 0.5) / 48 * box.extent()[(axis + 1) % 3];
      from[(axis + 2) % 3] += (i / 48 + 0.5) / 48 * box.extent()[(axis + 2) % 3];
      Vec3f d(0.0f);
      d[axis] = 1.0f;
      depths.push_back(static_cast<double>(transport::marchOpticalDepth(
          medium, Vec3f(from), d, static_cast<float>(box.extent()[axis]),
          static_cast<float>(medium.voxelEdge()))));
    }
  std::sort(depths.begin(), depths.end());
  const double least = volume::kTraceDepth * depths.back();
  std::erase_if(depths, [&](double depth) { return !(depth > least); });
  ASSERT_GT(depths.size(), 100u);
  EXPECT_EQ(sceneForVolume(file, {}, false).volumes.front().values.vec3("density_scale").x,
            volume::roundedToTwoDigits(volume::kSmokeDepth / depths[depths.size() / 2]));
}

// A million empty cells between particles, which no ray can afford to walk through by itself.
TEST_F(HardValues, ABareCacheMayBeNearlyEmpty) {
  volume::ParticleSet set;
  for (int i = 0; i < 500; ++i)
    set.positions.emplace_back(1000.0 * i, 0, 0);
  set.add({"pscale", 1, std::vector<float>(500, 0.01f)});
  const std::string file = write("a.vdb", {volume::pointsToGrid(set, "points", 1)});
  EXPECT_GT(sceneForVolume(file, {}, false).volumes.front().values.vec3("density_scale").x, 0);
}

}  // namespace
}  // namespace photosphere::test
