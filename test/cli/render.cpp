// photosphere render and trace from outside: frames, overrides, statistics, refusals.

#include <nlohmann/json.hpp>

#include "fixture.h"

namespace photosphere::test {
namespace {

using nlohmann::json;

/// Small pictures of three frames of smoke, the third twice as dense.
class Render : public ::testing::Test {
 protected:
  void SetUp() override {
    writeSmokeFrames(m_folder, 3);
    writeText(m_folder / "scene.toml", litSmoke(16, 12) + "[render]\nsamples = 1\n");
  }
  RunResult run(const char* command, std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), command);
    return runTool(arguments, m_folder.path());
  }
  RunResult render(std::vector<std::string> arguments) { return run("render", arguments); }
  image::ExrFile exr(const std::string& name) { return image::readExr(m_folder / name); }
  bool samePixels(const std::string& a, const std::string& b) {
    return differingChannel(m_folder / a, m_folder / b).empty();
  }
  double mean(const std::string& name) {
    const image::ExrFile file = exr(name);
    double sum = 0;
    for (const float v : file.image.channel("R"))
      sum += v;
    return sum / static_cast<double>(file.image.pixelCount());
  }

  TemporaryFolder m_folder;
};

TEST_F(Render, FindsItsFramesByTheCache) {
  const RunResult result = render({"scene.toml", "-o", "out/x.####.exr"});
  ASSERT_EQ(result.exitCode, 0) << result.err;
  EXPECT_EQ(namesIn(m_folder / "out"),
            (std::set<std::string>{"x.0001.exr", "x.0002.exr", "x.0003.exr"}));
  for (const char* word : {"frame 1: out/x.0001.exr", "march", "mean", "total"})
    EXPECT_NE(result.out.find(word), std::string::npos) << word << '\n' << result.out;
  EXPECT_GT(mean("out/x.0001.exr"), 0);
  EXPECT_FALSE(samePixels("out/x.0001.exr", "out/x.0003.exr"));
}

TEST_F(Render, TellsOfFramesThatTheCacheLacks) {
  fs::rename(m_folder / "smoke.0002.vdb", m_folder / "smoke.0004.vdb");
  const auto count = [](const std::string& text) {
    const std::string hole = "smoke.####.vdb: frames are missing: 2";
    std::size_t found = 0;
    for (std::size_t at = text.find(hole); at != std::string::npos; at = text.find(hole, at + 1))
      ++found;
    return found;
  };
  const std::vector<std::string> all{"scene.toml",   "-o",     "x.####.exr",
                                     "--cache-hold", "extend", "--dry-run"};
  RunResult result = render(all);
  EXPECT_EQ(result.exitCode, 0) << result.err;
  EXPECT_EQ(count(result.err), 1u) << result.err;
  std::vector<std::string> some = all;
  some.insert(some.end(), {"--frames", "1,3"});
  result = render(some);
  EXPECT_EQ(result.exitCode, 0) << result.err;
  EXPECT_EQ(count(result.err), 0u) << result.err;
}

TEST_F(Render, TakesFramesFromTheOptionThenTheScene) {
  ASSERT_EQ(render({"scene.toml", "-o", "a.####.exr", "-s", "scene.frames=2-3"}).exitCode, 0);
  EXPECT_FALSE(fs::exists(m_folder / "a.0001.exr"));
  EXPECT_TRUE(fs::exists(m_folder / "a.0003.exr"));
  ASSERT_EQ(render({"scene.toml", "-o", "b.%02d.exr", "-s", "scene.frames=2-3", "--frames", "1"})
                .exitCode,
            0);
  EXPECT_TRUE(fs::exists(m_folder / "b.01.exr"));
  EXPECT_FALSE(fs::exists(m_folder / "b.02.exr"));
}

