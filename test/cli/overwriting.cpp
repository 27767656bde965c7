// No output is written over an input, nor over another output: exit 2 before the work.

#include <map>

#include "fixture.h"

namespace photosphere::test {
namespace {

struct Overwrite {
  const char* name;
  std::vector<std::string> arguments;
  std::vector<std::string> named;  ///< what standard error must say of both
};
void PrintTo(const Overwrite& o, std::ostream* out) {
  *out << o.name;
}

class Overwriting : public ::testing::Test {
 protected:
  void SetUp() override {
    writeSmokeFrames(m_folder, 3);
    writeText(m_folder / "scene.toml", litSmoke(8, 6, 500) + "[render]\nsamples = 1\n");
    image::Image sky(4, 2);
    sky.addLayer("", image::ChannelKind::color);
    image::writeExr(m_folder / "sky.exr", sky);
    writeText(m_folder / "sky.toml",
              "[[volume]]\nfile = \"smoke.0001.vdb\"\n"
              "[[light]]\ntype = \"environment\"\nfile = \"sky.exr\"\n");
    writeText(m_folder / "shot.chan", "1 0 0 5 0 0 0 30\n");
    fs::create_symlink("smoke.0002.vdb", m_folder / "link.vdb");
    fs::create_directory(m_folder / "sub");
    fs::create_directory_symlink(".", m_folder / "here");
  }
  std::map<std::string, std::string> contents() {
    std::map<std::string, std::string> all;
    for (const std::string& name : namesIn(m_folder.path()))
      if (fs::is_regular_file(m_folder / name)) all[name] = readText(m_folder / name);
    return all;
  }

  TemporaryFolder m_folder;
};

class Overwrites : public Overwriting, public ::testing::WithParamInterface<Overwrite> {};

TEST_P(Overwrites, AreRefused) {
  const auto before = contents();
  const RunResult result = runTool(GetParam().arguments, m_folder.path());
  EXPECT_EQ(result.exitCode, 2) << result.out << result.err;
  for (const std::string& name : GetParam().named)
    EXPECT_NE(result.err.find(name), std::string::npos)
        << "wanted: " << name << "\ngot: " << result.err;
  EXPECT_EQ(contents(), before);
}

const Overwrite kOverwrites[] = {
    {"PictureByStatistics",
     {"render", "scene.toml", "-o", "x.exr", "--frames", "1", "--stats", "sub/../x.exr"},
     {"--stats sub/../x.exr", "-o", "another name"}},
    {"PictureByStatisticsOfAFrame",
     {"render", "scene.toml", "-o", "x.####.exr", "--stats", "x.0002.exr"},
     {"--stats x.0002.exr", "-o"}},
    {"PreviewByStatistics",
     {"render", "scene.toml", "-o", "x.####.exr", "--preview", "p.%d.png", "--stats", "p.3.png"},
     {"--stats p.3.png", "the preview"}},
    {"PictureOfTheScene",
     {"render", "scene.toml", "-s", "output.file=x.exr", "--frames", "1", "--stats", "x.exr"},
     {"--stats x.exr", "output.file"}},
    {"Scene",
     {"render", "scene.toml", "-o", "x.####.exr", "--stats", "scene.toml"},
     {"--stats scene.toml", "the scene"}},
    {"DryRun",
     {"render", "scene.toml", "-o", "x.####.exr", "--stats", "scene.toml", "--dry-run"},
     {"--stats scene.toml", "the scene"}},
    {"Volume",
     {"trace", "scene.toml", "-o", "here/smoke.####.vdb"},
     {"-o here/smoke.0001.vdb", "volume.0.file"}},
    {"VolumeOfItsFrame",
     {"trace", "scene.toml", "-o", "smoke.0002.vdb", "--frames", "1", "--cache-offset", "1"},
     {"-o smoke.0002.vdb", "volume.0.file"}},
    {"VolumeBehindALink",
     {"trace", "scene.toml", "-o", "link.vdb", "--frames", "2"},
     {"-o link.vdb", "volume.0.file", "smoke.0002.vdb"}},
    {"BareCache",
     {"trace", "smoke.0001.vdb", "-o", "smoke.0001.vdb"},
     {"-o smoke.0001.vdb", "volume.0.file"}},
    {"Environment", {"render", "sky.toml", "-o", "sky.exr"}, {"-o sky.exr", "light.0.file"}},
    {"Camera",
     {"render", "sky.toml", "-s", "camera.file=shot.chan", "-o", "x.exr", "--stats", "shot.chan"},
     {"--stats shot.chan", "camera.file"}},
    {"LightCache",
     {"render", "scene.toml", "-s", "estimator.cache=l.####.vdb", "-o", "x.####.exr", "--stats",
      "l.0002.vdb"},
     {"--stats l.0002.vdb", "estimator.cache"}},
    {"Shard",
     {"merge", "smoke.0001.vdb", "smoke.0002.vdb", "-o", "smoke.0001.vdb"},
     {"-o smoke.0001.vdb", "SHARD"}},
    {"MergedByStatistics",
     {"merge", "smoke.0001.vdb", "-o", "x.vdb", "--stats", "x.vdb"},
     {"--stats x.vdb", "-o"}},
    {"Converted", {"convert", "smoke.0001.vdb", "-o", "./smoke.0001.vdb"}, {"IN", "-o ./smoke"}},
    {"ConvertedSequence",
     {"convert", "smoke.####.vdb", "-o", "smoke.%04d.vdb", "--frames", "2-3"},
     {"IN", "-o smoke.0002.vdb"}},
    {"Compared",
     {"compare", "sky.exr", "sky.exr", "--error-map", "sky.exr"},
     {"--error-map sky.exr", "IMAGE"}},
};
INSTANTIATE_TEST_SUITE_P(Table, Overwrites, ::testing::ValuesIn(kOverwrites),
                         [](const auto& test) { return std::string(test.param.name); });

// A device has nothing to lose, and files of other frames are not this job's.
TEST_F(Overwriting, IsNotSeenWhereThereIsNone) {
  const RunResult result = runTool({"render", "scene.toml", "-o", "x.exr", "--frames", "1",
                                    "--preview", "x.png", "--stats", "/dev/null"},
                                   m_folder.path());
  EXPECT_EQ(result.exitCode, 0) << result.err;
  const RunResult again =
      runTool({"convert", "smoke.0001.vdb", "-o", "smoke.0003.vdb"}, m_folder.path());
  EXPECT_EQ(again.exitCode, 0) << again.err;
}

}  // namespace
}  // namespace photosphere::test
