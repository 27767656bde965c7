// --help, --version and list: they come from the tables, so every plug-in is in them.

#include "fixture.h"
#include "photosphere/caches/cache_format.h"
#include "photosphere/cameras/camera.h"
#include "photosphere/lights/light.h"
#include "photosphere/phase/phase.h"

namespace photosphere::test {
namespace {

bool contains(const std::string& text, std::string_view part) {
  return text.find(part) != std::string::npos;
}

template <class Plugin>
void expectListed(std::span<const Plugin* const> table, const std::string& text) {
  for (const Plugin* plugin : table) {
    EXPECT_TRUE(contains(text, std::string("  ") + std::string(plugin->name) + ":"))
        << plugin->name;
    for (const Param& row : plugin->params) {
      EXPECT_TRUE(contains(text, row.name)) << row.name;
      EXPECT_TRUE(contains(text, row.help)) << row.help;
    }
  }
}

TEST(Help, NamesEveryCommandAndItsOptions) {
  const RunResult all = runTool({"--help"});
  EXPECT_EQ(all.exitCode, 0);
  EXPECT_TRUE(all.err.empty()) << all.err;
  for (const char* command :
       {"convert", "inspect", "plan", "trace", "merge", "render", "compare", "study", "list"}) {
    EXPECT_TRUE(contains(all.out, command)) << command;
    const RunResult help = runTool({command, "--help"});
    EXPECT_EQ(help.exitCode, 0) << command << help.err;
    for (const char* option : {"--verbose", "--quiet", "--threads", "--progress", "--help"})
      EXPECT_TRUE(contains(help.out, option)) << command << ' ' << option;
  }
}

TEST(Help, OfConvertShowsTheRowsOfFormats) {
  const RunResult help = runTool({"convert", "--help"});
  for (const caches::CacheFormat* format : caches::cacheFormats())
    for (const Param& row : format->params)
      EXPECT_TRUE(contains(help.out, row.help)) << format->name << ' ' << row.name;
}

TEST(Version, IsOneLine) {
  const RunResult result = runTool({"--version"});
  EXPECT_EQ(result.exitCode, 0);
  EXPECT_EQ(result.out.rfind("photosphere ", 0), 0u) << result.out;
  EXPECT_EQ(std::count(result.out.begin(), result.out.end(), '\n'), 1);
}

TEST(List, NamesEveryPlugIn) {
  const RunResult all = runTool({"list"});
  ASSERT_EQ(all.exitCode, 0) << all.err;
  expectListed(caches::cacheFormats(), all.out);
  expectListed(phase::phaseFunctions(), all.out);
  expectListed(lights::lightModels(), all.out);
  expectListed(cameras::cameraModels(), all.out);
  const RunResult lights = runTool({"list", "lights"});
  EXPECT_TRUE(contains(lights.out, "spot"));
  EXPECT_FALSE(contains(lights.out, "henyey"));
}

// Numbers keep their point where the user's locale has a comma.
TEST(Locale, DoesNotChangeNumbers) {
  TemporaryFolder folder;
  if (runShell("localedef -i de_DE -f UTF-8 ./de_DE.UTF-8", folder.path()).exitCode != 0)
    GTEST_SKIP() << "no locale with a decimal comma can be made here";
  // Without this the program would see no such locale, and the test could not fail.
  const RunResult comma =
      runShell("LOCPATH=. LC_ALL=de_DE.UTF-8 locale decimal_point", folder.path());
  ASSERT_EQ(comma.out, ",\n");
  writePly(folder / "points.ply", ribbon(50, true));
  const std::string tool = std::string(PHOTOSPHERE_TOOL) + " convert points.ply ";
  const RunResult plain = runShell("LC_ALL=C " + tool + "-o a.csv", folder.path());
  const RunResult german =
      runShell("LOCPATH=. LC_ALL=de_DE.UTF-8 " + tool + "-o b.csv", folder.path());
  EXPECT_EQ(plain.exitCode, 0) << plain.err;
  EXPECT_EQ(german.exitCode, 0) << german.err;
  EXPECT_EQ(readText(folder / "a.csv"), readText(folder / "b.csv"));
}

}  // namespace
}  // namespace photosphere::test
