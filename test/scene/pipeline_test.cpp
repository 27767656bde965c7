// Frames from scenes: units, precision, grids, memory, statistics, files.

#include "photosphere/scene/pipeline.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "fixture.h"
#include "photosphere/caches/cache_format.h"
#include "photosphere/volume/rasterize.h"

namespace photosphere::test {
namespace {

using namespace scene;

double meanOf(const std::vector<Rgb>& pixels) {
  double sum = 0;
  for (const Rgb& p : pixels)
    sum += static_cast<double>(meanComponent(p));
  return sum / static_cast<double>(pixels.size());
}

double relativeDifference(const FrameResult& a, const FrameResult& b) {
  double difference = 0, sum = 0;
  for (std::size_t i = 0; i < a.layers.beauty.size(); ++i) {
    difference += std::abs(static_cast<double>(a.layers.beauty[i].x - b.layers.beauty[i].x));
    sum += static_cast<double>(a.layers.beauty[i].x);
  }
  return difference / sum;
}

class PipelineTest : public ::testing::Test {
 protected:
  std::string ball(const std::string& name, const Vec3d& center = Vec3d(0.0), double unit = 1.0) {
    const std::string path = (m_folder / name).string();
    volume::Grid grid = ballGrid("density", Vec3d(0.0), 0.1);
    Mat4d m(unit);
    m[3] = glm::dvec4(center, 1.0);
    volume::writeVdb(path, {volume::transformed(grid, m)});
    return path;
  }
  SceneFile scene(const std::string& text, const std::vector<std::string>& sets = {}) {
    return parseScene(text, "test.toml", m_folder.path(), sets);
  }

