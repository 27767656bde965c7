// The machine around the program fails: full disks, locked folders, inputs that disappear, memory,
// colour configs, no terminal, other locales. Each command says which file and what to do, ends
// with the documented code, and leaves nothing partial.

#include <signal.h>
#include <unistd.h>

#include <nlohmann/json.hpp>

#include "fixture.h"

namespace photosphere::test {
namespace {

/// A 64 x 48 picture; `seed` makes each of its own.
image::Image noise(int seed) {
  image::Image picture(64, 48);
  picture.addLayer("", image::ChannelKind::color);
  std::uint32_t state = static_cast<std::uint32_t>(seed);
  for (int i = 0; i < 64 * 48; ++i) {
    state = state * 1664525u + 1013904223u;
    picture.setRgb("", i % 64, i / 64, Rgb(static_cast<float>(state >> 8) * 1e-7f));
  }
  return picture;
}

/// The program's inputs in a folder of its own. `$P` stands for the program in command lines.
class Faults : public ::testing::Test {
 protected:
  void SetUp() override {
    writeSmokeFrames(m_folder, 3);
    writeText(m_folder / "scene.toml", litSmoke(64, 48) + "[render]\nsamples = 1\n");
    writePly(m_folder / "points.ply", ribbon(500, true));
    image::writeExr(m_folder / "a.exr", noise(1));
    image::writeExr(m_folder / "b.exr", noise(2));
    for (const char* name :
         {"full.vdb", "full.exr", "full.csv", "full.prt", "full.png", "full.json"})
      fs::create_symlink("/dev/full", m_folder / name);
    fs::create_directory(m_folder / "study");
    fs::create_symlink("/dev/full", m_folder / "study/study.csv");
    for (const char* name : {"folder.vdb", "folder.exr", "folder.png", "folder.json"})
      fs::create_directory(m_folder / name);
    setenv("P", PHOTOSPHERE_TOOL, 1);
  }

  RunResult shell(const std::string& command) { return runShell(command, m_folder.path()); }

  /// Names of all files below the folder, of links and folders of checkpoints too; not of other
  /// folders, and not of references, which a study keeps for the next.
  std::set<std::string> files() const {
    std::set<std::string> names;
    for (const auto& entry : fs::recursive_directory_iterator(m_folder.path()))
      if (!entry.is_directory() || entry.path().extension() == ".checkpoint")
        names.insert(entry.path().lexically_relative(m_folder.path()).string());
    std::erase_if(names, [](const std::string& name) { return name.starts_with("cache/"); });
    return names;
  }

  /// What a failed command must leave and say. @param delivered  whole files that it made before
  void expectFailure(const std::string& command, int code, std::vector<std::string> words,
                     const std::set<std::string>& delivered = {}) {
    std::set<std::string> expected = files();
    expected.insert(delivered.begin(), delivered.end());
    const RunResult result = shell(command);
    EXPECT_EQ(result.exitCode, code) << command << '\n' << result.out << result.err;
    for (const std::string& word : words)
      EXPECT_NE(result.err.find(word), std::string::npos)
          << command << "\nwanted: " << word << "\ngot: " << result.err;
    EXPECT_EQ(result.err.find("tmp-photosphere"), std::string::npos) << result.err;
    EXPECT_EQ(files(), expected) << command;
  }