TEST_F(Render, DeliversTheOtherFramesWhenOneIsBad) {
  truncate(m_folder / "smoke.0002.vdb");
  RunResult result =
      render({"scene.toml", "-o", "x.####.exr", "--keep-going", "--stats", "s.json"});
  EXPECT_EQ(result.exitCode, 8) << result.err;
  EXPECT_NE(result.err.find("smoke.0002.vdb"), std::string::npos) << result.err;
  EXPECT_NE(result.err.find("1 of 3 frames failed: 2"), std::string::npos) << result.err;
  EXPECT_TRUE(fs::exists(m_folder / "x.0001.exr"));
  EXPECT_FALSE(fs::exists(m_folder / "x.0002.exr"));
  EXPECT_TRUE(fs::exists(m_folder / "x.0003.exr"));
  const json stats = json::parse(readText(m_folder / "s.json"));
  ASSERT_EQ(stats.size(), 2u);
  EXPECT_EQ(stats.at(1).at("frame"), 3);
  result = render({"scene.toml", "-o", "y.####.exr"});
  EXPECT_EQ(result.exitCode, 4) << result.err;
  EXPECT_FALSE(fs::exists(m_folder / "y.0003.exr"));
}

TEST_F(Render, SkipsOnlyOutputsThatAreComplete) {
  ASSERT_EQ(render({"scene.toml", "-o", "x.####.exr", "--frames", "1-2"}).exitCode, 0);
  truncate(m_folder / "x.0002.exr");
  const auto first = fs::last_write_time(m_folder / "x.0001.exr");
  const RunResult result = render({"scene.toml", "-o", "x.####.exr", "--skip-existing"});
  ASSERT_EQ(result.exitCode, 0) << result.err;
  EXPECT_EQ(fs::last_write_time(m_folder / "x.0001.exr"), first);
  EXPECT_TRUE(image::exrIsComplete(m_folder / "x.0002.exr"));
  EXPECT_TRUE(image::exrIsComplete(m_folder / "x.0003.exr"));
}

TEST_F(Render, WritesStatisticsPerFrame) {
  ASSERT_EQ(render({"scene.toml", "-o", "x.####.exr", "--frames", "1-2", "--stats", "s.####.json"})
                .exitCode,
            0);
  const json second = json::parse(readText(m_folder / "s.0002.json"));
  EXPECT_EQ(second.at("frame"), 2);
  EXPECT_EQ(second.at("output"), "x.0002.exr");
  for (const char* key : {"seconds", "cpu_seconds", "peak_memory_bytes", "photons", "energy_watts",
                          "nan_samples", "effects", "image"})
    EXPECT_TRUE(second.contains(key)) << key;
  EXPECT_EQ(second.at("photons").at("emitted"), 2000);
  ASSERT_EQ(render({"scene.toml", "-o", "x.exr", "--frames", "3", "--stats", "one.json"}).exitCode,
            0);
  EXPECT_EQ(json::parse(readText(m_folder / "one.json")).at("frame"), 3);
}

TEST_F(Render, MapsFramesToThoseOfTheCache) {
  ASSERT_EQ(render({"scene.toml", "-o", "x.####.exr"}).exitCode, 0);
  ASSERT_EQ(render({"scene.toml", "-o", "x.####.exr", "--frames", "101", "--cache-offset", "-100"})
                .exitCode,
            0);
  EXPECT_TRUE(samePixels("x.0101.exr", "x.0001.exr"));
  ASSERT_EQ(render({"scene.toml", "-o", "x.####.exr", "--frames", "4", "--cache-hold", "extend"})
                .exitCode,
            0);
  EXPECT_TRUE(samePixels("x.0004.exr", "x.0003.exr"));
  ASSERT_EQ(render({"scene.toml", "-o", "x.####.exr", "--frames", "5", "--cache-hold", "repeat"})
                .exitCode,
            0);
  EXPECT_TRUE(samePixels("x.0005.exr", "x.0002.exr"));
  const RunResult clip =
      render({"scene.toml", "-o", "x.####.exr", "--frames", "6", "--cache-hold", "clip"});
  ASSERT_EQ(clip.exitCode, 0) << clip.err;
  EXPECT_EQ(mean("x.0006.exr"), 0);
  EXPECT_EQ(clip.err.find("warning"), std::string::npos) << clip.err;  // it was asked for
  EXPECT_EQ(render({"scene.toml", "-o", "x.####.exr", "--frames", "7"}).exitCode, 3);
}

TEST_F(Render, WarnsOfABlackFrame) {
  std::vector<std::string> dark{"scene.toml", "-o", "x.exr", "--frames", "1", "-s", "light=[]"};
  RunResult result = render(dark);
  EXPECT_EQ(result.exitCode, 0) << result.err;
  EXPECT_NE(result.err.find("warning: frame 1: the frame is black: there is no light"),
            std::string::npos)
      << result.err;
  EXPECT_EQ(mean("x.exr"), 0);
  dark.emplace_back("-q");
  EXPECT_EQ(render(dark).err, "");
}

