// Options of [estimator]: presets, what has no meaning together, and what reads a light cache.

#include "fixture.h"
#include "photosphere/scene/scene_file.h"

namespace photosphere::test {
namespace {

using namespace scene;
using Sets = std::vector<std::string>;

const char* const kScene = "[[volume]]\nfile = \"a.vdb\"\n[[light]]\ntype = \"point\"\n";

SceneFile parse(const Sets& sets, const std::string& text = kScene) {
  return parseScene(text, "test.toml", "/", sets);
}

TEST(Preset, PaperIsMinAndIhm2010) {
  const SceneFile scene = parse({"estimator.preset=paper"});
  const ParamValues& e = scene.estimator;
  EXPECT_EQ(e.text("carrier"), "particles");
  EXPECT_EQ(e.text("basis"), "histogram");
  EXPECT_EQ(e.text("deposit"), "collision");
  EXPECT_EQ(e.integer("rows"), 2);
  EXPECT_EQ(e.text("direction"), "nearest");
  EXPECT_EQ(e.text("representative"), "bin");
  EXPECT_EQ(e.text("merge"), "sampled");
  EXPECT_EQ(e.text("evaluate"), "per_step");
  EXPECT_EQ(e.text("kernel"), "gaussian");
  EXPECT_EQ(e.integer("directions"), 128);
  // Keys beside it win, and what it says nothing of stays.
  const SceneFile other = parse({"estimator.preset=paper", "estimator.rows=1",
                                 "estimator.energy=gather", "estimator.merge=full"});
  EXPECT_EQ(other.estimator.integer("rows"), 1);
  EXPECT_EQ(other.estimator.text("energy"), "gather");
  EXPECT_EQ(other.estimator.text("merge"), "full");
  EXPECT_EQ(other.estimator.text("evaluate"), "per_step");
  EXPECT_EQ(other.estimator.integer("photons"), 1000000);
}

// Every preset is a legal set of known keys, and --dump-scene shows what it stands for.
TEST(Preset, IsShownWhole) {
  for (const Preset& preset : estimatorPresets()) {
    const SceneFile scene = parse({"estimator.preset=" + std::string(preset.name)});
    const std::string dumped = dumpScene(scene);
    for (const PresetValue& value : preset.values)
      EXPECT_TRUE(contains(dumped, fmt::format("\n{} = ", value.key))) << value.key;
    EXPECT_EQ(dumpScene(parse({}, dumped)), dumped);
  }
  EXPECT_TRUE(
      contains(complaint([] { parse({"estimator.preset=papre"}); }), "did you mean 'paper'"));
}

struct Illegal {
  Sets sets;
  const char* says;
};
class IllegalTogether : public ::testing::TestWithParam<Illegal> {};

TEST_P(IllegalTogether, IsAConfigError) {
  Sets sets;
  for (const std::string& set : GetParam().sets)
    sets.push_back("estimator." + set);
  const std::string message = complaint([&] { parse(sets); });
  EXPECT_TRUE(contains(message, "test.toml: [estimator]: ")) << message;
  EXPECT_TRUE(contains(message, GetParam().says)) << message;
}

INSTANTIATE_TEST_SUITE_P(
    Estimator, IllegalTogether,
    ::testing::Values(Illegal{{"energy=scatter"}, "carrier = \"particles\""},
                      Illegal{{"energy=scatter", "carrier=particles"}, "deposit = \"collision\""},
                      Illegal{{"energy=scatter", "deposit=collision"}, "carrier = \"particles\""},
                      Illegal{{"deposit_radius=1"}, "deposit_radius"},
                      Illegal{{"merge=sampled"}, "merge"},
                      Illegal{{"basis=view", "merge=sampled", "carrier=particles"}, "histogram"},
                      Illegal{{"basis=view", "direction=barycentric"}, "histogram"},
                      Illegal{{"basis=view", "representative=mean"}, "histogram"},
                      Illegal{{"basis=view", "evaluate=per_step"}, "histogram"},
                      Illegal{{"basis=view", "kernel=gaussian", "bandwidth=0"}, "bandwidth"},
                      Illegal{{"direction=kernel"}, "'kernel'"},
                      Illegal{{"kernel=gaussian", "bandwidth=0"}, "bandwidth"},
                      Illegal{{"kernel=gaussian", "truncation=0"}, "truncation"},
                      Illegal{{"bandwidth=0.3"}, "kernel"}, Illegal{{"truncation=2"}, "kernel"},
                      Illegal{{"directions=72"}, "sampled"},
                      Illegal{{"preset=paper", "directions=100"}, "72 and 128"},
                      Illegal{{"preset=paper", "carrier=voxels"}, "energy"},
                      Illegal{{"preset=paper", "carrier=voxels", "energy=gather"}, "merge"},
                      Illegal{{"preset=paper", "basis=view"}, "histogram"}));

// Options of bins make `auto` a histogram.
TEST(Basis, AutoFollowsTheOptions) {
  for (const char* set :
       {"direction=barycentric", "representative=mean", "evaluate=per_step", "kernel=gaussian"})
    EXPECT_EQ(complaint([&] { parse({std::string("estimator.") + set}); }), "") << set;
}

double meanOf(const std::vector<Rgb>& pixels) {
  double sum = 0;
  for (const Rgb& p : pixels)
    sum += static_cast<double>(meanComponent(p));
  return sum / static_cast<double>(pixels.size());
}

class DirectionsOfAScene : public ::testing::Test {
 protected:
  SceneFile scene(const Sets& sets) {
    const std::string path = (m_folder / "ball.vdb").string();
    if (!std::filesystem::exists(path)) {
      volume::ParticleSet points;
      for (int i = 0; i < 3000; ++i) {
        // Spread evenly in the ball by a golden spiral on shells.
        const double r = std::cbrt((i + 0.5) / 3000), z = 1 - 2 * std::fmod(i * 0.61803398875, 1.0);
        const double a = i * 2.39996322973, s = std::sqrt(1 - z * z);
        points.positions.emplace_back(r * s * std::cos(a), r * s * std::sin(a), r * z);
      }
      volume::writeVdb(
          path, {ballGrid("density", Vec3d(0), 0.1), volume::pointsToGrid(points, "points", 0.0)});
    }
    return parseScene(ballScene(path, Vec3d(0), 1), "test.toml", m_folder.path(), sets);
  }
  // What made the pixels of a frame that reads the cache.
  std::string layoutBy(const std::string& cache, Sets sets = {}) {
    sets.push_back("estimator.cache=" + cache);
    return renderScene(scene(sets), 1).layout;
  }
  TemporaryFolder m_folder;
};

// The whole way from keys to pixels; the header names what made them.
TEST_F(DirectionsOfAScene, RenderByEveryKey) {
  const double plain = meanOf(renderScene(scene({}), 1).layers.multiple);
  struct Case {
    Sets keys;
    const char* layout;
    double within = 0.2;
  };
  const Case cases[] = {
      {{"direction=barycentric"}, "direction barycentric"},
      {{"direction=kernel", "kernel=gaussian", "bandwidth=0.3"}, "direction kernel"},
      {{"representative=mean"}, "representative mean"},
      {{"evaluate=per_step"}, "evaluate per_step"},
      {{"kernel=epanechnikov"}, "kernel epanechnikov"},
      {{"kernel=gaussian", "truncation=1.5"}, "kernel gaussian of bandwidth 0.5 cut at 1.5"},
      {{"carrier=particles", "merge=sampled"}, "merge sampled"},
      // Few particles and a wide radius: eq. 7b spreads light out of the ball.
      {{"preset=paper"}, "evaluate per_step, kernel gaussian", 0.4}};
  for (const auto& [keys, layout, within] : cases) {
    Sets sets;
    for (const std::string& key : keys)
      sets.push_back("estimator." + key);
    const FrameResult result = renderScene(scene(sets), 1);
    EXPECT_TRUE(contains(result.layout, layout)) << result.layout;
    EXPECT_NEAR(meanOf(result.layers.multiple) / plain, 1.0, within) << layout;
  }
}

// A cache keeps how light was stored; how it is read is the scene's to say.
TEST_F(DirectionsOfAScene, AreReadFromACacheAsTheSceneSays) {
  const std::string cache = (m_folder / "light.vdb").string();
  traceScene(scene({"estimator.direction=barycentric"}), 1, cache);
  const std::string plain = layoutBy(cache);
  EXPECT_TRUE(contains(plain, "direction barycentric")) << plain;
  const std::string smooth =
      layoutBy(cache, {"estimator.kernel=gaussian", "estimator.evaluate=per_step"});
  EXPECT_TRUE(contains(smooth, "direction barycentric, evaluate per_step, kernel gaussian"))
      << smooth;
  const std::string message = complaint([&] { layoutBy(cache, {"estimator.merge=sampled"}); });
  EXPECT_TRUE(contains(message, "particles")) << message;
  const std::string seen = layoutBy(cache, {"estimator.smoothing=visible"});
  EXPECT_TRUE(contains(seen, "smoothing visible")) << seen;
}

// What photons counted by is read as it was stored, unless the scene says otherwise.
TEST_F(DirectionsOfAScene, KeepWhatTheyCountByInACache) {
  const std::string cache = (m_folder / "light.vdb").string();
  traceScene(scene({"estimator.smoothing=visible"}), 1, cache);
  const std::string seen = layoutBy(cache);
  EXPECT_TRUE(contains(seen, "smoothing visible")) << seen;
  const std::string plain = layoutBy(cache, {"estimator.smoothing=plain"});
  EXPECT_TRUE(contains(plain, "smoothing plain")) << plain;
}

}  // namespace
}  // namespace photosphere::test