  TemporaryFolder m_folder;
};

struct FaultCase {
  const char* name;
  const char* command;
  int exitCode;
  std::vector<std::string> words;  ///< the file, and the remedy
  std::set<std::string> delivered = {};
};

void PrintTo(const FaultCase& c, std::ostream* out) {
  *out << c.name;
}

class FaultTable : public Faults, public ::testing::WithParamInterface<FaultCase> {};

TEST_P(FaultTable, NameFileAndRemedyAndLeaveNothing) {
  const FaultCase& c = GetParam();
  expectFailure(c.command, c.exitCode, c.words, c.delivered);
}

std::string nameOf(const ::testing::TestParamInfo<FaultCase>& info) {
  return info.param.name;
}

/// One part of the light of frame 1, whole, and what makes a light cache of it.
#define SHARD "$P trace scene.toml --frames 1 --shard 1/1 -o s.vdb && "
/// The row of the table of hard cases that takes least.
#define HARD "$P study --hard --quick --case frame_1x1 --family single "

const FaultCase kFullDisk[] = {
    {"Frame",
     "$P render scene.toml -o full.exr --frames 1",
     6,
     {"full.exr: cannot be written", "free some"}},
    {"Merge",
     SHARD "$P merge s.vdb -o full.vdb",
     6,
     {"full.vdb: cannot be written", "free some"},
     {"s.vdb"}},
    {"MergeStatistics",
     SHARD "$P merge s.vdb -o x.vdb --stats full.json",
     6,
     {"full.json: cannot write", "free some"},
     {"s.vdb", "x.vdb"}},
    {"HardTable", HARD "-o full.csv", 6, {"full.csv: cannot", "free some"}},
    {"Trace",
     "$P trace scene.toml -o full.vdb --frames 1",
     6,
     {"full.vdb: cannot be written", "free some"}},
    {"Csv", "$P convert points.ply -o full.csv", 6, {"full.csv: cannot be written", "free some"}},
    {"Prt", "$P convert points.ply -o full.prt", 6, {"full.prt: cannot be written", "free some"}},
    {"Preview",
     "$P render scene.toml -o x.exr --frames 1 --preview full.png",
     6,
     {"full.png: cannot write", "free some"},
     {"x.exr"}},
    {"Statistics",
     "$P render scene.toml -o x.exr --frames 1 --stats full.json",
     6,
     {"full.json: cannot write", "free some"},
     {"x.exr"}},
    {"Study",
     "$P study scene.toml -o study --quick --minutes 0.01 --no-hard-cases --no-flicker "
     "--frames 1 --res 32x24 --cache cache",
     6,
     {"study.csv: cannot write", "free some"},
     {}},
    {"InspectOut", "$P inspect smoke.0001.vdb > /dev/full", 6, {"standard output"}},
    {"PlanOut", "$P plan scene.toml --frames 1 > /dev/full", 6, {"standard output"}},
    {"CompareOut", "$P compare a.exr b.exr > /dev/full", 6, {"standard output"}},
    {"RenderOut",
     "$P render scene.toml -o x.exr --frames 1 > /dev/full",
     6,
     {"standard output"},
     {"x.exr"}},
};
INSTANTIATE_TEST_SUITE_P(FullDisk, FaultTable, ::testing::ValuesIn(kFullDisk), nameOf);

// 4096 bytes a file: enough for what is printed, too little for each output.
const FaultCase kFileSizeLimit[] = {
    {"Render",
     "ulimit -f 8; $P render scene.toml -o x.exr --frames 1",
     6,
     {"x.exr: cannot be written", "ulimit -f"}},
    {"RenderWithCheckpoints",
     "ulimit -f 8; $P render scene.toml -o x.exr --frames 1 --checkpoint-interval 0.1 --res 64x64 "
     "-s estimator.type=path_traced -s estimator.samples=1000",
     6,
     {"no checkpoint", "x.exr: cannot be written", "ulimit -f"}},
    {"Trace",
     "ulimit -f 8; $P trace scene.toml -o x.vdb --frames 1",
     6,
     {"x.vdb: cannot be written", "ulimit -f"}},
    {"Vdb",
     "ulimit -f 8; $P convert points.ply -o x.vdb",
     6,
     {"x.vdb: cannot be written", "ulimit -f"}},
    {"Ply",
     "ulimit -f 8; $P convert points.ply -o x.ply",
     6,
     {"x.ply: cannot be written", "ulimit -f"}},
    {"Csv",
     "ulimit -f 8; $P convert points.ply -o x.csv",
     6,
     {"x.csv: cannot be written", "ulimit -f"}},
    {"Prt",
     "ulimit -f 8; $P convert points.ply -o x.prt",
     6,
     {"x.prt: cannot be written", "ulimit -f"}},
    {"Merge",
     SHARD "ulimit -f 8; $P merge s.vdb -o x.vdb",
     6,
     {"x.vdb: cannot be written", "ulimit -f"},
     {"s.vdb"}},
    {"HardTable",
     "ulimit -f 1; $P study --hard --quick --case slab_R --case slab_beam -o x.csv > /dev/null",
     6,
     {"x.csv: cannot write", "ulimit -f"}},
    {"ErrorMap",
     "ulimit -f 8; $P compare a.exr b.exr --error-map x.exr",
     6,
     {"x.exr: cannot be written", "ulimit -f"}},
};
INSTANTIATE_TEST_SUITE_P(FileSizeLimit, FaultTable, ::testing::ValuesIn(kFileSizeLimit), nameOf);

const FaultCase kFolderAsTarget[] = {
    {"Frame",
     "$P render scene.toml -o folder.exr --frames 1",
     6,
     {"folder.exr: is a folder", "name a file"}},
    {"Merge",
     SHARD "$P merge s.vdb -o folder.vdb",
     6,
     {"folder.vdb: is a folder", "name a file"},
     {"s.vdb"}},
    {"HardTable", HARD "-o study", 6, {"study: is a folder", "name a file"}},
    {"FolderAsShard",
     "$P merge folder.vdb -o x.vdb",
     3,
     {"folder.vdb: is a folder", "name a file"}},
    {"Trace",
     "$P trace scene.toml -o folder.vdb --frames 1",
     6,
     {"folder.vdb: is a folder", "name a file"}},
    {"Preview",
     "$P render scene.toml -o x.exr --frames 1 --preview folder.png",
     6,
     {"folder.png: is a folder", "name a file"}},
    {"Statistics",
     "$P render scene.toml -o x.exr --frames 1 --stats folder.json",
     6,
     {"folder.json: is a folder", "name a file"}},
    {"ErrorMap",
     "$P compare a.exr b.exr --error-map folder.exr",
     6,
     {"folder.exr: is a folder", "name a file"}},
    {"Pipe",
     "mkfifo pipe.exr && $P render scene.toml -o pipe.exr --frames 1",
     6,
     {"pipe.exr: is a pipe", "name a file"},
     {"pipe.exr"}},
    {"PreviewPipe",
     "mkfifo pipe.png && $P render scene.toml -o x.exr --frames 1 --preview pipe.png",
     6,
     {"pipe.png: is a pipe", "name a file"},
     {"pipe.png"}},
    {"StudyIntoAFile", "$P study scene.toml -o scene.toml", 6, {"scene.toml", "cannot create"}},
    {"FolderAsInput", "$P convert folder.vdb -o x.vdb", 3, {"folder.vdb: is a folder", "name a"}},
    {"FolderToInspect", "$P inspect folder.vdb", 3, {"folder.vdb: is a folder", "name a file"}},
    {"FolderAsScene", "$P render study -o x.exr", 3, {"study: is a folder", "name a file"}},
};
INSTANTIATE_TEST_SUITE_P(FolderAsTarget, FaultTable, ::testing::ValuesIn(kFolderAsTarget), nameOf);

const FaultCase kMemory[] = {
    {"Trace",
     "$P trace scene.toml -o x.vdb --frames 1 -s render.memory_limit=1e-6",
     5,
     {"scene.toml: frame 1 needs about", "raise render.memory_limit"}},
    {"Plan",
     "$P plan scene.toml --frames 1 -s render.memory_limit=1e-6",
     5,
     {"scene.toml: frame 1 needs about", "raise render.memory_limit"}},
    {"PathTraced",
     "$P render scene.toml -o x.exr --frames 1 -s estimator.type=path_traced "
     "-s render.memory_limit=1e-6",
     5,
     {"scene.toml: frame 1 needs about", "raise render.memory_limit"}},
    {"Pixels",
     "$P render scene.toml -o x.exr --frames 2 --res 4096x4096 -s render.memory_limit=0.5",
     5,
     {"scene.toml: frame 2 needs about", "lower the resolution, or raise render.memory_limit"}},
    {"PixelsOfABareCache",
     "$P render smoke.0001.vdb -o x.exr --res 4096x4096 -s render.memory_limit=0.5",
     5,
     {"smoke.0001.vdb: frame 1 needs about", "raise render.memory_limit"}},
    {"LightOfATrace",
     "$P trace scene.toml -o x.vdb --frames 1 -s estimator.rows=16 -s estimator.light_voxel=0.25 "
     "-s render.memory_limit=0.002",
     5,
     {"scene.toml: frame 1 needs about", "Raise estimator.light_voxel, lower estimator.rows"}},
    {"BareCache",
     "$P render smoke.0001.vdb -o x.exr -s render.memory_limit=1e-6",
     5,
     {"smoke.0001.vdb", "raise render.memory_limit"}},
    {"KeepGoing",
     "$P render scene.toml -o x.####.exr --keep-going -s render.memory_limit=1e-6",
     8,
     {"raise render.memory_limit", "3 of 3 frames failed"}},
    {"Seeding",
     "$P convert smoke.0001.vdb -o x.vdb --particles 100000000000",
     5,
     {"--particles", "fewer than"}},
};
INSTANTIATE_TEST_SUITE_P(Memory, FaultTable, ::testing::ValuesIn(kMemory), nameOf);

/// The limit of addresses, from where the libraries cannot be loaded to where all goes well. What
/// ends in between ends for want of memory or threads, and says so of no file that it is damaged.
class AddressLimit : public Faults, public ::testing::WithParamInterface<const char*> {};

TEST_P(AddressLimit, IsNoDamage) {
  if (kSanitized) GTEST_SKIP() << "the sanitizer reserves terabytes";
  constexpr int kNotLoaded = 127;
  std::set<int> codes;
  for (int kib = 60'000; kib <= 600'000 && !codes.count(0); kib += 2'000) {
    const std::string command = fmt::format("ulimit -v {}; {}", kib, GetParam());
    const RunResult result = shell(command);
    codes.insert(result.exitCode);
    EXPECT_TRUE(result.exitCode == 0 || result.exitCode == 5 || result.exitCode == kNotLoaded)
        << command << ": " << result.exitCode << '\n'
        << result.err;
    EXPECT_EQ((result.out + result.err).find("damaged"), std::string::npos) << command << '\n'
                                                                            << result.err;
  }
  EXPECT_TRUE(codes.count(0) && codes.count(5));
}

INSTANTIATE_TEST_SUITE_P(Commands, AddressLimit,
                         ::testing::Values("$P inspect smoke.0001.vdb",
                                           "$P convert smoke.0001.vdb -o x.vdb --particles 500",
                                           "$P render scene.toml -o x.exr --frames 1 -j2"),
                         [](const auto& test) {
                           const std::string command = test.param;
                           return command.substr(3, command.find(' ', 3) - 3);
                         });

TEST_F(Faults, TheLimitOfAddressesBoundsTheBudget) {
  if (kSanitized) GTEST_SKIP() << "the sanitizer reserves terabytes";
  expectFailure("ulimit -v 1000000; $P render scene.toml -o x.exr --frames 2 --res 4096x4096", 5,
                {"scene.toml: frame 2 needs about", "lower the resolution"});
}

/// While it follows paths, long after the smoke was read.
TEST_F(Faults, AnAbortFromOutsideBlamesNoFile) {
  const RunResult result = shell(
      "$P render scene.toml -o x.exr --frames 1 --res 256x256 --checkpoint-interval 0.1 "
      "-s estimator.type=path_traced -s estimator.samples=100000 & n=0; while [ -z \"$(ls "
      "x.exr.checkpoint 2>&-)\" ] && [ $n -lt 3000 ]; do sleep 0.01; n=$((n+1)); done; "
      "kill -s ABRT $!; wait $!");
  EXPECT_EQ(result.exitCode, 128 + SIGABRT) << result.err;
  EXPECT_EQ(result.err.find("damaged"), std::string::npos) << result.err;
}

// Before hours of work, not after: these scenes would take them.
const FaultCase kColour[] = {
    {"MissingOption",
     "timeout 20 $P render scene.toml -o x.exr --frames 1 --res 4096x4096 "
     "-s render.samples=10000 --ocio none.ocio",
     3,
     {"none.ocio", "leave it out for the shipped config"}},
    {"MissingVariable",
     "OCIO=none.ocio timeout 20 $P render scene.toml -o x.exr --frames 1 --res 4096x4096 "
     "-s render.samples=10000",
     3,
     {"none.ocio", "$OCIO", "leave it out for the shipped config"}},
    {"Broken",
     "echo nonsense > scene.toml.ocio; mv scene.toml.ocio a.exr; timeout 20 $P render scene.toml "
     "-o x.exr --frames 1 --res 4096x4096 -s render.samples=10000 --preview x.png --ocio a.exr",
     4,
     {"a.exr: is not a colour config", "leave it out for the shipped config"}},
    {"UnknownView",
     "timeout 20 $P render scene.toml -o x.exr --frames 1 --res 4096x4096 "
     "-s render.samples=10000 --preview x.png --ocio-view sideways",
     2,
     {"sideways", "choose one of"}},
    {"KindOfPreview",
     "timeout 20 $P render scene.toml -o x.exr --frames 1 --res 4096x4096 "
     "-s render.samples=10000 --preview x.gif",
     2,
     {"x.gif", ".png"}},
};
INSTANTIATE_TEST_SUITE_P(Colour, FaultTable, ::testing::ValuesIn(kColour), nameOf);

/// A folder that nobody but root may write in, and for root a way to be somebody else.
TEST_F(Faults, LockedFolder) {
  std::string run = "$P ";
  if (geteuid() == 0) {
    // Somebody else may run what root names, but not read what lies in root's own folder.
    const fs::path data = m_folder / "data";
    fs::create_directory(data);
    for (const char* part : {"color", "hard"})
      fs::copy(fs::path(PHOTOSPHERE_SOURCE_DIR "/data") / part, data / part,
               fs::copy_options::recursive);
    run = "PHOTOSPHERE_DATA=" + data.string() +
          " setpriv --reuid=65534 --regid=65534 --clear-groups $P ";
    fs::permissions(m_folder.path(), fs::perms(0755));
    if (shell(run + "--version").exitCode != 0) GTEST_SKIP() << "root cannot become nobody here";
  }
  fs::create_directory(m_folder / "locked");
  fs::permissions(m_folder / "locked", fs::perms(0555));
  ASSERT_EQ(shell(SHARD "true").exitCode, 0);
  const std::string scene = " scene.toml --frames 1 -o locked/";
  for (const auto& [command, file] : std::initializer_list<std::pair<std::string, std::string>>{
           {"render" + scene + "x.exr", "locked/x.exr"},
           {"render" + scene + "new/x.exr", "locked/new"},
           {"render scene.toml --frames 1 -o /dev/null/x.exr", "/dev/null"},
           {"trace" + scene + "x.vdb", "locked/x.vdb"},
           {"convert points.ply -o locked/x.csv", "locked/x.csv"},
           {"convert smoke.0001.vdb -o locked/x.vdb", "locked/x.vdb"},
           {"merge s.vdb -o locked/x.vdb", "locked/x.vdb"},
           {"compare a.exr b.exr --error-map locked/x.exr", "locked/x.exr"},
           {"study --hard --case frame_1x1 -o locked/x.csv", "locked/x.csv"},
           {"study scene.toml --quick -o locked/report", "locked/report"}})
    expectFailure(run + command, 6, {file, "write elsewhere"});
  fs::permissions(m_folder / "locked", fs::perms(0755));
}

/// Sixteen frames of which the fifteenth goes while the first are made: the program is halted for
/// it, so that no machine is too slow.
class Disappearing : public Faults, public ::testing::WithParamInterface<const char*> {
 protected:
  void SetUp() override {
    Faults::SetUp();
    for (int i = 1; i <= 16; ++i) {
      const std::string frame = (i < 10 ? "000" : "00") + std::to_string(i);
      fs::remove(m_folder / ("smoke." + frame + ".vdb"));
      volume::writeVdb(m_folder / ("smoke." + frame + ".vdb"), {ballOfSmoke(0.1)});
    }
    if (lost() == "shard.0015.vdb") {
      ASSERT_EQ(shell("$P trace scene.toml --frames 1-16 --shard 1/1 -o shard.####.vdb").exitCode,
                0);
    }
  }
  std::string extension() const {
    return std::string(GetParam()).find("render") != std::string::npos ? "exr" : "vdb";
  }
  /// The input that goes.
  std::string lost() const {
    return std::string(GetParam()).find("merge") != std::string::npos ? "shard.0015.vdb"
                                                                      : "smoke.0015.vdb";
  }
  RunResult run(const std::string& more) {
    return shell(std::string(GetParam()) + more + " & n=0; while [ ! -e out/x.0001." + extension() +
                 " ] && [ $n -lt 3000 ]; do sleep 0.01; n=$((n+1)); done; kill -s STOP $!; "
                 "rm " +
                 lost() + "; kill -s CONT $!; wait $!");
  }
  std::set<std::string> outputs(std::initializer_list<int> missing) const {
    std::set<std::string> names;
    for (int i = 1; i <= 16; ++i)
      if (std::find(missing.begin(), missing.end(), i) == missing.end())
        names.insert((i < 10 ? "x.000" : "x.00") + std::to_string(i) + "." + extension());
    return names;
  }
};

TEST_P(Disappearing, InputEndsTheCommandWithWhatWasDone) {
  const RunResult result = run("");
  EXPECT_EQ(result.exitCode, 3) << result.err;
  EXPECT_NE(result.err.find(lost() + ": no such file; check its path"), std::string::npos)
      << result.err;
  EXPECT_EQ(namesIn(m_folder / "out"), outputs({15, 16}));
}

TEST_P(Disappearing, InputIsOneFailedFrameWhereOthersGoOn) {
  const RunResult result = run(" --keep-going");
  EXPECT_EQ(result.exitCode, 8) << result.err;
  EXPECT_NE(result.err.find(lost() + ": no such file; check its path"), std::string::npos)
      << result.err;
  EXPECT_NE(result.err.find("1 of 16 frames failed: 15"), std::string::npos) << result.err;
  EXPECT_EQ(namesIn(m_folder / "out"), outputs({15}));
}

INSTANTIATE_TEST_SUITE_P(Commands, Disappearing,
                         ::testing::Values("$P render scene.toml -o out/x.####.exr --res 16x12",
                                           "$P trace scene.toml -o out/x.####.vdb",
                                           "$P merge shard.####.vdb -o out/x.####.vdb",
                                           "$P convert smoke.####.vdb -o out/x.####.vdb "
                                           "--particles 500"),
                         [](const auto& test) {
                           const std::string command = test.param;
                           return command.substr(3, command.find(' ', 3) - 3);
                         });

TEST_F(Faults, NoTerminal) {
  const RunResult result =
      shell("setsid -w $P render scene.toml -o x.exr --frames 1 --progress bar < /dev/null");
  EXPECT_EQ(result.exitCode, 0) << result.err;
  EXPECT_EQ(result.err.find('\r'), std::string::npos) << result.err;
  EXPECT_TRUE(image::exrIsComplete(m_folder / "x.exr"));
}

// A stream that is closed leaves its number to the next file: what is printed must not go into
// that.
TEST_F(Faults, ClosedStreams) {
  const struct {
    const char* redirection;
    int code;
  } cases[] = {{"<&-", 0}, {"2>&-", 0}, {">&-", 6}, {"<&- >&- 2>&-", 6}};
  ASSERT_EQ(shell("$P convert points.ply -o whole.csv").exitCode, 0);
  for (const auto& c : cases) {
    EXPECT_EQ(shell(std::string("$P render scene.toml -v --progress json -o x.exr --frames 1 ") +
                    c.redirection)
                  .exitCode,
              c.code)
        << c.redirection;
    EXPECT_TRUE(image::exrIsComplete(m_folder / "x.exr")) << c.redirection;
    fs::remove(m_folder / "x.exr");
    EXPECT_EQ(shell(std::string("$P convert points.ply -v -o x.csv ") + c.redirection).exitCode,
              c.code)
        << c.redirection;
    EXPECT_EQ(readText(m_folder / "x.csv"), readText(m_folder / "whole.csv")) << c.redirection;
  }
}

/// A German locale, made in the folder: it may not be installed.
TEST_F(Faults, DecimalComma) {
  fs::create_directory(m_folder / "locales");
  if (shell("localedef -i de_DE -f UTF-8 locales/de_DE.UTF-8").exitCode != 0 ||
      shell("LOCPATH=$PWD/locales LC_ALL=de_DE.UTF-8 locale decimal_point").out != ",\n")
    GTEST_SKIP() << "no sources of locales (Debian's package locales)";
  const std::string german = "LOCPATH=$PWD/locales LC_ALL=de_DE.UTF-8 LANG=de_DE.UTF-8 ";
  for (const char* command :
       {"inspect smoke.0002.vdb", "inspect smoke.0002.vdb --json", "inspect points.ply",
        "compare a.exr b.exr", "compare a.exr b.exr --json", "list estimators",
        "render scene.toml --dump-scene -s volume.0.density_scale=1.5 -s render.step=0.5"}) {
    const RunResult plain = shell(std::string("LC_ALL=C $P ") + command);
    const RunResult comma = shell(german + "$P " + command);
    ASSERT_EQ(plain.exitCode, 0) << command << plain.err;
    EXPECT_EQ(comma.exitCode, 0) << command << comma.err;
    EXPECT_EQ(comma.out, plain.out) << command;
  }
  for (const auto& [locale, name] : {std::pair<std::string, std::string>{"LC_ALL=C ", "c"},
                                     std::pair<std::string, std::string>{german, "de"}}) {
    for (const char* extension : {".csv", ".ply", ".txt"})
      ASSERT_EQ(shell(locale + "$P convert points.ply --voxel-size 0.125 --radius 0.25 -o " + name +
                      extension)
                    .exitCode,
                0);
    ASSERT_EQ(shell(locale + "$P render scene.toml --frames 2 -o " + name + ".exr --stats " + name +
                    ".json --exposure 0.5 --preview " + name + ".png -s render.step=0.75")
                  .exitCode,
              0);
  }
  for (const char* extension : {".csv", ".ply", ".txt", ".png"})
    EXPECT_EQ(readText(m_folder / (std::string("de") + extension)),
              readText(m_folder / (std::string("c") + extension)))
        << extension;
  EXPECT_EQ(shell("$P compare de.exr c.exr --tolerance 0").exitCode, 0);
  EXPECT_GT(nlohmann::json::parse(readText(m_folder / "de.json")).at("image").at("mean"), 0);
}

}  // namespace
}  // namespace photosphere::test