TEST_F(Render, OverridesResolutionAndCrops) {
  const RunResult result = render(
      {"scene.toml", "-o", "x.exr", "--frames", "1", "--res", "20x10", "--crop", "4,2,12,9"});
  ASSERT_EQ(result.exitCode, 0) << result.err;
  const image::Image picture = exr("x.exr").image;
  EXPECT_EQ(picture.displayWindow(), (image::Window{0, 0, 20, 10}));
  EXPECT_EQ(picture.dataWindow(), (image::Window{4, 2, 8, 7}));
}

TEST_F(Render, DoesNotDependOnThreads) {
  ASSERT_EQ(render({"scene.toml", "-o", "a.exr", "--frames", "1", "-j", "1"}).exitCode, 0);
  ASSERT_EQ(render({"scene.toml", "-o", "b.exr", "--frames", "1", "-j", "3"}).exitCode, 0);
  EXPECT_TRUE(samePixels("a.exr", "b.exr"));
  ASSERT_EQ(render({"scene.toml", "-o", "c.exr", "--frames", "1", "--seed", "77"}).exitCode, 0);
  EXPECT_FALSE(samePixels("a.exr", "c.exr"));
}

TEST_F(Render, MakesUpASceneForABareCacheAndDumpsIt) {
  const std::vector<std::string> small{"--res", "16x12", "-s", "estimator.photons=2000"};
  auto with = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.end(), small.begin(), small.end());
    return render(arguments);
  };
  const RunResult bare = with({"smoke.0002.vdb", "-o", "bare.exr"});
  ASSERT_EQ(bare.exitCode, 0) << bare.err;
  for (const char* word : {"density", "camera", "light"})
    EXPECT_NE(bare.err.find(word), std::string::npos) << word << '\n' << bare.err;
  const RunResult dump = with({"smoke.0002.vdb", "--dump-scene"});
  ASSERT_EQ(dump.exitCode, 0) << dump.err;
  fs::create_directory(m_folder / "elsewhere");
  writeText(m_folder / "elsewhere/dumped.toml", dump.out);
  const RunResult again = render({"elsewhere/dumped.toml", "-o", "again.exr"});
  ASSERT_EQ(again.exitCode, 0) << again.err;
  EXPECT_TRUE(samePixels("bare.exr", "again.exr"));
}

TEST_F(Render, DryRunWritesNothing) {
  const auto before = namesIn(m_folder.path());
  const RunResult result = render({"scene.toml", "-o", "x.####.exr", "--dry-run"});
  EXPECT_EQ(result.exitCode, 0) << result.err;
  for (const char* word : {"x.0003.exr", "multiple_scattering", "16 x 12"})
    EXPECT_NE(result.out.find(word), std::string::npos) << word << '\n' << result.out;
  EXPECT_EQ(namesIn(m_folder.path()), before);
}

TEST_F(Render, UsesATracedLightCache) {
  RunResult result = run(
      "trace", {"scene.toml", "-o", "light.####.vdb", "--frames", "1", "--stats", "trace.json"});
  if (result.exitCode == 2 && result.err.find("not served") != std::string::npos)
    GTEST_SKIP() << result.err;
  ASSERT_EQ(result.exitCode, 0) << result.err;
  EXPECT_EQ(json::parse(readText(m_folder / "trace.json")).at("photons").at("emitted"), 2000);
  result = render(
      {"scene.toml", "-o", "cached.exr", "--frames", "1", "-s", "estimator.cache=light.####.vdb"});
  ASSERT_EQ(result.exitCode, 0) << result.err;
  result = render(
      {"scene.toml", "-o", "direct.exr", "--frames", "1", "-s", "estimator.basis=histogram"});
  ASSERT_EQ(result.exitCode, 0) << result.err;
  const RunResult same =
      run("compare", {"cached.exr", "direct.exr", "--layer", "RGB", "--tolerance", "0.001"});
  EXPECT_EQ(same.exitCode, 0) << same.out << same.err;
  // Other smoke: the cache's hashes do not match.
  result = render({"scene.toml", "-o", "stale.exr", "--frames", "1", "-s",
                   "estimator.cache=light.####.vdb", "-s", "volume.0.density_scale=5"});
  EXPECT_EQ(result.exitCode, 4) << result.err;
  EXPECT_NE(result.err.find("--allow-stale"), std::string::npos) << result.err;
}

