// Damaged input is refused and output is whole or absent.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>

#include "photosphere/core/error.h"
#include "photosphere/volume/vdb_file.h"
#include "support/support.h"

namespace photosphere::volume {
namespace {

namespace fs = std::filesystem;

// A density grid and three points: small enough to damage each byte in turn.
std::string smallFile(const test::TemporaryFolder& folder) {
  ParticleSet points;
  points.positions = {Vec3d(0.1), Vec3d(0.2, 0.3, 0.9), Vec3d(1.5)};
  points.add({"v", 3, std::vector<float>{1, 2, 3, 4, 5, 6, 7, 8, 9}});
  points.add({"label", 1, std::vector<std::string>{"a", "b", "a"}});
  std::vector<float> values(27);
  for (std::size_t i = 0; i < values.size(); ++i)
    values[i] = static_cast<float>(i);
  writeVdb(folder / "small.vdb",
           {denseToGrid("density", Vec3i(3), values, Mat4d(1)), pointsToGrid(points, "points", 1)},
           {{"note", "made to be damaged"}});
  return test::readText(folder / "small.vdb");
}

// Most of a small file is zeros of node masks, each like the others: every 256th stands for them.
bool insideZeros(const std::string& content, std::size_t i) {
  const std::size_t begin = i < 8 ? 0 : i - 8, end = std::min(content.size(), i + 9);
  return i % 256 != 0 &&
         content.substr(begin, end - begin).find_first_not_of('\0') == std::string::npos;
}

struct Outcome {
  int read = 0, refused = 0, crashed = 0;
};

// A flipped sign in a length makes OpenVDB 10 read a stored array of any length into the buffer of
// another (io/Compression.cc, bloscFromStream). Not ours to mend; `probeVdb` keeps it in a process
// of its own.
bool isOpenVdbOverrun(const std::string& report) {
  return report.find("bloscFromStream") != std::string::npos;
}

// Reads in a process of its own and says how it ended. 4 stands for the guard's exit.
void readDamaged(const fs::path& path, const std::string& what, Outcome& outcome) {
  const std::string report = path.string() + ".report";
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    const struct rlimit memory { rlim_t(1) << 30, rlim_t(1) << 30 }, cpu{10, 12}, core{0, 0};
    if (!test::kSanitized) setrlimit(RLIMIT_AS, &memory);  // a sanitizer reserves terabytes
    setrlimit(RLIMIT_CPU, &cpu);
    setrlimit(RLIMIT_CORE, &core);
    dup2(open(report.c_str(), O_CREAT | O_TRUNC | O_WRONLY, 0600), STDERR_FILENO);
    try {
      const VdbFile file = readVdb(path);
      for (const Grid& grid : file.grids)
        if (grid.kind() == GridKind::points) gridToPoints(grid);
      _exit(0);
    } catch (const InputError&) {
      _exit(10);
    } catch (...) {
      _exit(11);
    }
  }
  int status = 0;
  waitpid(child, &status, 0);
  if (test::kSanitized && WIFSIGNALED(status) && WTERMSIG(status) == SIGXCPU) {
    ++outcome.refused;  // OpenVDB fills memory that the limit, absent here, would have refused
    return;
  }
  ASSERT_TRUE(WIFEXITED(status)) << what << ": signal " << WTERMSIG(status);
  int code = WEXITSTATUS(status);
  if (code == test::kSanitizerExit) {
    const std::string text = test::readText(report);
    EXPECT_TRUE(isOpenVdbOverrun(text)) << what << ":\n" << text;
    code = 4;
  }
  EXPECT_TRUE(code == 0 || code == 4 || code == 10) << what << ": exit " << code;
  ++(code == 0 ? outcome.read : code == 4 ? outcome.crashed : outcome.refused);
}

TEST(DamagedVdb, EveryTruncationIsRefused) {
  const test::TemporaryFolder folder;
  const std::string whole = smallFile(folder);
  const fs::path path = folder / "cut.vdb";
  for (std::size_t length = 0; length < whole.size(); ++length) {
    if (insideZeros(whole, length)) continue;
    test::writeText(path, whole.substr(0, length));
    EXPECT_THROW(readVdb(path), InputError) << length << " of " << whole.size() << " bytes";
  }
}

TEST(DamagedVdb, EveryFlippedByteEndsInAnAnswer) {
  const test::TemporaryFolder folder;
  const std::string whole = smallFile(folder);
  const fs::path path = folder / "flipped.vdb";
  Outcome outcome;
  constexpr int kStep = test::kSanitized ? 7 : 1;  // a fork copies the sanitizer's maps too
  for (std::size_t i = 0; i < whole.size(); ++i)
    for (const int mask : {0x80, 0xff}) {
      if (insideZeros(whole, i) || i % kStep != 0) continue;
      std::string damaged = whole;
      damaged[i] = static_cast<char>(damaged[i] ^ mask);
      test::writeText(path, damaged);
      readDamaged(path, "byte " + std::to_string(i) + " ^ " + std::to_string(mask), outcome);
      if (HasFatalFailure()) return;
    }
  // Values and text may change unnoticed; structure may not.
  EXPECT_GT(outcome.refused, 100 / kStep);
  EXPECT_GT(outcome.read, 100 / kStep);
  std::printf("%d read, %d refused, %d ended by the guard\n", outcome.read, outcome.refused,
              outcome.crashed);
}

TEST(DamagedVdb, TheMessageSaysWhereAndWhat) {
  const test::TemporaryFolder folder;
  const std::string whole = smallFile(folder);
  const auto message = [&](const std::string& content) -> std::string {
    test::writeText(folder / "x.vdb", content);
    try {
      readVdb(folder / "x.vdb");
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_NE(message("").find("0 bytes"), std::string::npos);
  EXPECT_NE(message("not a vdb at all").find("is not a .vdb file"), std::string::npos);
  EXPECT_NE(message(whole.substr(0, whole.size() - 1)).find("not copied whole"), std::string::npos);
  std::string newer = whole;
  newer[8] = static_cast<char>(0xff);
  EXPECT_NE(message(newer).find("at byte 8: file version 255"), std::string::npos);
  EXPECT_THROW(readVdb(folder / "none.vdb"), InputMissingError);
  EXPECT_THROW(readVdb(folder.path()), InputMissingError);
}

TEST(DamagedVdb, ProbingSaysWhyAndLeavesThisProcessAlone) {
  const test::TemporaryFolder folder;
  const std::string whole = smallFile(folder);
  std::string reason = "old";
  EXPECT_TRUE(probeVdb(folder / "small.vdb", reason)) << reason;
  EXPECT_EQ(reason, "");
  test::writeText(folder / "cut.vdb", whole.substr(0, whole.size() / 2));
  EXPECT_FALSE(probeVdb(folder / "cut.vdb", reason));
  EXPECT_NE(reason.find("cut.vdb"), std::string::npos);
  EXPECT_FALSE(probeVdb(folder / "none.vdb", reason));
}

Grid bigGrid() {
  std::vector<float> noise(64 * 64 * 64);
  std::uint32_t state = 1;
  for (float& v : noise)
    v = static_cast<float>(state = state * 1664525u + 1013904223u);
  return denseToGrid("density", Vec3i(64), noise, Mat4d(1));
}

TEST(VdbOutput, AFullDeviceIsAnError) {
  if (!fs::exists("/dev/full")) GTEST_SKIP() << "no /dev/full";
  EXPECT_THROW(writeVdb("/dev/full", {bigGrid()}), OutputError);
  EXPECT_TRUE(fs::is_character_file("/dev/full"));
}

TEST(VdbOutput, AFileSizeLimitLeavesTheOldFileAndNoTemporary) {
  const test::TemporaryFolder folder;
  const fs::path path = folder / "out.vdb";
  writeVdb(path, {denseToGrid("density", Vec3i(1), {1.0f}, Mat4d(1))});
  const std::string before = test::readText(path);
  const Grid grid = bigGrid();
  struct rlimit old {};
  getrlimit(RLIMIT_FSIZE, &old);
  struct rlimit small = old;
  small.rlim_cur = 100'000;
  const auto handler = signal(SIGXFSZ, SIG_IGN);
  setrlimit(RLIMIT_FSIZE, &small);
  EXPECT_THROW(writeVdb(path, {grid}), OutputError);
  setrlimit(RLIMIT_FSIZE, &old);
  signal(SIGXFSZ, handler);
  EXPECT_EQ(test::readText(path), before);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.path()), fs::directory_iterator()), 1);
  writeVdb(path, {grid});
  EXPECT_EQ(readVdb(path).find("density").activeVoxels(), 64u * 64 * 64);
}

TEST(VdbOutput, NothingToWriteIsAnError) {
  const test::TemporaryFolder folder;
  EXPECT_THROW(writeVdb(folder / "a.vdb", {}), OutputError);
  EXPECT_THROW(writeVdb(folder / "a.vdb", {Grid()}), OutputError);
  EXPECT_FALSE(fs::exists(folder / "a.vdb"));
}

}  // namespace
}  // namespace photosphere::volume