  TemporaryFolder m_folder;
};

TEST_F(PipelineTest, RendersLitSmoke) {
  const FrameResult r = renderScene(scene(ballScene(ball("a.vdb"), Vec3d(0), 1)), 1);
  ASSERT_EQ(r.layers.beauty.size(), 32u * 32u);
  EXPECT_GT(meanOf(r.layers.single), 0.01);
  EXPECT_GT(meanOf(r.layers.multiple), 0.01);
  EXPECT_LT(meanOf(r.layers.transmittance), 0.95);
  EXPECT_EQ(r.layers.background[0], Rgb(0.0f));
  EXPECT_NEAR(static_cast<double>(r.layers.depth[16 * 32 + 16]), 5.2, 0.3);
  EXPECT_EQ(r.statistics.photonsEmitted, 20000u);
  EXPECT_GT(r.statistics.photonsStored, 0u);
  EXPECT_NEAR(r.statistics.energyError.x, 0.0, 1e-6 * r.statistics.energyEmitted.x);
  EXPECT_EQ(r.statistics.majorantViolations, 0u);
}

TEST_F(PipelineTest, CentimetresRenderLikeMetres) {
  const FrameResult metres = renderScene(scene(ballScene(ball("m.vdb"), Vec3d(0), 1)), 1);
  const FrameResult centimetres =
      renderScene(scene(ballScene(ball("cm.vdb", Vec3d(0), 100.0), Vec3d(0), 100)), 1);
  EXPECT_LT(relativeDifference(metres, centimetres), 1e-4);
  // Depth stays in scene units.
  EXPECT_NEAR(static_cast<double>(centimetres.layers.depth[16 * 32 + 16]), 520.0, 30.0);
}

TEST_F(PipelineTest, SmokeAMillionUnitsAwayRendersLikeSmokeAtTheOrigin) {
  const Vec3d far(1e6, -1e6, 3e5);
  const FrameResult near = renderScene(scene(ballScene(ball("n.vdb"), Vec3d(0), 1)), 1);
  const FrameResult away = renderScene(scene(ballScene(ball("f.vdb", far), far, 1)), 1);
  EXPECT_LT(relativeDifference(near, away), 1e-3);
}

TEST_F(PipelineTest, OriginAndTransformMoveGridsAlike) {
  const std::string file = ball("o.vdb");
  const std::string text = ballScene(file, Vec3d(0), 1);
  const Vec3d offset(5, -2, 1);
  const std::string moved = ballScene(file, offset, 1);
  const FrameResult expected = renderScene(scene(text), 1);
  const FrameResult byOrigin = renderScene(scene(moved, {"volume.0.origin=[5, -2, 1]"}), 1);
  const FrameResult byTransform =
      renderScene(scene(moved, {"volume.0.transform=[1,0,0,5, 0,1,0,-2, 0,0,1,1, 0,0,0,1]"}), 1);
  EXPECT_LT(relativeDifference(expected, byOrigin), 1e-4);
  EXPECT_LT(relativeDifference(expected, byTransform), 1e-4);
  // Half a voxel of 0.1 to each side of the box.
  const FrameSetup plain = setUpFrame(scene(text), 1);
  const FrameSetup shifted = setUpFrame(scene(text, {"volume.0.cell_centered=true"}), 1);
  EXPECT_NEAR(shifted.worldBounds.min.x - plain.worldBounds.min.x, 0.05, 1e-6);
  EXPECT_NE(complaint([&] {
              setUpFrame(scene(text, {"volume.0.transform=[1,0,0,0, 0,1,0,0, 0,0,0,0, 0,0,0,1]"}),
                         1);
            }),
            "");
}

TEST_F(PipelineTest, TwoOverlappingVolumesAddUp) {
  const std::string file = ball("t.vdb");
  const FrameResult once = renderScene(scene(ballScene(file, Vec3d(0), 1)), 1);
  const FrameResult twice =
      renderScene(scene(ballScene(file, Vec3d(0), 1,
                                  "[[volume]]\nfile = \"" + file +
                                      "\"\n"
                                      "density_scale = 1.5\nphase = { g = 0.3 }\n"),
                        {"volume.0.density_scale=1.5"}),
                  1);
  // Two volumes draw other random numbers than one: compare what noise averages out of.
  EXPECT_NEAR(meanOf(twice.layers.transmittance), meanOf(once.layers.transmittance), 1e-5);
  EXPECT_NEAR(meanOf(twice.layers.single) / meanOf(once.layers.single), 1.0, 1e-3);
  EXPECT_NEAR(meanOf(twice.layers.multiple) / meanOf(once.layers.multiple), 1.0, 0.02);
}

// Bins that are wider than a lobe are named, those of a lobe backward sooner: its light comes back.
TEST_F(PipelineTest, LobesNarrowerThanBinsAreNamed) {
  const std::string text = ballScene(ball("a.vdb"), Vec3d(0), 1);
  const auto named = [&](const char* g, const char* rows) {
    const FrameSetup setup = setUpFrame(
        scene(text, {std::string("volume.0.phase={ g = ") + g + " }", "estimator.basis=histogram",
                     std::string("estimator.rows=") + rows}),
        1);
    return std::any_of(setup.notes.begin(), setup.notes.end(), [](const std::string& note) {
      return contains(note, "narrower than the directions");
    });
  };
  EXPECT_FALSE(named("0", "2"));
  EXPECT_FALSE(named("0.9", "4"));
  EXPECT_TRUE(named("0.96", "4"));
  EXPECT_FALSE(named("-0.8", "4"));
  EXPECT_TRUE(named("-0.9", "4"));
  EXPECT_FALSE(named("-0.9", "8"));
}

// Light voxels next to an eye in smoke are seen from too many directions for a lobe.
TEST_F(PipelineTest, LightNextToAnEyeIsReadPerStep) {
  const std::string text = ballScene(ball("a.vdb"), Vec3d(0), 1);
  const auto nearEye = [&](std::vector<std::string> sets, bool cache = false) {
    SetupOptions options;
    options.forLightCache = cache;
    const FrameSetup setup = setUpFrame(scene(text, sets), 1, options);
    const bool named = std::any_of(setup.notes.begin(), setup.notes.end(), [](const auto& note) {
      return contains(note, "the eye is in smoke");
    });
    EXPECT_EQ(named, sets.back() == "camera.position=[0.1,0.05,0.1]");
    return setup.layout.nearEye;
  };
  const std::string inside = "camera.position=[0.1,0.05,0.1]";
  const std::string lobe = "volume.0.phase={ g = 0.6 }";
  EXPECT_GT(nearEye({lobe}), 0);
  EXPECT_GT(nearEye({lobe, inside}), 0);
  EXPECT_GT(nearEye({lobe, "estimator.basis=histogram"}), 0);
  EXPECT_EQ(nearEye({inside, "volume.0.phase={ g = 0 }"}), 0);  // light without directions
  EXPECT_EQ(nearEye({lobe}, true), 0);                          // of no one eye
  EXPECT_EQ(nearEye({lobe, "estimator.basis=histogram", "estimator.evaluate=per_step"}), 0);
}

// A sharp lobe makes bright blocks of single photons where directions are not smoothed.
TEST_F(PipelineTest, DirectionsOfSharpLobesAreSmoothed) {
  const std::string text = ballScene(ball("a.vdb"), Vec3d(0), 1);
  const auto layout = [&](std::vector<std::string> sets, bool cache = false) {
    SetupOptions options;
    options.forLightCache = cache;
    return setUpFrame(scene(text, sets), 1, options).layout;
  };
  using estimators::Basis;
  using sphere::AngularKernel;
  for (const char* set : {"scene.seed=1", "volume.0.phase={ g = 0.84 }"}) {
    EXPECT_EQ(layout({set}).basis, Basis::view);
    EXPECT_EQ(layout({set}).angularKernel, AngularKernel::none);
    EXPECT_EQ(layout({set}, true).bins(), 32);
  }
  for (const char* phase :
       {"{ g = 0.85 }", "{ g = -0.9 }", "{ g = 0.9999 }", "{ type = \"mie_fog\" }",
        "{ type = \"double_henyey_greenstein\", g1 = 0.1, g2 = 0.9 }"}) {
    const std::string set = std::string("volume.0.phase=") + phase;
    EXPECT_EQ(layout({set}).basis, Basis::view) << phase;
    EXPECT_EQ(layout({set}).angularKernel, AngularKernel::epanechnikov) << phase;
    EXPECT_EQ(layout({set}).bandwidth, 0.2) << phase;
    // What is asked for by name is done.
    EXPECT_EQ(layout({set, "estimator.kernel=none"}).angularKernel, AngularKernel::none) << phase;
    EXPECT_EQ(layout({set, "estimator.basis=view"}).angularKernel, AngularKernel::none) << phase;
    // Bins that serve every camera are fine enough.
    EXPECT_EQ(layout({set}, true).bins(), 128) << phase;
    EXPECT_EQ(layout({set, "estimator.rows=2"}, true).bins(), 32) << phase;
  }
  const FrameSetup setup =
      setUpFrame(scene(text, {"volume.0.phase={ g = 0.9 }", "estimator.light_voxel=2"}), 1);
  ASSERT_FALSE(setup.notes.empty());
  EXPECT_TRUE(contains(setup.notes.back(), "estimator.kernel")) << setup.notes.back();
  // What a light cache holds is its own; the notes say nothing else.
  const FrameSetup cached =
      setUpFrame(scene(text, {"volume.0.phase={ g = 0.9 }", "estimator.cache=light.vdb"}), 1);
  for (const std::string& note : cached.notes)
    EXPECT_FALSE(contains(note, "lobe")) << note;
}

TEST_F(PipelineTest, AMissingGridListsWhatIsThere) {
  const std::string text = ballScene(ball("g.vdb"), Vec3d(0), 1);
  const std::string message = complaint(
      [&] { setUpFrame(scene(text, {"volume.0.density=smoke"}), 1); }, ExitCode::inputInvalid);
  EXPECT_TRUE(contains(message, "g.vdb")) << message;
  EXPECT_TRUE(contains(message, "no grid is named 'smoke'")) << message;
  EXPECT_TRUE(contains(message, "'density' (float)")) << message;
  EXPECT_TRUE(contains(complaint([&] { setUpFrame(scene(text, {"volume.0.albedo=Cd"}), 1); },
                                 ExitCode::inputInvalid),
                       "volume.albedo"));
  EXPECT_NE(complaint([&] { setUpFrame(scene(text, {"volume.0.file=none.vdb"}), 1); },
                      ExitCode::inputMissing),
            "");
}

TEST_F(PipelineTest, AnAlbedoGridWorksLikeTheConstantItHolds) {
  const std::string path = (m_folder / "albedo.vdb").string();
  volume::writeVdb(path, {ballGrid("density", Vec3d(0), 0.1),
                          volume::denseToGrid("half", Vec3i(8), std::vector<float>(512, 0.5f),
                                              [] {
                                                Mat4d m(0.5);
                                                m[3] = glm::dvec4(-1.75, -1.75, -1.75, 1);
                                                return m;
                                              }()),
                          ballGrid("bright", Vec3d(0), 0.1, 3.0f)});
  const std::string text = ballScene(path, Vec3d(0), 1);
  const FrameResult constant = renderScene(scene(text, {"volume.0.albedo=0.5"}), 1);
  const FrameResult grid = renderScene(scene(text, {"volume.0.albedo=half"}), 1);
  EXPECT_LT(relativeDifference(constant, grid), 0.03);
  EXPECT_TRUE(contains(complaint([&] { setUpFrame(scene(text, {"volume.0.albedo=bright"}), 1); },
                                 ExitCode::inputInvalid),
                       "an albedo lies in [0, 1]"));
}

TEST_F(PipelineTest, ColouredAlbedoMakesTheFrameChromatic) {
  const std::string text = ballScene(ball("c.vdb"), Vec3d(0), 1);
  const FrameSetup grey = setUpFrame(scene(text), 1);
  EXPECT_FALSE(grey.effects.chromatic);
  EXPECT_EQ(grey.layout.channels, 1);
  const SceneFile red = scene(text, {"volume.0.albedo=[0.9, 0.5, 0.1]"});
  const FrameSetup coloured = setUpFrame(red, 1);
  EXPECT_TRUE(coloured.effects.chromatic);
  EXPECT_EQ(coloured.layout.channels, 3);
  const FrameResult r = renderScene(red, 1);
  const Rgb pixel = r.layers.beauty[16 * 32 + 16];
  EXPECT_GT(pixel.r, 1.2f * pixel.g);
  EXPECT_GT(pixel.g, 1.2f * pixel.b);
  EXPECT_NE(complaint([&] {
              setUpFrame(scene(text, {"light.0.color=[1, 0, 0]", "effects.chromatic=off"}), 1);
            }),
            "");
}

TEST_F(PipelineTest, EffectsSwitchLayersOff) {
  const std::string text = ballScene(ball("e.vdb"), Vec3d(0), 1);
  for (const char* type : {"photosphere", "path_traced"}) {
    const std::vector<std::string> common = {std::string("estimator.type=") + type,
                                             "estimator.samples=4"};
    auto sets = common;
    sets.emplace_back("effects.multiple_scattering=off");
    const FrameResult single = renderScene(scene(text, sets), 1);
    EXPECT_GT(meanOf(single.layers.single), 0.01) << type;
    EXPECT_EQ(meanOf(single.layers.multiple), 0.0) << type;
    EXPECT_NEAR(meanOf(single.layers.beauty), meanOf(single.layers.single), 1e-6) << type;
    sets = common;
    sets.emplace_back("effects.single_scattering=off");
    const FrameResult multiple = renderScene(scene(text, sets), 1);
    EXPECT_EQ(meanOf(multiple.layers.single), 0.0) << type;
    EXPECT_GT(meanOf(multiple.layers.multiple), 0.01) << type;
    sets = common;
    sets.emplace_back("volume.0.albedo=0");
    EXPECT_EQ(meanOf(renderScene(scene(text, sets), 1).layers.beauty), 0.0) << type;
  }
  const FrameResult lone = renderScene(scene(text, {"estimator.type=single"}), 1);
  EXPECT_EQ(lone.statistics.photonsEmitted, 0u);
  EXPECT_GT(meanOf(lone.layers.single), 0.01);
}

TEST_F(PipelineTest, PhotosphereAgreesWithPathTracing) {
  const std::string text = ballScene(ball("p.vdb"), Vec3d(0), 1);
  const FrameResult fast = renderScene(
      scene(text, {"estimator.photons=100000", "render.samples=8", "estimator.light_voxel=1"}), 1);
  const FrameResult truth =
      renderScene(scene(text, {"estimator.type=path_traced", "estimator.samples=128"}), 1);
  EXPECT_NEAR(meanOf(fast.layers.single) / meanOf(truth.layers.single), 1.0, 0.03);
  EXPECT_NEAR(meanOf(fast.layers.multiple) / meanOf(truth.layers.multiple), 1.0, 0.05);
}

TEST_F(PipelineTest, AnEnvironmentIsSeenThroughTheSmoke) {
  const std::string file = ball("s.vdb");
  const std::string text =
      "[camera]\nposition = [0, 0, 6]\nresolution = [32, 32]\n[[volume]]\nfile = \"" + file +
      "\"\nalbedo = 1\n[[light]]\ntype = \"environment\"\n"
      "[estimator]\nphotons = 200000\n";
  const FrameResult furnace = renderScene(scene(text), 1);
  EXPECT_NEAR(meanOf(furnace.layers.beauty), 1.0, 0.02);
  EXPECT_LT(meanOf(furnace.layers.background), 0.99);
  const FrameResult dark = renderScene(scene(text, {"effects.environment=off"}), 1);
  EXPECT_EQ(meanOf(dark.layers.beauty), 0.0);
}

TEST_F(PipelineTest, EmptySmokeRendersTheBackgroundAlone) {
  const std::string path = (m_folder / "empty.vdb").string();
  volume::writeVdb(
      path, {volume::denseToGrid("density", Vec3i(4), std::vector<float>(64, 0.0f), Mat4d(1.0))});
  const FrameResult r = renderScene(
      scene(ballScene(path, Vec3d(0), 1, "[[light]]\ntype = \"environment\"\nintensity = 0.5\n")),
      1);
  for (const Rgb& pixel : r.layers.beauty)
    EXPECT_EQ(pixel, Rgb(0.5f));
}

// Whatever the format says it in, and with nothing but the cache as well.
TEST_F(PipelineTest, FramesOfNoParticlesAreEmpty) {
  writeText(m_folder / "none.csv", "x,y,z,pscale,vx,vy,vz\n");
  writeText(m_folder / "none.pts", "0\n");
  writeText(m_folder / "none.ply",
            "ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nproperty float y\n"
            "property float z\nend_header\n");
  volume::writeVdb(m_folder / "none.vdb", {volume::pointsToGrid({}, "points", 0)});
  for (const char* name : {"none.csv", "none.pts", "none.ply", "none.vdb"}) {
    const std::string path = (m_folder / name).string();
    const std::vector<std::string> sets{"camera.resolution=[8, 8]", "estimator.photons=1000",
                                        "estimator.carrier=particles", "volume.0.velocity=v"};
    for (const SceneFile& s :
         {scene(ballScene(path, Vec3d(0), 1), sets), sceneForVolume(path, sets)}) {
      const FrameResult r = renderScene(s, 1);
      EXPECT_EQ(meanOf(r.layers.beauty), 0.0) << name;
      EXPECT_TRUE(std::any_of(r.notes.begin(), r.notes.end(), [](const std::string& note) {
        return contains(note, "no smoke in it at this frame");
      })) << name;
    }
  }
}

TEST_F(PipelineTest, PointsAloneAreRasterizedAndCarryLight) {
  const std::string path = (m_folder / "points.vdb").string();
  const volume::ParticleSet seeded =
      volume::seedParticles(ballGrid("density", Vec3d(0), 0.1), 4000, 1);
  volume::writeVdb(path, {volume::pointsToGrid(seeded, "points", 0)});
  const std::string text = ballScene(path, Vec3d(0), 1);
  const FrameResult r = renderScene(scene(text, {"estimator.carrier=particles"}), 1);
  EXPECT_GT(meanOf(r.layers.multiple), 0.0);
  const FrameSetup setup = setUpFrame(scene(text, {"estimator.carrier=particles"}), 1);
  EXPECT_EQ(setup.particles.size(), seeded.size());
  EXPECT_GT(setup.medium->bounds().extent().x, 1.5);
  // A grid without points has nothing to carry light on.
  EXPECT_NE(complaint([&] {
              renderScene(
                  scene(ballScene(ball("q.vdb"), Vec3d(0), 1), {"estimator.carrier=particles"}), 1);
            }),
            "");
}

// The order and the positions are those that a point grid on disk gives back, whatever the reader.
TEST_F(PipelineTest, CarriersHaveTheOrderOfAPointGrid) {
  volume::ParticleSet seeded = volume::seedParticles(ballGrid("density", Vec3d(0), 0.1), 500, 2);
  const std::string vdb = (m_folder / "p.vdb").string(), ply = (m_folder / "p.ply").string();
  const volume::Grid grid = volume::pointsToGrid(seeded, "points", 0);
  volume::writeVdb(vdb, {grid});
  caches::CacheContent content;
  content.particles.push_back(seeded);
  content.particleNames.emplace_back("points");
  const caches::CacheFormat& format = caches::formatForWriting(ply);
  format.write(ply, content, ParamValues(format.params));
  const auto carriers = [&](const std::string& file) {
    return setUpFrame(scene(ballScene(file, Vec3d(0), 1), {"estimator.carrier=particles"}), 1);
  };
  const FrameSetup a = carriers(vdb), b = carriers(ply);
  ASSERT_EQ(a.particles.size(), 500u);
  const std::vector<Vec3d> order = volume::gridToPoints(grid).positions;
  for (std::size_t i = 0; i < order.size(); ++i) {
    EXPECT_LT(glm::length(a.space.worldFromLocal(Vec3d(a.particles[i])) - order[i]), 1e-6);
    EXPECT_LT(glm::length(a.particles[i] - b.particles[i]), 1e-5f);
  }
}

TEST_F(PipelineTest, ALightCacheStandsForTracing) {
  const std::string text = ballScene(ball("l.vdb"), Vec3d(0), 1);
  const std::string cache = (m_folder / "light.####.vdb").string();
  const FrameStatistics traced = traceScene(scene(text), 3, cache);
  EXPECT_EQ(traced.photonsEmitted, 20000u);
  EXPECT_TRUE(std::filesystem::exists(m_folder / "light.0003.vdb"));
  const FrameResult direct = renderScene(scene(text, {"estimator.basis=histogram"}), 3);
  const FrameResult cached = renderScene(scene(text, {"estimator.cache=" + cache}), 3);
  EXPECT_LT(relativeDifference(direct, cached), 1e-5);
  EXPECT_EQ(cached.statistics.photonsEmitted, 20000u);
  EXPECT_EQ(cached.statistics.seconds.trace, 0.0);
  // Another camera may use it; another lamp or another smoke may not.
  EXPECT_EQ(complaint([&] {
              renderScene(scene(text, {"estimator.cache=" + cache, "camera.fov=40"}), 3);
            }),
            "");
  for (const char* change : {"light.0.intensity=5", "volume.0.density_scale=2"}) {
    const SceneFile stale = scene(text, {"estimator.cache=" + cache, change});
    EXPECT_NE(complaint([&] { renderScene(stale, 3); }, ExitCode::inputInvalid), "") << change;
    RenderRequest request;
    request.allowStale = true;
    EXPECT_EQ(complaint([&] { renderScene(stale, 3, request); }), "") << change;
  }
  EXPECT_NE(complaint([&] { traceScene(scene(text, {"estimator.basis=view"}), 3, cache); }), "");
  EXPECT_NE(complaint([&] { traceScene(scene(text, {"estimator.type=single"}), 3, cache); }), "");
}

TEST_F(PipelineTest, TooLittleMemoryIsRefusedBeforeTheWork) {
  const std::string text = ballScene(ball("b.vdb"), Vec3d(0), 1);
  const std::string message = complaint(
      [&] { renderScene(scene(text, {"render.memory_limit=1e-5"}), 1); }, ExitCode::memory);
  EXPECT_TRUE(contains(message, "estimator.light_voxel")) << message;
  EXPECT_TRUE(contains(message, "render.memory_limit")) << message;
  // The histogram alone passes a budget that the view basis meets.
  const std::vector<std::string> wide = {"render.memory_limit=0.02", "estimator.light_voxel=1",
                                         "estimator.basis=histogram", "estimator.rows=8"};
  EXPECT_NE(complaint([&] { renderScene(scene(text, wide), 1); }, ExitCode::memory), "");
  EXPECT_EQ(complaint([&] { renderScene(scene(text, {"render.memory_limit=0.02"}), 1); }), "");
  auto free = wide;
  free[0] = "render.memory_limit=-1";
  free.emplace_back("estimator.photons=1000");
  EXPECT_EQ(complaint([&] { renderScene(scene(text, free), 1); }), "");
}

TEST_F(PipelineTest, RequestsOverrideTheScene) {
  const SceneFile s = scene(ballScene(ball("r.vdb"), Vec3d(0), 1));
  RenderRequest request;
  request.resolution = Vec2i(40, 20);
  const FrameResult whole = renderScene(s, 1, request);
  request.crop = render::Crop{{10, 5}, {30, 99}};
  const FrameResult part = renderScene(s, 1, request);
  ASSERT_EQ(part.layers.width(), 20);
  ASSERT_EQ(part.layers.height(), 15);
  for (int y = 0; y < 15; ++y)
    for (int x = 0; x < 20; ++x)
      EXPECT_EQ(part.layers.beauty[static_cast<std::size_t>(y * 20 + x)],
                whole.layers.beauty[static_cast<std::size_t>((y + 5) * 40 + x + 10)]);
  request.crop = render::Crop{{50, 0}, {60, 10}};
  EXPECT_NE(complaint([&] { renderScene(s, 1, request); }), "");
  request.crop.reset();
  request.seed = 99;
  EXPECT_GT(relativeDifference(whole, renderScene(s, 1, request)), 1e-4);
}

TEST_F(PipelineTest, SeedsFollowFramesUnlessHeld) {
  const std::string text = ballScene(ball("w.vdb"), Vec3d(0), 1);
  const FrameResult one = renderScene(scene(text), 1);
  EXPECT_EQ(relativeDifference(one, renderScene(scene(text), 1)), 0.0);
  EXPECT_GT(relativeDifference(one, renderScene(scene(text), 2)), 1e-4);
  const SceneFile held = scene(text, {"scene.seed_per_frame=false"});
  EXPECT_EQ(relativeDifference(renderScene(held, 1), renderScene(held, 2)), 0.0);
}

TEST_F(PipelineTest, StatisticsAreJsonWithTheKeysOfTheContract) {
  FrameResult r = renderScene(scene(ballScene(ball("j.vdb"), Vec3d(0), 1)), 1);
  r.statistics.effects.push_back({"odd", true, "bytes \xff \"quoted\"\n"});
  r.statistics.imageMax = std::nan("");
  const auto json = nlohmann::json::parse(statsJson(r.statistics));
  for (const char* key :
       {"seconds", "cpu_seconds", "peak_memory_bytes", "photons", "energy_watts", "nan_samples",
        "negative_samples", "majorant_violations", "effects", "image", "version", "scene_hash"})
    EXPECT_TRUE(json.contains(key)) << key;
  for (const char* key : {"read", "rasterize", "trace", "resolve", "march", "write", "total"})
    EXPECT_TRUE(json["seconds"][key].is_number()) << key;
  for (const char* key : {"emitted", "scattered", "stored", "capped"})
    EXPECT_TRUE(json["photons"][key].is_number_unsigned()) << key;
  for (const char* key : {"emitted", "missed", "absorbed", "escaped", "capped", "error"})
    EXPECT_EQ(json["energy_watts"][key].size(), 3u) << key;
  for (const char* key : {"emission", "single_scattering", "multiple_scattering", "shadows",
                          "chromatic", "motion_blur", "depth_of_field", "environment"}) {
    EXPECT_TRUE(json["effects"][key]["on"].is_boolean()) << key;
    EXPECT_TRUE(json["effects"][key]["why"].is_string()) << key;
    EXPECT_TRUE(json["effects"][key].contains("bound")) << key;
  }
  EXPECT_TRUE(json["image"]["mean"].is_number());
  EXPECT_TRUE(json["image"]["max"].is_null());
}

TEST_F(PipelineTest, FilesHoldLayersAndAHeader) {
  const SceneFile s = scene(ballScene(ball("x.vdb"), Vec3d(0), 1));
  FrameResult r = renderScene(s, 7);
  WriteRequest request;
  request.path = (m_folder / "out/f.####.exr").string();
  request.preview = (m_folder / "out/f.####.png").string();
  FrameWriter(s, request).write(r);
  EXPECT_TRUE(std::filesystem::exists(m_folder / "out/f.0007.png"));
  const image::ExrFile file = image::readExr(m_folder / "out/f.0007.exr");
  for (const char* name : {"R", "G", "B", "A", "Z", "single.R", "multiple.G", "transmittance.B"})
    EXPECT_TRUE(file.image.has(name)) << name;
  EXPECT_FALSE(file.image.has("background.R"));
  for (const char* name : {"worldToCamera", "worldToNDC", "chromaticities", "framesPerSecond",
                           "timeCode", "photosphere:estimator", "photosphere:photons",
                           "photosphere:radius", "photosphere:histogram", "photosphere:scene_hash",
                           "photosphere:medium_hash", "photosphere:seed", "photosphere:effects",
                           "photosphere:seconds", "photosphere:peak_memory_bytes"})
    EXPECT_EQ(file.attributes.count(name), 1u) << name;
  // A known point: the ball's centre lies in the middle of the frame, 6 units away.
  const auto ndc = std::get<Mat4d>(file.attributes.at("worldToNDC")) * glm::dvec4(0, 0, 0, 1);
  EXPECT_NEAR(ndc.x / ndc.w, 0.5, 1e-6);
  EXPECT_NEAR(ndc.y / ndc.w, 0.5, 1e-6);
  const auto camera = std::get<Mat4d>(file.attributes.at("worldToCamera")) * glm::dvec4(0, 0, 0, 1);
  EXPECT_NEAR(camera.z, 6.0, 1e-6);
}

TEST_F(PipelineTest, AovsAreSelectedByName) {
  const FrameResult r = renderScene(scene(ballScene(ball("v.vdb"), Vec3d(0), 1)), 1);
  const image::Image some = frameImage(r, {"beauty", "depth"});
  EXPECT_TRUE(some.has("A"));
  EXPECT_TRUE(some.has("Z"));
  EXPECT_FALSE(some.has("single.R"));
  const std::string message = complaint([&] { frameImage(r, {"beautty"}); });
  EXPECT_TRUE(contains(message, "did you mean 'beauty'?")) << message;
}

// A sequence has the same channels throughout, whatever a frame's smoke does.
TEST_F(PipelineTest, ALayerThatTheFrameLacksIsZeros) {
  const FrameResult r = renderScene(scene(ballScene(ball("v.vdb"), Vec3d(0), 1)), 1);
  const auto lacks = [&](const std::string& name) {
    return std::find(r.layerNames.begin(), r.layerNames.end(), name) == r.layerNames.end();
  };
  EXPECT_FALSE(frameImage(r, {}).has("emission.R"));
  for (const std::string name : {"emission", "background", "error"}) {
    EXPECT_TRUE(lacks(name)) << name;
    const image::Image some = frameImage(r, {"beauty", name});
    EXPECT_TRUE(some.has("R"));
    EXPECT_FALSE(some.has("Z"));
    for (const char* channel : {".R", ".G", ".B"}) {
      ASSERT_TRUE(some.has(name + channel)) << name;
      for (const float value : some.channel(name + channel))
        EXPECT_EQ(value, 0.0f) << name;
    }
  }
}

TEST_F(PipelineTest, ABareVolumeGetsCameraAndLight) {
  const std::string path = ball("bare.vdb", Vec3d(10, 20, 30), 2.0);
  const SceneFile s =
      sceneForVolume(path, {"camera.resolution=[48, 27]", "estimator.photons=20000"});
  EXPECT_GE(s.choices.size(), 5u);
  const FrameResult r = renderScene(s, 1);
  // All of the smoke is in the frame, fills a good part of it, and is neither dark nor burnt out.
  double border = 0, brightest = 0;
  int covered = 0;
  for (int y = 0; y < 27; ++y)
    for (int x = 0; x < 48; ++x) {
      const auto i = static_cast<std::size_t>(y * 48 + x);
      if (x == 0 || y == 0 || x == 47 || y == 26)
        border = std::max(border, static_cast<double>(r.layers.alpha[i]));
      brightest = std::max(brightest, static_cast<double>(r.layers.beauty[i].x));
      covered += r.layers.alpha[i] > 0.5f;
    }
  EXPECT_LT(border, 0.02);
  EXPECT_GT(covered, 150);
  EXPECT_GT(brightest, 0.3);
  EXPECT_LT(brightest, 1.5);
  // What is printed is the scene, and a user's own value wins.
  const SceneFile again = parseScene(dumpScene(s), "dump.toml", "/");
  EXPECT_EQ(again.hash(), s.hash());
  EXPECT_EQ(
      sceneForVolume(path, {"volume.0.density_scale=7"}).volumes[0].values.vec3("density_scale").x,
      7.0);
}

// What is made up gives way to what says the same in other words.
TEST_F(PipelineTest, ABareVolumeTakesAnotherCameraOrLight) {
  const std::string path = ball("bare.vdb", Vec3d(10, 20, 30), 2.0);
  const auto coverage = [&](const std::vector<std::string>& sets) {
    std::vector<std::string> all{"camera.resolution=[48, 27]", "estimator.photons=2000"};
    all.insert(all.end(), sets.begin(), sets.end());
    const FrameResult r = renderScene(sceneForVolume(path, all), 1);
    double sum = 0;
    for (const float a : r.layers.alpha)
      sum += static_cast<double>(a);
    return sum / static_cast<double>(r.layers.alpha.size());
  };
  const double usual = coverage({});
  EXPECT_NEAR(coverage({"camera.type=perspective"}), usual, 0.02);
  EXPECT_NEAR(coverage({"camera.type=orthographic"}), usual, 0.1);
  EXPECT_GT(coverage({"camera.type=equirectangular"}), 1e-3);
  EXPECT_LT(coverage({"camera.focal_length=20"}), 0.7 * usual);
  // From 12 before the middle of a ball of radius 2, 30 degrees high.
  writeText(m_folder / "shot.chan", "1 10 20 42 0 0 0 30\n");
  const double tanHalf = std::tan(15 * 3.14159265 / 180);
  const double radius = 2 / std::sqrt(12.0 * 12 - 4) / tanHalf;  // half heights
  EXPECT_NEAR(coverage({"camera.file=shot.chan"}), 3.14159265 * radius * radius / 4 * 27 / 48,
              0.05);
  const SceneFile lit =
      sceneForVolume(path, {"light=[{ type = \"point\", position = [0, 0, 0], intensity = 1 }]"});
  ASSERT_EQ(lit.lights.size(), 1u);
  for (const std::string& choice : lit.choices)
    EXPECT_FALSE(contains(choice, "Key light")) << choice;
  // What is set was not chosen.
  const auto chosen = [&](const std::string& set, const std::string& what) {
    const SceneFile scene = sceneForVolume(path, {set});
    return std::any_of(scene.choices.begin(), scene.choices.end(),
                       [&](const std::string& choice) { return contains(choice, what); });
  };
  EXPECT_TRUE(chosen("scene.fps=24", "albedo = 0.9"));
  EXPECT_FALSE(chosen("volume.0.albedo=0.5", "albedo = "));
  EXPECT_TRUE(chosen("volume.0.albedo=0.5", "g = 0.4"));
  EXPECT_FALSE(chosen("volume.0.phase.g=0.1", "g = "));
}

TEST_F(PipelineTest, ABareSequenceIsFramedWhereItHasSmoke) {
  for (const int frame : {1, 2, 3})
    writeText(m_folder / fmt::format("p.000{}.csv", frame), "x,y,z,pscale\n");
  writeText(m_folder / "p.0004.csv", "x,y,z,pscale\n10,20,30,1\n11,20,30,1\n");
  const SceneFile s = sceneForVolume(m_folder / "p.####.csv");
  EXPECT_TRUE(contains(s.choices.front(), "frame 4, the nearest to the middle")) << s.choices[0];
  EXPECT_LT(glm::length(s.camera.vec3("look_at") - Vec3d(10.5, 20, 30)), 4.0);
}

TEST_F(PipelineTest, ABareVolumeInCentimetresIsLitAlike) {
  const FrameResult metres = renderScene(
      sceneForVolume(ball("m1.vdb"), {"camera.resolution=[32, 32]", "estimator.photons=20000"}), 1);
  const FrameResult centimetres = renderScene(
      sceneForVolume(
          ball("m2.vdb", Vec3d(0), 100.0),
          {"camera.resolution=[32, 32]", "estimator.photons=20000", "scene.meters_per_unit=0.01"}),
      1);
  EXPECT_NEAR(meanOf(centimetres.layers.beauty) / meanOf(metres.layers.beauty), 1.0, 0.02);
}

TEST_F(PipelineTest, ABareVolumeWithSeveralCandidatesAsks) {
  const std::string path = (m_folder / "many.vdb").string();
  volume::writeVdb(path, {ballGrid("soot", Vec3d(0), 0.2), ballGrid("steam", Vec3d(0), 0.2)});
  const std::string message = complaint([&] { sceneForVolume(path); }, ExitCode::inputInvalid);
  EXPECT_TRUE(contains(message, "soot")) << message;
  EXPECT_TRUE(contains(message, "-s volume.0.density=NAME")) << message;
  EXPECT_EQ(sceneForVolume(path, {"volume.0.density=steam"}).volumes[0].values.text("density"),
            "steam");
}

}  // namespace
}  // namespace photosphere::test