TEST_F(Render, PhotonMapInPasses) {
  const std::vector<std::string> map{"-s", "estimator.type=photon_map", "-s", "estimator.passes=2"};
  auto with = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.end(), map.begin(), map.end());
    return render(arguments);
  };
  const RunResult one =
      with({"scene.toml", "-o", "a.exr", "--frames", "1", "-j", "1", "--stats", "s.json"});
  ASSERT_EQ(one.exitCode, 0) << one.err;
  const json stats = json::parse(readText(m_folder / "s.json"));
  EXPECT_EQ(stats.at("photons").at("emitted"), 4000);
  EXPECT_GT(stats.at("photons").at("stored"), 0);
  EXPECT_GT(stats.at("light_memory_bytes"), 0);
  ASSERT_EQ(with({"scene.toml", "-o", "b.exr", "--frames", "1", "-j", "3"}).exitCode, 0);
  EXPECT_TRUE(samePixels("a.exr", "b.exr"));
  const RunResult plan = with({"scene.toml", "-o", "c.exr", "--frames", "1", "--dry-run"});
  EXPECT_NE(plan.out.find("photon map"), std::string::npos) << plan.out;
  const RunResult list = run("list", {"estimators"});
  EXPECT_NE(list.out.find("photon_map"), std::string::npos);
  EXPECT_EQ(list.out.find("photon_map: more than 1 = progressive (not served"), std::string::npos);
}

TEST_F(Render, GoesOnToATargetError) {
  RunResult result = render(
      {"scene.toml", "-o", "a.exr", "--frames", "1", "--target-error", "0.5", "--stats", "s.json"});
  ASSERT_EQ(result.exitCode, 0) << result.err;
  const json error = json::parse(readText(m_folder / "s.json")).at("error");
  EXPECT_GE(error.at("batches"), 8);
  EXPECT_LE(error.at("estimate"), 0.5);
  EXPECT_EQ(exr("a.exr").image.channel("error.R").size(), 16u * 12u);
  // Missed: the frame is there all the same.
  result = render({"scene.toml", "-o", "b.####.exr", "--frames", "1-2", "--target-error", "1e-6",
                   "--time-limit", "1e-6"});
  EXPECT_EQ(result.exitCode, 7) << result.err;
  EXPECT_TRUE(image::exrIsComplete(m_folder / "b.0002.exr"));
}

// Hours of work must not end in a folder that cannot be written.
TEST_F(Render, RefusesAnOutputThatCannotBeWrittenBeforeTheWork) {
  writeText(m_folder / "file", "");
  const RunResult result =
      runShell("timeout 20 " + std::string(PHOTOSPHERE_TOOL) +
                   " render scene.toml -o file/x.exr --frames 1 --res 4096x4096 "
                   "-s render.samples=10000",
               m_folder.path());
  EXPECT_EQ(result.exitCode, 6) << result.err;
}

struct Refusal {
  const char* name;
  std::vector<std::string> arguments;
  int exitCode;
  const char* message;
};
void PrintTo(const Refusal& r, std::ostream* out) {
  *out << r.name;
}

class Refusals : public Render, public ::testing::WithParamInterface<Refusal> {};

TEST_P(Refusals, SayWhyAndLeaveNothing) {
  writeText(m_folder / "typo.toml", "[camera]\nfof = 30\n[[volume]]\nfile = \"smoke.0001.vdb\"\n");
  writeText(m_folder / "empty.toml", "");
  fs::create_symlink("/dev/full", m_folder / "full.exr");
  fs::create_directory(m_folder / "folder.exr");
  const auto before = namesIn(m_folder.path());
  const RunResult result = runTool(GetParam().arguments, m_folder.path());
  EXPECT_EQ(result.exitCode, GetParam().exitCode) << result.err;
  EXPECT_NE(result.err.find(GetParam().message), std::string::npos)
      << "wanted: " << GetParam().message << "\ngot: " << result.err;
  EXPECT_EQ(namesIn(m_folder.path()), before);
}

