// Every way to go wrong has its exit code, says what and where, and leaves nothing behind.

#include "fixture.h"

namespace photosphere::test {
namespace {

struct Case {
  const char* name;
  std::vector<std::string> arguments;  ///< relative to the folder of files
  int exitCode;
  const char* message;  ///< part of what standard error must say
};

void PrintTo(const Case& c, std::ostream* out) {
  *out << c.name;
}

class ExitCodes : public ::testing::TestWithParam<Case> {
 protected:
  static void SetUpTestSuite() {
    s_folder = std::make_unique<TemporaryFolder>();
    const TemporaryFolder& f = *s_folder;
    volume::writeVdb(f / "smoke.vdb", {ballOfSmoke(0.1)});
    volume::writeVdb(f / "cut.vdb", {ballOfSmoke(0.1)});
    truncate(f / "cut.vdb");
    writePly(f / "points.ply", ribbon(50, true));
    writeText(f / "empty.ply", "");
    writeText(f / "specks.csv", "x,y,z,pscale\n0,0,0,1e-30\n0.1,0,0,1e-30\n");
    writeText(f / "giant.csv", "x,y,z,pscale\n0,0,0,0.1\n0.1,0,0,0.1\n0,0,0,1e30\n");
    writeText(f / "heavy.csv", "x,y,z,pscale,mass\n0,0,0,0.1,1e38\n0.1,0,0,0.1,1e38\n");
    volume::writeVdb(f / "fast.vdb",
                     {volume::denseVectorToGrid("v", Vec3i(1), {1e6f, 0, 0}, Mat4d(1.0))});
    writeText(f / "scene.abc", "Ogawa and so on");
    for (int i = 1; i <= 2; ++i)
      volume::writeVdb(f / ("seq.000" + std::to_string(i) + ".vdb"), {ballOfSmoke(0.1 * i)});
    image::Image grey(4, 4);
    grey.addLayer("", image::ChannelKind::color);
    for (int i = 0; i < 16; ++i)
      grey.setRgb("", i % 4, i / 4, Rgb(1.0f));
    image::writeExr(f / "a.exr", grey);
    grey.setRgb("", 2, 1, Rgb(1.5f));
    image::writeExr(f / "b.exr", grey);
    image::writeExr(f / "cut.exr", grey);
    truncate(f / "cut.exr");
    image::Image small(2, 2);
    small.addLayer("", image::ChannelKind::color);
    image::writeExr(f / "small.exr", small);
    fs::create_directory(f / "folder.vdb");
    fs::create_symlink("/dev/full", f / "full.vdb");
    fs::create_symlink("/dev/full", f / "full.ply");
    fs::create_symlink("/dev/zero", f / "endless.toml");
  }
  static void TearDownTestSuite() { s_folder.reset(); }

