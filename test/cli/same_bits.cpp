// The same scene and seed give the same pixels: for any number of threads, by shards, through a
// light cache, and after an interruption.

#include <fmt/format.h>

#include <algorithm>
#include <random>

#include "fixture.h"

namespace photosphere::test {
namespace {

const std::string kScene =
    litSmoke(48, 36, kSanitized ? 3000 : 8000, R"(phase = { type = "henyey_greenstein", g = 0.5 })",
             "light_voxel = 1") +
    R"([[light]]
type = "sphere"
position = [-3, 1, 2]
radius = 0.5
intensity = 20
color = [1, 0.5, 0.2]
)";

class SameBits : public ::testing::Test {
 protected:
  void SetUp() override {
    writeSmokeFrames(m_folder, 3);
    writeText(m_folder / "scene.toml", kScene);
  }
  RunResult run(std::vector<std::string> arguments, const std::vector<std::string>& more = {}) {
    arguments.insert(arguments.end(), more.begin(), more.end());
    return runTool(arguments, m_folder.path());
  }
  void expectSamePixels(const std::string& a, const std::string& b) {
    EXPECT_EQ(differingChannel(m_folder / a, m_folder / b), "") << a << " and " << b;
  }
  /// The first frame, by the light of a cache.
  void render(const std::string& cache, const std::string& output) {
    const RunResult result = run({"render", "scene.toml", "-o", output, "--frames", "1", "--float",
                                  "-s", "estimator.cache=" + cache});
    ASSERT_EQ(result.exitCode, 0) << result.err;
  }
  /// x.exr was gone on with to its end and has the pixels of whole.exr.
  void expectWholeAfter(const RunResult& result) {
    ASSERT_EQ(result.exitCode, 0) << result.err;
    EXPECT_NE(result.err.find("goes on from"), std::string::npos) << result.err;
    expectSamePixels("whole.exr", "x.exr");
    EXPECT_FALSE(fs::exists(m_folder / "x.exr.checkpoint"));
  }
  TemporaryFolder m_folder;
};

struct Way {
  const char* name;
  std::vector<std::string> options;
  std::vector<std::string> more;  // of a run that takes long enough to be killed
};
void PrintTo(const Way& way, std::ostream* out) {
  *out << way.name;
}
const std::vector<std::string> kManyPhotons{"-s", "estimator.photons=2000000", "-s",
                                            "render.samples=200"};
const std::vector<std::string> kSomePhotons{"-s", "estimator.photons=600000", "-s",
                                            "render.samples=100"};
const Way kWays[] = {
    {"View", {}, kManyPhotons},
    {"Histogram", {"-s", "estimator.basis=histogram"}, kManyPhotons},
    {"Harmonics", {"-s", "estimator.basis=spherical_harmonics"}, kSomePhotons},
    {"Gathered",
     {"-s", "estimator.basis=histogram", "-s", "estimator.final_gather=4"},
     {"-s", "estimator.photons=1000000", "-s", "render.samples=60", "-s",
      "estimator.final_gather=120"}},
    {"Paper",
     {"-s", "estimator.preset=paper", "-s", "estimator.photons=3000"},
     {"-s", "estimator.photons=60000", "-s", "render.samples=48"}},
    {"Particles",
     {"-s", "estimator.carrier=particles", "-s", "estimator.photons=10000"},
     {"-s", "estimator.photons=600000", "-s", "render.samples=100"}},
    {"Emission",
     {"-s", "volume.0.emission.grid=density", "-s", "volume.0.emission.scale=5"},
     kSomePhotons},
    {"MotionBlur",
     {"-s", "volume.0.velocity=velocity", "-s", "effects.motion_blur=on", "-s",
      "camera.position=[{frame=0,value=[0.6,0.5,5]},{frame=2,value=[1.6,0.5,5]}]"},
     kSomePhotons},
    {"Steered", {"-s", "estimator.importance=on"}, kSomePhotons},
    {"PhotonMap",
     {"-s", "estimator.type=photon_map", "-s", "estimator.passes=2"},
     {"-s", "estimator.photons=200000", "-s", "estimator.passes=4", "-s", "render.samples=32"}},
    {"Paths",
     {"-s", "estimator.type=path_traced", "-s", "estimator.samples=20"},
     {"-s", "estimator.samples=900"}},
    {"LightPaths",
     {"-s", "estimator.type=light_traced", "-s", "estimator.samples=20"},
     {"-s", "estimator.samples=900"}},
    {"TargetError",
     {"--target-error", "0.3", "-s", "estimator.photons=8000"},
     {"-s", "estimator.photons=400000", "-s", "render.samples=200"}},
};

class SameBitsOf : public SameBits, public ::testing::WithParamInterface<Way> {
 protected:
  std::vector<std::string> command(const std::string& output) const {
    std::vector<std::string> all{"render", "scene.toml", "-o", output, "--frames", "1", "--float"};
    all.insert(all.end(), GetParam().options.begin(), GetParam().options.end());
    // Smoke as particles, which the paper's carriers are.
    if (onParticles()) all.insert(all.end(), {"-s", "volume.0.file=points.vdb"});
    return all;
  }
  bool onParticles() const {
    return GetParam().name == std::string("Paper") || GetParam().name == std::string("Particles");
  }
  void SetUp() override {
    SameBits::SetUp();
    if (GetParam().name == std::string("MotionBlur")) {
      std::vector<float> values;
      for (int corner = 0; corner < 8; ++corner)
        values.insert(values.end(), {9, 3, static_cast<float>(-corner)});
      Mat4d worldFromIndex(2);
      worldFromIndex[3][3] = 1;
      const volume::Grid wind =
          volume::denseVectorToGrid("velocity", Vec3i(2), values, worldFromIndex);
      volume::writeVdb(m_folder / "smoke.0001.vdb", {ballOfSmoke(0.1), wind});
    }
    if (!onParticles()) return;
    ASSERT_EQ(run({"convert", "smoke.0001.vdb", "-o", "points.vdb", "--particles", "500"}).exitCode,
              0);
  }
};

TEST_P(SameBitsOf, OneTwoAndSevenThreads) {
  for (const char* threads : {"1", "2", "7"}) {
    const RunResult result = run(command(std::string(threads) + ".exr"), {"-j", threads});
    ASSERT_EQ(result.exitCode, 0) << result.err;
  }
  expectSamePixels("1.exr", "2.exr");
  expectSamePixels("1.exr", "7.exr");
}

// Killed as soon as a checkpoint is there, again and again.
TEST_P(SameBitsOf, AfterKills) {
  ASSERT_EQ(run(command("whole.exr"), GetParam().more).exitCode, 0);
  std::string line = PHOTOSPHERE_TOOL;
  for (const auto& part : {command("x.exr"), GetParam().more})
    for (const std::string& argument : part)
      line += " '" + argument + "'";
  // Each run is left alone until it has kept more than the one before (names that begin with a dot
  // are still being written); the last one to its end.
  const RunResult result =
      runShell("kills=0; while [ $kills -lt 3 ]; do touch mark; " + line +
                   " --checkpoint-interval 0.1 & pid=$!; "
                   "while kill -0 $pid 2> /dev/null && "
                   "[ -z \"$(find x.exr.checkpoint -type f -newer mark ! -name '.*' 2> "
                   "/dev/null)\" ]; do sleep 0.01; "
                   "done; kill -9 $pid 2> /dev/null; wait $pid; [ $? -eq 0 ] && break; "
                   "kills=$((kills+1)); done; echo kills $kills; [ -e x.exr ] || " +
                   line,
               m_folder.path());
  expectWholeAfter(result);
  EXPECT_EQ(result.out.find("kills 0"), std::string::npos) << "too quick to be killed";
}

INSTANTIATE_TEST_SUITE_P(Estimators, SameBitsOf, ::testing::ValuesIn(kWays),
                         [](const auto& way) { return std::string(way.param.name); });

TEST_F(SameBits, ThroughALightCache) {
  using Sets = std::vector<std::string>;
  const Sets usual, opaque{"-s", "volume.0.density_scale=20000", "-s", "estimator.light_voxel=2"},
      particles{"-s", "volume.0.file=points.vdb", "-s", "estimator.carrier=particles"};
  ASSERT_EQ(run({"convert", "smoke.0002.vdb", "-o", "points.vdb", "--particles", "500"}).exitCode,
            0);
  for (const auto& [basis, smoke] : {std::pair<std::string, Sets>{"histogram", usual},
                                     {"spherical_harmonics", usual},
                                     {"histogram", opaque},
                                     {"spherical_harmonics", opaque},
                                     {"histogram", particles},
                                     {"spherical_harmonics", particles}}) {
    Sets set{"-s", "estimator.basis=" + basis};
    set.insert(set.end(), smoke.begin(), smoke.end());
    ASSERT_EQ(run({"trace", "scene.toml", "-o", "l.vdb", "--frames", "2"}, set).exitCode, 0);
    const RunResult whole =
        run({"render", "scene.toml", "-o", "a.exr", "--frames", "2", "--float"}, set);
    ASSERT_EQ(whole.exitCode, 0) << whole.err;
    EXPECT_EQ(whole.err.find("from all round") != std::string::npos, smoke == opaque) << whole.err;
    ASSERT_EQ(run({"render", "scene.toml", "-o", "b.exr", "--frames", "2", "--float", "-s",
                   "estimator.cache=l.vdb"},
                  smoke)
                  .exitCode,
              0);
    expectSamePixels("a.exr", "b.exr");
  }
}

class Shards : public SameBits {
 protected:
  // @return the files, in order
  std::vector<std::string> trace(int count, const std::vector<std::string>& more = {}) {
    std::vector<std::string> files;
    for (int i = 1; i <= count; ++i) {
      const std::string number = std::to_string(i) + "/" + std::to_string(count);
      files.push_back(fmt::format("s{}of{}.vdb", i, count));
      const RunResult result = run(
          {"trace", "scene.toml", "-o", files.back(), "--frames", "1", "--shard", number}, more);
      EXPECT_EQ(result.exitCode, 0) << result.err;
    }
    return files;
  }
  RunResult merge(std::vector<std::string> files, const std::string& output = "merged.vdb") {
    files.insert(files.begin(), "merge");
    return run(files, {"-o", output});
  }
};

TEST_F(Shards, MergeInAnyOrderToTheBitsOfOneTrace) {
  struct Layout {
    const char* smoke;
    std::vector<std::string> options;
  };
  ASSERT_EQ(run({"convert", "smoke.0001.vdb", "-o", "points.vdb", "--particles", "300"}).exitCode,
            0);
  for (const Layout& layout :
       {Layout{"smoke.####.vdb", {}},
        Layout{"smoke.####.vdb", {"-s", "estimator.basis=spherical_harmonics"}},
        Layout{"smoke.####.vdb", {"-s", "estimator.smoothing=visible"}},
        Layout{"points.vdb", {"-s", "estimator.carrier=particles"}},
        Layout{"points.vdb",
               {"-s", "estimator.carrier=particles", "-s", "estimator.smoothing=visible"}},
        Layout{"points.vdb",
               {"-s", "estimator.carrier=particles", "-s", "estimator.deposit=collision", "-s",
                "estimator.representative=mean"}}}) {
    std::string text = kScene;
    text.replace(text.find("smoke.####.vdb"), 14, layout.smoke);
    writeText(m_folder / "scene.toml", text);
    ASSERT_EQ(
        run({"trace", "scene.toml", "-o", "one.vdb", "--frames", "1"}, layout.options).exitCode, 0);
    render("one.vdb", "one.exr");
    // The number matters to no layout of a carrier more than to its first.
    const std::vector<int> counts = layout.options.empty() ? std::vector{1, 3, 16}
                                    : layout.smoke == std::string("points.vdb") ? std::vector{4}
                                                                                : std::vector{3};
    for (const int count : counts) {
      std::vector<std::string> files = trace(count, layout.options);
      std::mt19937 order(static_cast<unsigned>(count));
      for (int i = 0; i < std::min(count, 3); ++i) {
        const RunResult result = merge(files);
        ASSERT_EQ(result.exitCode, 0) << result.err;
        render("merged.vdb", "merged.exr");
        expectSamePixels("one.exr", "merged.exr");
        std::shuffle(files.begin(), files.end(), order);
      }
    }
  }
}

TEST_F(Shards, SumsCountsAndPowers) {
  const auto files = trace(3);
  ASSERT_EQ(run({"trace", "scene.toml", "-o", "one.vdb", "--frames", "1", "--stats", "one.json"})
                .exitCode,
            0);
  std::vector<std::string> arguments{"merge", "-o", "merged.vdb", "--stats", "merged.json"};
  arguments.insert(arguments.end(), files.begin(), files.end());
  const RunResult result = run(arguments);
  ASSERT_EQ(result.exitCode, 0) << result.err;
  const std::string one = readText(m_folder / "one.json"), all = readText(m_folder / "merged.json");
  const auto number = [](const std::string& text, const std::string& key) {
    const std::size_t at = text.find('"' + key + '"');
    return at == std::string::npos ? -1.0
                                   : std::stod(text.substr(text.find_first_of("0123456789", at)));
  };
  for (const char* key : {"emitted", "scattered", "stored"})
    EXPECT_EQ(number(one, key), number(all, key)) << key;
  EXPECT_NEAR(number(one.substr(one.find("energy_watts")), "emitted"),
              number(all.substr(all.find("energy_watts")), "emitted"), 1e-9);
}

// However frames are to be judged, light that is kept is of all photons.
TEST_F(Shards, HaveAllPhotonsWhateverFramesAreJudgedBy) {
  for (const char* judged : {"render.target_error=0.1", "render.time_limit=100"}) {
    ASSERT_EQ(run({"trace", "scene.toml", "-o", "l.vdb", "--frames", "1", "--stats", "s.json", "-s",
                   "estimator.photons=7000", "-s", judged})
                  .exitCode,
              0);
    EXPECT_NE(readText(m_folder / "s.json").find("\"emitted\": 7000"), std::string::npos) << judged;
  }
}

TEST_F(Shards, MissingTwiceOrForeignOnesAreRefused) {
  const auto files = trace(3);
  RunResult result = merge({files[0], files[2]});
  EXPECT_EQ(result.exitCode, 4);
  EXPECT_NE(result.err.find("2/3"), std::string::npos) << result.err;
  result = merge({files[0], files[1], files[2], files[1]});
  EXPECT_EQ(result.exitCode, 4);
  EXPECT_NE(result.err.find("second time"), std::string::npos) << result.err;
  for (const char* change : {"scene.seed=5", "volume.0.density_scale=3", "light.0.intensity=51",
                             "estimator.photons=8001", "estimator.rows=3"}) {
    const auto [first, second] = std::pair{files[0], files[2]};
    ASSERT_EQ(run({"trace", "scene.toml", "-o", "foreign.vdb", "--frames", "1", "--shard", "2/3",
                   "-s", change})
                  .exitCode,
              0)
        << change;
    result = merge({first, "foreign.vdb", second});
    EXPECT_EQ(result.exitCode, 4) << change;
    EXPECT_NE(result.err.find("foreign.vdb: is a shard of another trace"), std::string::npos)
        << change << ": " << result.err;
  }
  EXPECT_FALSE(fs::exists(m_folder / "merged.vdb"));
  EXPECT_EQ(merge({"smoke.0001.vdb"}).exitCode, 4);
  EXPECT_EQ(merge({"nothing.vdb"}).exitCode, 3);
  // A shard is not yet a light cache, nor a light cache a shard.
  result = run({"render", "scene.toml", "-o", "x.exr", "--frames", "1", "-s",
                "estimator.cache=" + files[0]});
  EXPECT_EQ(result.exitCode, 4);
  EXPECT_NE(result.err.find("photosphere merge"), std::string::npos) << result.err;
  ASSERT_EQ(run({"trace", "scene.toml", "-o", "whole.vdb", "--frames", "1"}).exitCode, 0);
  EXPECT_EQ(merge({"whole.vdb"}).exitCode, 4);
}

TEST_F(Shards, SequencesMergeFrameByFrame) {
  for (const char* i : {"1", "2"})
    ASSERT_EQ(run({"trace", "scene.toml", "-o", std::string("s") + i + ".####.vdb", "--frames",
                   "1-3", "--shard", std::string(i) + "/2"})
                  .exitCode,
              0);
  ASSERT_EQ(run({"merge", "s2.####.vdb", "s1.####.vdb", "-o", "l.####.vdb"}).exitCode, 0);
  const RunResult result = run({"render", "scene.toml", "-o", "x.####.exr", "--frames", "1-3", "-s",
                                "estimator.cache=l.####.vdb"});
  EXPECT_EQ(result.exitCode, 0) << result.err;
  EXPECT_TRUE(fs::exists(m_folder / "x.0003.exr"));
  EXPECT_EQ(run({"merge", "s2.####.vdb", "s1.####.vdb", "-o", "one.vdb"}).exitCode, 2);
}

TEST_F(Shards, OfATraceThatWasKilled) {
  const std::string line = std::string(PHOTOSPHERE_TOOL) +
                           " trace scene.toml -o x.vdb --frames 1 --shard 1/2 -s "
                           "estimator.photons=3000000";
  const RunResult whole = runShell(
      std::string(PHOTOSPHERE_TOOL) +
          " trace scene.toml -o a.vdb --frames 1 --shard 1/2 -s estimator.photons=3000000 && " +
          std::string(PHOTOSPHERE_TOOL) +
          " trace scene.toml -o b.vdb --frames 1 --shard 2/2 -s estimator.photons=3000000",
      m_folder.path());
  ASSERT_EQ(whole.exitCode, 0) << whole.err;
  const RunResult killed = runShell(
      line +
          " --checkpoint-interval 0.1 & pid=$!; while kill -0 $pid 2> /dev/null && "
          "[ ! -e x.vdb.checkpoint/light ]; do sleep 0.01; done; kill -9 $pid; wait $pid; " +
          line + " --resume require",
      m_folder.path());
  ASSERT_EQ(killed.exitCode, 0) << killed.err;
  EXPECT_NE(killed.err.find("goes on from"), std::string::npos) << killed.err;
  ASSERT_EQ(merge({"a.vdb", "b.vdb"}, "ab.vdb").exitCode, 0);
  ASSERT_EQ(merge({"b.vdb", "x.vdb"}, "xb.vdb").exitCode, 0);
  render("ab.vdb", "ab.exr");
  render("xb.vdb", "xb.exr");
  expectSamePixels("ab.exr", "xb.exr");
}

// From here on: what a signal does.

class Interrupted : public SameBits {
 protected:
  // Runs until the file appears, then sends the signal.
  RunResult signalAt(const std::string& arguments, const std::string& file,
                     const std::string& signal = "TERM") {
    return runShell(std::string(PHOTOSPHERE_TOOL) + " " + arguments +
                        " & pid=$!; while kill -0 $pid 2> /dev/null && [ ! -e " + file +
                        " ]; do sleep 0.01; done; kill -s " + signal + " $pid; wait $pid",
                    m_folder.path());
  }
};

TEST_F(Interrupted, EndsWith75AndGoesOn) {
  const std::string paths =
      "render scene.toml -o x.exr --frames 1 --float -s estimator.type=path_traced -s "
      "estimator.samples=1200";
  const RunResult stopped =
      signalAt(paths + " --checkpoint-interval 0.1", "x.exr.checkpoint/frame");
  ASSERT_EQ(stopped.exitCode, 75) << stopped.err;
  EXPECT_NE(stopped.err.find("x.exr.checkpoint"), std::string::npos) << stopped.err;
  EXPECT_FALSE(fs::exists(m_folder / "x.exr"));
  EXPECT_EQ(namesIn(m_folder / "x.exr.checkpoint"), (std::set<std::string>{"frame"}));
  // Other work does not go on from it, and says so.
  RunResult result = runShell(
      std::string(PHOTOSPHERE_TOOL) + " " + paths + " --seed 4 --resume require", m_folder.path());
  EXPECT_EQ(result.exitCode, 4);
  EXPECT_NE(result.err.find("other work"), std::string::npos) << result.err;
  result =
      runShell(std::string(PHOTOSPHERE_TOOL) + " " + paths + " --resume require", m_folder.path());
  ASSERT_EQ(result.exitCode, 0) << result.err;
  EXPECT_NE(result.err.find("goes on from"), std::string::npos) << result.err;
  EXPECT_FALSE(fs::exists(m_folder / "x.exr.checkpoint"));
  ASSERT_EQ(run({"render", "scene.toml", "-o", "whole.exr", "--frames", "1", "--float", "-s",
                 "estimator.type=path_traced", "-s", "estimator.samples=1200"})
                .exitCode,
            0);
  expectSamePixels("whole.exr", "x.exr");
  result =
      runShell(std::string(PHOTOSPHERE_TOOL) + " " + paths + " --resume require", m_folder.path());
  EXPECT_EQ(result.exitCode, 3);
  EXPECT_NE(result.err.find("no checkpoint"), std::string::npos) << result.err;
}

// What a trace was stopped at is gone on with to the light, and the pixels, of an undisturbed one.
TEST_F(Interrupted, ATraceEndsWith75AndGoesOn) {
  const std::string trace = "trace scene.toml --frames 1 -s estimator.photons=" +
                            std::to_string(kSanitized ? 600000 : 3000000);
  const RunResult stopped =
      signalAt(trace + " -o x.vdb --checkpoint-interval 0.1", "x.vdb.checkpoint/light");
  ASSERT_EQ(stopped.exitCode, 75) << stopped.err;
  EXPECT_NE(stopped.err.find("x.vdb.checkpoint"), std::string::npos) << stopped.err;
  EXPECT_FALSE(fs::exists(m_folder / "x.vdb"));
  const RunResult rest = runShell(
      std::string(PHOTOSPHERE_TOOL) + " " + trace + " -o x.vdb --resume require", m_folder.path());
  ASSERT_EQ(rest.exitCode, 0) << rest.err;
  EXPECT_NE(rest.err.find("goes on from"), std::string::npos) << rest.err;
  EXPECT_FALSE(fs::exists(m_folder / "x.vdb.checkpoint"));
  const RunResult whole =
      runShell(std::string(PHOTOSPHERE_TOOL) + " " + trace + " -o whole.vdb", m_folder.path());
  ASSERT_EQ(whole.exitCode, 0) << whole.err;
  render("x.vdb", "x.exr");
  render("whole.vdb", "whole.exr");
  expectSamePixels("whole.exr", "x.exr");
}

// A checkpoint between two frames says which are done.
TEST_F(Interrupted, FinishedFramesAreNotMadeAgain) {
  const std::string job =
      "render scene.toml -o x.####.exr --stats s.json --float --frames 1-3 -s "
      "estimator.type=path_traced -s estimator.samples=400";
  const RunResult stopped = signalAt(job, "x.0001.exr");
  ASSERT_EQ(stopped.exitCode, 75) << stopped.err;
  const auto written = fs::last_write_time(m_folder / "x.0001.exr");
  const RunResult result = runShell(std::string(PHOTOSPHERE_TOOL) + " " + job, m_folder.path());
  ASSERT_EQ(result.exitCode, 0) << result.err;
  EXPECT_NE(result.out.find("x.0001.exr was finished before the interruption"), std::string::npos)
      << result.out;
  EXPECT_EQ(fs::last_write_time(m_folder / "x.0001.exr"), written);
  for (const std::string& name : namesIn(m_folder.path()))
    EXPECT_EQ(name.find("checkpoint"), std::string::npos) << name;
  const std::string stats = readText(m_folder / "s.json");
  for (const char* frame : {"\"frame\": 1,", "\"frame\": 2,", "\"frame\": 3,"})
    EXPECT_NE(stats.find(frame), std::string::npos) << stats;
  // Another job makes all its frames.
  const RunResult other =
      runShell(std::string(PHOTOSPHERE_TOOL) + " " + job + " --resume never", m_folder.path());
  EXPECT_EQ(other.exitCode, 0) << other.err;
  EXPECT_NE(fs::last_write_time(m_folder / "x.0001.exr"), written);
}

// Nor those that would no longer be the same.
TEST_F(Interrupted, FinishedFramesOfWhatHasChangedAreMadeAgain) {
  const std::string job =
      "render scene.toml -o x.####.exr --float --frames 1-3 -s estimator.type=path_traced -s "
      "estimator.samples=400";
  const auto madeAgain = [&](const std::string& more) {
    const RunResult result =
        runShell(std::string(PHOTOSPHERE_TOOL) + " " + job + more, m_folder.path());
    EXPECT_EQ(result.exitCode, 0) << result.err;
    return result.out.find("x.0001.exr was finished before") == std::string::npos;
  };
  for (const char* more :
       {" -s 'output.aovs=[\"beauty\",\"single\"]'", " --preview p.####.png", " --stats s.json"}) {
    fs::remove(m_folder / "x.0001.exr");
    ASSERT_EQ(signalAt(job, "x.0001.exr").exitCode, 75);
    EXPECT_TRUE(madeAgain(more)) << more;
  }
  fs::remove(m_folder / "x.0001.exr");
  ASSERT_EQ(signalAt(job, "x.0001.exr").exitCode, 75);
  volume::writeVdb(m_folder / "smoke.0001.vdb", {ballOfSmoke(0.2)});
  EXPECT_TRUE(madeAgain("")) << "other smoke";
}

// Nor those that another command has written over, or whose preview is gone.
TEST_F(Interrupted, FinishedFramesThatAreNoLongerThereAreMadeAgain) {
  const std::string other =
      "render scene.toml -o x.0001.exr --float --frames 1 -s estimator.type=path_traced -s "
      "estimator.samples=4";
  const std::string job =
      "render scene.toml -o x.####.exr --float --preview p.####.png --frames 1-2 -s "
      "estimator.type=path_traced -s estimator.samples=400";
  const auto line = [&](const std::string& arguments) {
    return runShell(std::string(PHOTOSPHERE_TOOL) + " " + arguments, m_folder.path());
  };
  ASSERT_EQ(signalAt(job, "p.0001.png").exitCode, 75);
  ASSERT_EQ(line(other).exitCode, 0);
  RunResult result = line(job);
  EXPECT_EQ(result.exitCode, 0) << result.err;
  EXPECT_EQ(result.out.find("x.0001.exr was finished before"), std::string::npos) << result.out;
  EXPECT_NE(result.err.find("frame 1: a file that it had left has changed"), std::string::npos)
      << result.err;
  for (const char* name : {"x.0001.exr", "p.0001.png"})
    fs::remove(m_folder / name);
  ASSERT_EQ(signalAt(job, "p.0001.png").exitCode, 75);
  fs::remove(m_folder / "p.0001.png");
  result = line(job);
  EXPECT_EQ(result.exitCode, 0) << result.err;
  EXPECT_TRUE(fs::exists(m_folder / "p.0001.png"));
}

// A folder of that name is none of ours for its name.
TEST_F(Interrupted, OthersFilesAreNoCheckpoint) {
  fs::create_directory(m_folder / "x.exr.checkpoint");
  writeText(m_folder / "x.exr.checkpoint" / "notes.txt", "mine");
  EXPECT_EQ(
      run({"render", "scene.toml", "-o", "x.exr", "--frames", "1", "--resume", "require"}).exitCode,
      3);
  EXPECT_EQ(readText(m_folder / "x.exr.checkpoint" / "notes.txt"), "mine");
}

TEST_F(Interrupted, FiguresThatWereDamagedMeanwhileAreMissed) {
  const std::string job =
      "render scene.toml -o x.####.exr --stats s.json --float --frames 1-2 -s "
      "estimator.type=path_traced -s estimator.samples=400";
  ASSERT_EQ(signalAt(job, "x.0001.exr").exitCode, 75);
  writeText(m_folder / "s.json", "[{\"frame\": 1,");
  const RunResult rest = runShell(std::string(PHOTOSPHERE_TOOL) + " " + job, m_folder.path());
  EXPECT_EQ(rest.exitCode, 0) << rest.err;
  EXPECT_NE(rest.err.find("s.json: is damaged"), std::string::npos) << rest.err;
  EXPECT_NE(readText(m_folder / "s.json").find("\"frame\": 2,"), std::string::npos);
}

// What a frame missed before the interruption still decides the exit code: the one that is left has
// no smoke, and so nothing to miss.
TEST_F(Interrupted, AMissedTargetIsNotForgotten) {
  const std::string job =
      "render scene.toml -o x.####.exr --target-error 1e-6 --time-limit 2 -s "
      "estimator.type=path_traced -s estimator.samples=80 --frames ";
  const RunResult stopped = signalAt(job + "1-2", "x.0001.exr");
  ASSERT_EQ(stopped.exitCode, 75) << stopped.err;
  volume::writeVdb(m_folder / "smoke.0002.vdb",
                   {volume::denseToGrid("density", Vec3i(1), {0.0f}, Mat4d(1.0))});
  const RunResult rest =
      runShell(std::string(PHOTOSPHERE_TOOL) + " " + job + "1-2", m_folder.path());
  EXPECT_EQ(rest.exitCode, 7) << rest.err;
  EXPECT_NE(rest.out.find("x.0001.exr was finished before"), std::string::npos) << rest.out;
  const RunResult alone =
      runShell(std::string(PHOTOSPHERE_TOOL) + " " + job + "2 --resume never", m_folder.path());
  EXPECT_EQ(alone.exitCode, 0) << alone.err;
}

// Wherever the signal falls: in a part, in the paths that it is judged by, in wider kernels.
TEST_F(Interrupted, AnywhereInAFrameThatIsJudged) {
  const std::string paths = "-s estimator.photons=40000 -s render.samples=100";
  const std::string job = std::string(PHOTOSPHERE_TOOL) +
                          " render scene.toml --frames 1 --float --target-error 0.1 " + paths;
  ASSERT_EQ(runShell(job + " -o whole.exr", m_folder.path()).exitCode, 0);
  // Longer and longer, as it is not known when the work begins on this machine.
  const RunResult result = runShell(
      "for t in 0.2 0.3 0.45 0.7 1 1.5 2.2 3.3 5 7.5 11 17 26; do timeout --preserve-status -s "
      "TERM $t " +
          job + " -o x.exr; echo code $?; [ -e x.exr ] && break; done; [ -e x.exr ] || " + job +
          " -o x.exr",
      m_folder.path());
  expectWholeAfter(result);
  EXPECT_NE(result.out.find("code 75"), std::string::npos) << "too quick to be stopped";
}

TEST_F(Interrupted, EverySignalLeavesAtMostACheckpoint) {
  const auto before = namesIn(m_folder.path());
  for (const char* signal : {"INT", "TERM", "USR1"}) {
    const RunResult result = signalAt(
        "trace scene.toml -o x.vdb --frames 1 -s estimator.photons=100000000 "
        "--checkpoint-interval 0.1",
        "x.vdb.checkpoint/light", signal);
    EXPECT_EQ(result.exitCode, 75) << result.err;
    std::error_code ignored;
    EXPECT_TRUE(fs::remove_all(m_folder / "x.vdb.checkpoint", ignored));
    EXPECT_EQ(namesIn(m_folder.path()), before) << result.err;
  }
}

// Both arrive while the program is halted: the second ends it there and then.
TEST_F(Interrupted, ASecondSignalEndsAtOnceAndLeavesNoTemporaries) {
  for (const char* work : {"trace scene.toml -o x.vdb -s estimator.photons=100000000",
                           "render scene.toml -o x.exr -s estimator.type=path_traced -s "
                           "estimator.samples=1000000"}) {
    const RunResult result = runShell(
        std::string(PHOTOSPHERE_TOOL) + " " + work +
            " --frames 1 --checkpoint-interval 0.1 & pid=$!; while kill -0 $pid 2> /dev/null && "
            "[ -z \"$(ls x.*.checkpoint/[fl]* 2> /dev/null)\" ]; do sleep 0.01; done; "
            "kill -s STOP $pid; kill -s TERM $pid; kill -s INT $pid; kill -s CONT $pid; wait $pid",
        m_folder.path());
    EXPECT_TRUE(result.exitCode == 128 + 15 || result.exitCode == 128 + 2)
        << work << ": " << result.exitCode << '\n'
        << result.err;
    for (const std::string& name : namesIn(m_folder.path())) {
      if (!name.starts_with("x.")) continue;
      EXPECT_TRUE(name.ends_with(".checkpoint")) << name;
      for (const std::string& part : namesIn(m_folder / name))
        EXPECT_TRUE(part == "light" || part == "frame" || part == "note") << part;
      fs::remove_all(m_folder / name);
    }
  }
}

}  // namespace
}  // namespace photosphere::test