const Refusal kRefusals[] = {
    {"SceneMissing", {"render", "none.toml", "-o", "x.exr"}, 3, "none.toml"},
    {"SceneEmpty",
     {"render", "empty.toml", "-o", "x.exr"},
     2,
     "empty.toml: there is no [[volume]]"},
    {"UnknownKey", {"render", "typo.toml", "-o", "x.exr"}, 2, "typo.toml:2"},
    {"UnknownSetKey", {"render", "scene.toml", "-o", "x.####.exr", "-s", "camera.fof=3"}, 2, "fof"},
    {"SetWithoutValue", {"render", "scene.toml", "-o", "x.####.exr", "-s", "camera"}, 2, "--set"},
    {"UnknownLayer",
     {"render", "scene.toml", "-o", "x.####.exr", "-s", "output.aovs=[\"nope\"]"},
     2,
     "--set output.aovs=[\"nope\"]: [output]: 'aovs' = 'nope'"},
    {"UnknownLayerOfAPlan",
     {"plan", "scene.toml", "--frames", "1", "-s", "output.aovs=[\"nope\"]"},
     2,
     "known: beauty, single"},
    {"NoOutput", {"render", "scene.toml"}, 2, "-o"},
    {"OutputIsPng", {"render", "scene.toml", "-o", "x.####.png"}, 2, "--preview"},
    {"OneOutputManyFrames", {"render", "scene.toml", "-o", "x.exr"}, 2, "x.####.exr"},
    {"Resolution", {"render", "scene.toml", "-o", "x.####.exr", "--res", "20"}, 2, "WxH"},
    {"ResolutionZero", {"render", "scene.toml", "-o", "x.####.exr", "--res", "0x9"}, 2, "resol"},
    {"Crop", {"render", "scene.toml", "-o", "x.####.exr", "--crop", "1,2,3"}, 2, "X0,Y0,X1,Y1"},
    {"CropEmpty", {"render", "scene.toml", "-o", "x.####.exr", "--crop", "5,5,5,9"}, 2, "empty"},
    {"Compression", {"render", "scene.toml", "-o", "x.####.exr", "--compression", "lzw"}, 2, "zip"},
    {"ShardForm", {"trace", "scene.toml", "-o", "x.####.vdb", "--shard", "2"}, 2, "i/n"},
    {"ShardBeyond", {"trace", "scene.toml", "-o", "x.####.vdb", "--shard", "3/2"}, 2, "--shard"},
    {"ShardZero", {"trace", "scene.toml", "-o", "x.####.vdb", "--shard", "0/2"}, 2, "--shard"},
    {"ResumeWhen", {"render", "scene.toml", "-o", "x.####.exr", "--resume", "yes"}, 2, "--resume"},
    {"MergeNothing", {"merge", "-o", "c.vdb"}, 2, "SHARD"},
    {"MergeIntoExr", {"merge", "a.vdb", "b.vdb", "-o", "c.exr"}, 2, "written as .vdb"},
    {"CacheMissing", {"render", "scene.toml", "-o", "x.exr", "--frames", "9"}, 3, "smoke.0009.vdb"},
    {"GridMissing",
     {"render", "scene.toml", "-o", "x.exr", "--frames", "1", "-s", "volume.0.density=smog"},
     4,
     "density"},
    {"MemoryLimit",
     {"render", "scene.toml", "-o", "x.exr", "--frames", "1", "-s", "render.memory_limit=1e-7"},
     5,
     "memory"},
    {"PhotonMapMemory",
     {"render", "scene.toml", "-o", "x.exr", "--frames", "1", "-s", "estimator.type=photon_map",
      "-s", "estimator.photons=1000000000000", "-s", "render.memory_limit=1"},
     5,
     "estimator.photons"},
    {"FullDevice", {"render", "scene.toml", "-o", "full.exr", "--frames", "1"}, 6, "full.exr"},
    {"TargetIsFolder", {"render", "scene.toml", "-o", "folder.exr", "--frames", "1"}, 6, "folder"},
    {"TraceIntoExr", {"trace", "scene.toml", "-o", "x.exr"}, 2, ".vdb"},
};
INSTANTIATE_TEST_SUITE_P(Table, Refusals, ::testing::ValuesIn(kRefusals),
                         [](const auto& test) { return std::string(test.param.name); });

}  // namespace
}  // namespace photosphere::test