  static std::unique_ptr<TemporaryFolder> s_folder;
};

std::unique_ptr<TemporaryFolder> ExitCodes::s_folder;

TEST_P(ExitCodes, AreAsPromised) {
  const Case& c = GetParam();
  const auto before = namesIn(s_folder->path());
  const RunResult result = runTool(c.arguments, s_folder->path());
  EXPECT_EQ(result.exitCode, c.exitCode) << result.out << result.err;
  EXPECT_NE(result.err.find(c.message), std::string::npos)
      << "wanted: " << c.message << "\ngot: " << result.err;
  if (c.exitCode != 0) {
    EXPECT_NE(result.err.find("photosphere: error: "), std::string::npos) << result.err;
    EXPECT_EQ(namesIn(s_folder->path()), before);
  }
}

const Case kUsage[] = {
    {"NoCommand", {}, 2, "subcommand"},
    {"UnknownCommand", {"transmogrify"}, 2, "transmogrify"},
    {"UnknownOption", {"convert", "smoke.vdb", "-o", "x.vdb", "--bogus"}, 2, "--bogus"},
    {"MissingOutput", {"convert", "smoke.vdb"}, 2, "--output"},
    {"MissingInput", {"convert", "-o", "x.vdb"}, 2, "IN"},
    {"OutputExtension", {"convert", "smoke.vdb", "-o", "x.tiff"}, 2, ".vdb"},
    {"ThreadsNotANumber", {"list", "-j", "many"}, 2, "--threads"},
    {"ThreadsNegative", {"list", "-j", "-3"}, 2, "--threads"},
    {"SeedNotANumber",
     {"render", "smoke.vdb", "-o", "x.exr", "--seed", "lucky"},
     2,
     "must be a whole number from -2^63 to 2^63 - 1, not 'lucky'"},
    {"SeedPast64Bits",
     {"render", "smoke.vdb", "-o", "x.exr", "--seed", "18446744073709551616"},
     2,
     "--seed: must be a whole number from -2^63 to 2^63 - 1, not '18446744073709551616'"},
    {"FramesPastABillion",
     {"render", "smoke.vdb", "-o", "x.exr", "--frames", "2147483648"},
     2,
     "frames up to a billion"},
    {"FramesWithoutValue",
     {"render", "smoke.vdb", "-o", "x.exr", "--frames=", "--dry-run"},
     2,
     "--frames= has no value after its =; is a variable of the shell not set?"},
    {"CacheOffsetPastABillion",
     {"render", "smoke.vdb", "-o", "x.exr", "--cache-offset", "9223372036854775807"},
     2,
     "--cache-offset: must be a whole number from minus to plus a billion"},
    {"SceneWithoutEnd",
     {"render", "endless.toml", "-o", "x.exr"},
     2,
     "endless.toml: is longer than"},
    {"VerboseAndQuiet", {"list", "-v", "-q"}, 2, "--quiet"},
    {"ProgressStyle", {"list", "--progress", "spinner"}, 2, "spinner"},
    {"TooMuchLight",
     {"render", "smoke.vdb", "-o", "x.exr", "-s",
      "light=[{ type = \"point\", position = [3, 3, 3], intensity = 3e38 }]"},
     2,
     "lower 'intensity'"},
    {"ListKind", {"list", "lihgts"}, 2, "did you mean 'lights'"},
    {"Origin", {"convert", "smoke.vdb", "-o", "x.vdb", "--origin", "1,2"}, 2, "--origin"},
    {"NegativeRadius", {"convert", "points.ply", "-o", "x.vdb", "--radius", "-1"}, 2, "--radius"},
    {"EmptyScene", {"render", "", "-o", "x.exr"}, 2, "SCENE: an input's name is empty"},
    {"EmptyInput", {"convert", "smoke.vdb", "", "-o", "x.vdb"}, 2, "IN: an input's name is empty"},
    {"EmptyFile", {"inspect", ""}, 2, "FILE: an input's name is empty"},
    {"EmptyReference", {"compare", "a.exr", ""}, 2, "REFERENCE: an input's name is empty"},
    {"EmptyOutput",
     {"render", "smoke.vdb", "-o", ""},
     2,
     "--output: an output's name is empty; is a variable of the shell not set?"},
    {"VoxelSizeNan",
     {"convert", "points.ply", "-o", "x.vdb", "--voxel-size", "nan"},
     2,
     "--voxel-size: must be a finite number of at least 0, not 'nan'"},
    {"RadiusInfinite",
     {"convert", "points.ply", "-o", "x.vdb", "--radius", "1e999"},
     2,
     "--radius: must be a finite number of at least 0, not '1e999'"},
    {"VelocityScaleNan",
     {"convert", "smoke.vdb", "-o", "x.vdb", "--velocity-scale", "nan"},
     2,
     "--velocity-scale: must be a finite number, not 'nan'"},
    {"NegativeCount",
     {"convert", "smoke.vdb", "-o", "x.vdb", "--particles", "-5"},
     2,
     "--particles: must be a whole number of at least 0, not '-5'"},
    {"ExposureNan",
     {"render", "smoke.vdb", "-o", "x.exr", "--exposure", "nan"},
     2,
     "--exposure: must be a finite number from -100 to 100, not 'nan'"},
    {"TargetErrorNan",
     {"render", "smoke.vdb", "-o", "x.exr", "--target-error", "nan"},
     2,
     "finite"},
    {"TimeLimitInfinite",
     {"render", "smoke.vdb", "-o", "x.exr", "--time-limit", "inf"},
     2,
     "finite"},
    {"CheckpointIntervalNan",
     {"render", "smoke.vdb", "-o", "x.exr", "--checkpoint-interval", "nan"},
     2,
     "--checkpoint-interval: must be a finite number from 0.1 to"},
    {"ToleranceNan", {"compare", "a.exr", "b.exr", "--tolerance", "nan"}, 2, "at least 0"},
    {"MinutesNan", {"study", "smoke.vdb", "-o", "x", "--minutes", "nan"}, 2, "above 0"},
    {"FormatOption",
     {"convert", "points.ply", "-o", "x.vdb", "--format-option", "colour=1"},
     2,
     "colour"},
    {"FrameRange", {"convert", "seq.####.vdb", "-o", "x.####.vdb", "--frames", "1:3"}, 2, "1:3"},
    {"FramesWithoutToken", {"convert", "smoke.vdb", "-o", "x.vdb", "--frames", "1-3"}, 2, "####"},
    {"OneOutputManyFrames", {"convert", "seq.####.vdb", "-o", "x.vdb"}, 2, "x.####.vdb"},
    {"TwoGridsOfOneName", {"convert", "smoke.vdb", "smoke.vdb", "-o", "x.vdb"}, 2, "density"},
    {"CompareSizes", {"compare", "a.exr", "small.exr"}, 2, ""},
    {"CompareLayer", {"compare", "a.exr", "b.exr", "--layer", "single"}, 2, "RGB"},
};
INSTANTIATE_TEST_SUITE_P(Usage, ExitCodes, ::testing::ValuesIn(kUsage),
                         [](const auto& test) { return std::string(test.param.name); });

const Case kFiles[] = {
    {"ConvertMissing", {"convert", "none.vdb", "-o", "x.vdb"}, 3, "none.vdb"},
    {"ConvertNoMatch", {"convert", "none.####.vdb", "-o", "x.####.vdb"}, 3, "none.####.vdb"},
    {"ConvertMissingFrame",
     {"convert", "seq.####.vdb", "-o", "x.####.vdb", "--frames", "7"},
     3,
     "seq.0007.vdb"},
    {"ConvertDamaged", {"convert", "cut.vdb", "-o", "x.vdb"}, 4, "cut.vdb"},
    {"ConvertEmpty", {"convert", "empty.ply", "-o", "x.vdb"}, 4, "empty.ply"},
    {"ConvertSpecks", {"convert", "specks.csv", "-o", "x.vdb"}, 4, "specks.csv: "},
    {"ConvertGiant", {"convert", "giant.csv", "-o", "x.vdb"}, 5, "giant.csv: the largest"},
    {"RenderGiant", {"render", "giant.csv", "-o", "x.exr"}, 5, "giant.csv: the largest"},
    {"ConvertFar",
     {"convert", "smoke.vdb", "-o", "x.vdb", "--origin", "1e30,0,0"},
     2,
     "smoke.vdb: moved by --origin: "},
    {"RenderFar",
     {"render", "smoke.vdb", "-o", "x.exr", "-s",
      "volume.0.transform=[1e200,0,0,0, 0,1e200,0,0, 0,0,1e200,0, 0,0,0,1]"},
     4,
     "smoke.vdb: reaches "},
    {"NameTooLong",
     {"convert", "smoke.vdb", "-o", std::string(252, 'n') + ".vdb"},
     6,
     "cannot be written: File name too long; name it shorter"},
    {"ConvertHeavy",
     {"convert", "heavy.csv", "-o", "x.vdb"},
     4,
     "heavy.csv: grid 'density' would hold 0 NaN"},
    {"ConvertFast",
     {"convert", "fast.vdb", "-o", "x.vdb", "--velocity-scale", "1e35"},
     4,
     "fast.vdb: grid 'v' would hold 0 NaN, 1 infinite"},
    {"ConvertForeign", {"convert", "scene.abc", "-o", "x.vdb"}, 4, "export"},
    {"InspectMissing", {"inspect", "none.vdb"}, 3, "none.vdb"},
    {"CompareMissing", {"compare", "a.exr", "none.exr"}, 3, "none.exr"},
    {"CompareDamaged", {"compare", "cut.exr", "a.exr"}, 4, "cut.exr"},
    {"TargetIsFolder", {"convert", "smoke.vdb", "-o", "folder.vdb"}, 6, "folder.vdb"},
    {"FullDeviceVdb", {"convert", "smoke.vdb", "-o", "full.vdb"}, 6, "full.vdb"},
    {"FullDevicePly", {"convert", "points.ply", "-o", "full.ply"}, 6, "full.ply"},
    {"FullDeviceErrorMap", {"compare", "a.exr", "b.exr", "--error-map", "/dev/full"}, 6, "full"},
    {"Tolerance", {"compare", "b.exr", "a.exr", "--tolerance", "0.01"}, 7, "tolerance"},
};
INSTANTIATE_TEST_SUITE_P(Files, ExitCodes, ::testing::ValuesIn(kFiles),
                         [](const auto& test) { return std::string(test.param.name); });

TEST(ExitCode, DamagedFileIsReportedByInspect) {
  TemporaryFolder folder;
  volume::writeVdb(folder / "cut.vdb", {ballOfSmoke(0.1)});
  truncate(folder / "cut.vdb");
  const RunResult result = runTool({"inspect", (folder / "cut.vdb").string()});
  EXPECT_EQ(result.exitCode, 4);
  EXPECT_NE(result.out.find("cut.vdb"), std::string::npos) << result.out;
}

// A temporary's name is longer than its target's: that of the longest name is cut.
TEST(ExitCode, TheLongestNameIsWritten) {
  TemporaryFolder folder;
  volume::writeVdb(folder / "smoke.vdb", {ballOfSmoke(0.1)});
  const std::string name = std::string(251, 'n') + ".vdb";
  const RunResult result = runTool({"convert", "smoke.vdb", "-o", name}, folder.path());
  EXPECT_EQ(result.exitCode, 0) << result.err;
  EXPECT_EQ(namesIn(folder.path()), (std::set<std::string>{name, "smoke.vdb"}));
}

// A file's names must not steer a terminal.
TEST(ExitCode, NamesOfFilesArePrintedWithoutControlCharacters) {
  TemporaryFolder folder;
  const std::vector<float> values(64, 1.0f);
  volume::writeVdb(folder / "steering.vdb",
                   {volume::denseToGrid("a\x1b[31mb\x07", Vec3i(4), values, Mat4d(1.0))});
  const RunResult inspected = runTool({"inspect", "steering.vdb"}, folder.path());
  EXPECT_NE(inspected.out.find("grid a\\x1b[31mb\\x07"), std::string::npos) << inspected.out;
  const RunResult rendered = runTool({"render", "steering.vdb", "-o", "x.exr"}, folder.path());
  for (const RunResult& result : {inspected, rendered})
    for (const char c : result.out + result.err)
      EXPECT_TRUE(c == '\n' || static_cast<unsigned char>(c) >= 0x20) << int{c};
}

TEST(ExitCode, FullStandardOutputIsAnOutputError) {
  const RunResult result = runShell(std::string(PHOTOSPHERE_TOOL) + " list > /dev/full");
  EXPECT_EQ(result.exitCode, 6) << result.err;
  EXPECT_NE(result.err.find("standard output"), std::string::npos);
}

// A signal while frames are being written: those delivered are whole, no temporary stays.
TEST(ExitCode, SignalEndsWithItsNumberAndNoTemporaries) {
  TemporaryFolder folder;
  volume::writeVdb(folder / "smoke.vdb", {ballOfSmoke(0.1)});
  const std::string tool = PHOTOSPHERE_TOOL;
  for (const auto& [signal, code] : {std::pair{"INT", 130}, std::pair{"TERM", 143}}) {
    const RunResult result =
        runShell(tool +
                     " convert smoke.vdb -o out/x.####.vdb --frames 1-100000 --particles 2000 & "
                     "n=0; while [ ! -e out/x.0003.vdb ] && [ $n -lt 600 ]; do sleep 0.05; "
                     "n=$((n+1)); done; "
                     "kill -s " +
                     signal + " $!; wait $!",
                 folder.path());
    EXPECT_EQ(result.exitCode, code) << result.err;
    for (const std::string& name : namesIn(folder / "out")) {
      EXPECT_EQ(name.find("tmp"), std::string::npos) << name;
      EXPECT_NO_THROW(volume::readVdb(folder / "out" / name)) << name;
    }
    fs::remove_all(folder / "out");
  }
}

}  // namespace
}  // namespace photosphere::test
