// The table of hard cases: its catalogue, its oracles, its rows.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "photosphere/core/error.h"
#include "photosphere/study/stability.h"
#include "stability_catalogue.h"
#include "stability_frame.h"
#include "stability_traces.h"
#include "support/slab_table.h"
#include "support/support.h"

namespace photosphere::study {
namespace {

using test::projectFile;
using test::TemporaryFolder;
using test::writeText;

StabilityFrame frameOf(int width, int height, double value) {
  StabilityFrame frame;
  frame.width = width;
  frame.height = height;
  frame.pixels.assign(3 * static_cast<std::size_t>(width * height), value);
  return frame;
}

// Copies the shipped scene and estimators beside other cases.
void writeCatalogue(const TemporaryFolder& folder, const std::string& cases) {
  std::filesystem::create_directories(folder / "cases");
  for (const char* name : {"base.toml", "estimators.toml"})
    writeText(folder / name, test::readText(projectFile(std::string("data/hard/") + name)));
  writeText(folder / "cases/a.toml", cases);
}

std::string complaintAbout(const std::string& cases, const std::vector<std::string>& names = {}) {
  const TemporaryFolder folder;
  writeCatalogue(folder, cases);
  try {
    runStability({.catalogue = folder.path(), .quick = true, .cases = names, .estimators = {}}, {});
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "";
}

TEST(Stability, WithLessWorkOnlyTheEndIsJudged) {
  const TemporaryFolder folder;
  const std::string head =
      "[[case]]\nhard = \"-\"\nestimators = [\"single\"]\nbound = 0\n"
      "oracle = { kind = \"value\", value = 1e9 }\n";
  writeCatalogue(folder, head + "name = \"a\"\n" + head +
                             "name = \"refused\"\nset = ['volume.0.grid=\"none\"']\n");
  StabilityOptions options;
  options.catalogue = folder.path();
  for (const double work : {1.0, 0.5}) {
    options.work = work;
    const std::vector<StabilityRow> rows = runStability(options, {});
    ASSERT_EQ(rows.size(), 2u);
    EXPECT_EQ(rows[0].passed, work < 1) << rows[0].message;
    EXPECT_EQ(rows[1].passed, work < 1) << rows[1].message;
    EXPECT_EQ(rows[1].result, work < 1 ? "exit 2" : "") << rows[1].message;
  }
}

/// Sanitizers watch every case of a file, with little work each; without them study.hard_cases runs
/// and judges them.
class EveryCase : public ::testing::TestWithParam<std::string> {};

TEST_P(EveryCase, ComesToAnEnd) {
  const TemporaryFolder folder;
  writeCatalogue(folder, test::readText(projectFile("data/hard/cases/" + GetParam())));
  StabilityOptions options;
  options.catalogue = folder.path();
  options.quick = true;
  options.work = 0.02;
  std::size_t refused = 0;
  const std::vector<StabilityRow> rows = runStability(options, [&](const StabilityRow& row) {
    refused += row.result.starts_with("exit");
    EXPECT_TRUE(row.passed) << row.name << ' ' << row.estimator << ": " << row.result << ' '
                            << row.message;
  });
  EXPECT_GT(rows.size(), 5u);
  EXPECT_LT(refused, rows.size() * 3 / 4);
}

std::vector<std::string> caseFiles() {
  std::vector<std::string> names;
  if (!test::kSanitized) return names;
  for (const auto& entry : std::filesystem::directory_iterator(projectFile("data/hard/cases")))
    names.push_back(entry.path().filename().string());
  std::sort(names.begin(), names.end());
  return names;
}

GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(EveryCase);
INSTANTIATE_TEST_SUITE_P(Hard, EveryCase, ::testing::ValuesIn(caseFiles()), [](const auto& name) {
  std::string word = std::filesystem::path(name.param).stem().string();
  std::replace_if(
      word.begin(), word.end(), [](unsigned char c) { return !std::isalnum(c); }, '_');
  return word;
});

TEST(Stability, ErrorsOfBlocks) {
  const StabilityFrame one = frameOf(16, 8, 1);
  StabilityFrame other = frameOf(16, 8, 1.1);
  EXPECT_NEAR(blockError(other, one, 8, 1), 0.1 / std::sqrt(1.01), 1e-12);
  EXPECT_NEAR(blockError(other, one, 8, 1.1), 0, 1e-12);
  // Noise within a block is none; one bright block is.
  other = one;
  other.pixels[0] += 0.5;
  other.pixels[3] -= 0.5;
  EXPECT_NEAR(blockError(other, one, 8, 1), 0, 1e-12);
  other.pixels[0] += 64;
  EXPECT_GT(blockError(other, one, 8, 1), 0.3);
  other.pixels[0] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(blockError(other, one, 8, 1), std::numeric_limits<double>::infinity());
  EXPECT_EQ(blockError(frameOf(8, 8, 1), one, 8, 1), std::numeric_limits<double>::infinity());
  EXPECT_EQ(blockError(frameOf(8, 8, 0), frameOf(8, 8, 0), 8, 1), 0);
  EXPECT_EQ(blockError(frameOf(8, 8, 1e-30), frameOf(8, 8, 0), 8, 1),
            std::numeric_limits<double>::infinity());
}

// One block of eight holds nearly all the light.
TEST(Stability, TheMeanIsJudgedBesideTheBlocks) {
  StabilityFrame one = frameOf(32, 16, 0.01);
  for (int y = 0; y < 8; ++y)
    for (int i = 0; i < 3 * 8; ++i)
      one.pixels[static_cast<std::size_t>(3 * 32 * y + i)] = 1;
  StabilityFrame other = one;
  for (double& v : other.pixels)
    if (v == 1) v = 1.3;
  EXPECT_NEAR(blockError(other, one, 8, 1), 0.3 / std::sqrt(8), 0.002);
  EXPECT_NEAR(meanError(other, one, 1), 0.3 * 0.935 / std::sqrt(1.01), 0.002);
  EXPECT_EQ(frameError(other, one, 8, 1), meanError(other, one, 1));
  EXPECT_EQ(frameError(one, one, 8, 1), 0);
  // And the other way about: what is missing here is there.
  other = one;
  std::swap_ranges(other.pixels.begin(), other.pixels.begin() + 24, other.pixels.end() - 24);
  EXPECT_EQ(frameError(other, one, 8, 1), blockError(other, one, 8, 1));
}

TEST(Stability, SemiInfiniteReflectanceIsThatOfADeepSlab) {
  for (const double albedo : {0.5, 0.9}) {
    EXPECT_NEAR(semiInfiniteReflectance(albedo, false),
                test::slabValue("diffuse", 32, albedo, 0, "R"), 1e-6);
    EXPECT_NEAR(semiInfiniteReflectance(albedo, true), test::slabValue("beam", 32, albedo, 0, "R"),
                1e-6);
  }
}

TEST(Stability, TheCatalogueRefusesWhatItDoesNotKnow) {
  const std::string head = "[[case]]\nname = \"a\"\nhard = \"b\"\n";
  EXPECT_NE(
      complaintAbout(head + "tau = 1\noracle = { kind = \"zero\" }\n").find("a.toml:4: unknown"),
      std::string::npos);
  EXPECT_NE(complaintAbout(head).find("'oracle' is missing"), std::string::npos);
  EXPECT_NE(complaintAbout(head + "estimators = [\"vew\"]\noracle = { kind = \"zero\" }\n")
                .find("no estimator of the catalogue is named 'vew'"),
            std::string::npos);
  EXPECT_NE(complaintAbout("[[row]]\nname = \"a\"\n").find("[[case]] tables alone"),
            std::string::npos);
}

std::vector<StabilityRow> rowsOf(const std::string& cases,
                                 const std::vector<std::string>& names = {}) {
  const TemporaryFolder folder;
  writeCatalogue(folder, cases);
  return runStability({.catalogue = folder.path(), .quick = true, .cases = names, .estimators = {}},
                      {});
}

// Every kind of oracle must be able to say no.
TEST(Stability, RowsFailWhenTheAnswerIsAnother) {
  const std::string one = "[[case]]\nhard = \"-\"\nestimators = [\"single\"]\n";
  const auto rows =
      rowsOf(one + "name = \"zero\"\noracle = { kind = \"zero\" }\n" + one +
             "name = \"value\"\noracle = { kind = \"value\", value = 3 }\n" + one +
             "name = \"same\"\noracle = { kind = \"same\", scale = 2 }\n" + one +
             "name = \"path\"\noracle = { kind = \"path\", samples = 64, set = "
             "[\"light.0.intensity=99\"] }\n" +
             one + "name = \"error\"\noracle = { kind = \"error\", code = 4 }\n" + one +
             "name = \"says\"\nsays = \"nothing of the kind\"\noracle = { kind = \"same\" }\n" +
             one + "name = \"writes\"\nwrites = \"float\"\noracle = { kind = \"same\" }\n" + one +
             "name = \"refused\"\nsmoke = { bad = -1 }\noracle = { kind = \"same\" }\n" +
             "[[case]]\nhard = \"-\"\nname = \"flux\"\ntrace = \"slab_flux\"\nslab = { tau = 1, "
             "photons = 1000, "
             "quick_photons = 1000 }\noracle = { kind = \"diffusion\" }\nbound = 1e-9\n");
  ASSERT_EQ(rows.size(), 9u);
  for (const StabilityRow& row : rows)
    EXPECT_FALSE(row.passed) << row.name;
  EXPECT_NE(rows[7].message.find("holds 0 NaN, 0 infinite and 1 negative"), std::string::npos);
}

TEST(Stability, RowsPassWhenTheAnswerIsThat) {
  const std::string one = "[[case]]\nhard = \"-\"\nestimators = [\"single\"]\nbound = 0.01\n";
  const auto rows = rowsOf(
      one + "name = \"zero\"\nset = [\"light.0.intensity=0\"]\noracle = { kind = \"zero\" }\n" +
      one +
      "name = \"{}\"\nfor = [\"1\", \"2\"]\nset = [\"light.0.intensity={}\"]\nwrites = \"half\"\n"
      "oracle = { kind = \"same\", bare = true, scale = 0.05 }\n");
  ASSERT_EQ(rows.size(), 3u);
  EXPECT_TRUE(rows[0].passed) << rows[0].message;
  EXPECT_TRUE(rows[1].passed) << rows[1].message;
  EXPECT_FALSE(rows[2].passed);
}

// A frame that is too bright by a tenth, and one that is black where it must not be.
TEST(Stability, MeansFloorsAndBoundsOfTheirOwn) {
  const std::string one = "[[case]]\nhard = \"-\"\nestimators = [\"single\"]\n";
  const std::string brighter =
      "oracle = { kind = \"same\", bare = true }\n"
      "set = [\"light.0.intensity=22\"]\n";
  const auto rows = rowsOf(
      one + "name = \"few\"\nbound = 0.05\n" + brighter + one +
      "name = \"own\"\nbound = 0.05\nbounds = { single = 0.11 }\n" + brighter + one +
      "name = \"dark\"\nset = [\"light.0.intensity=0\"]\nbound = 1\n"
      "oracle = { kind = \"below\", value = 1, least = 1e-3 }\n" +
      one + "name = \"lit\"\nbound = 1\noracle = { kind = \"below\", value = 1, least = 1e-3 }\n");
  ASSERT_EQ(rows.size(), 4u);
  EXPECT_FALSE(rows[0].passed);
  EXPECT_NEAR(rows[0].error, 0.1, 0.01);
  EXPECT_TRUE(rows[1].passed) << rows[1].error;
  EXPECT_FALSE(rows[2].passed);
  EXPECT_TRUE(rows[3].passed) << rows[3].message;
  EXPECT_NE(complaintAbout(one + "name = \"a\"\nbounds = { vew = 1 }\noracle = { kind = "
                                 "\"zero\" }\n")
                .find("no estimator of the catalogue is named 'vew'"),
            std::string::npos);
}

TEST(Stability, CropsAreHeldAgainstThatPartOfTheWholeFrame) {
  const std::string one =
      "[[case]]\nhard = \"-\"\nestimators = [\"single\"]\nbound = 0\noracle = { kind = \"same\" "
      "}\n";
  const auto rows = rowsOf(one + "name = \"part\"\ncrop = [9, 3, 26, 14]\n" + one +
                           "name = \"past\"\ncrop = [24, 8, 1000, 1000]\n");
  ASSERT_EQ(rows.size(), 2u);
  for (const StabilityRow& row : rows) {
    EXPECT_TRUE(row.passed) << row.name << ' ' << row.error;
    EXPECT_NE(row.result, "0");
  }
  EXPECT_NE(rows[0].result, rows[1].result);
}

TEST(Stability, ACaseThatNobodyRendersIsRefused) {
  EXPECT_NE(complaintAbout("[[case]]\nname = \"a\"\nhard = \"-\"\nestimators = [\"particles\"]\n"
                           "oracle = { kind = \"zero\" }\n")
                .find("a: no estimator renders it in this size"),
            std::string::npos);
}

TEST(Stability, TheDigestNamesTheRowThatIsClosestToItsBound) {
  const auto row = [](const char* kind, const char* name, double error, double bound) {
    StabilityRow r;
    r.kind = kind;
    r.name = name;
    r.estimator = "view";
    r.error = error;
    r.bound = bound;
    r.passed = error <= bound;
    return r;
  };
  const std::vector<std::string> lines =
      stabilityDigest({row("media", "a", 0.1, 0.2), row("media", "b", 0.15, 0.25),
                       row("media", "c", 0.3, 0.2), row("frames", "d", 0, 0)});
  ASSERT_EQ(lines.size(), 2u);
  EXPECT_EQ(lines[0],
            "media         3 rows, 1 outside; closest to its bound: b by view, 0.15 of 0.25");
  EXPECT_EQ(lines[1], "frames        1 rows, 0 outside");
}

TEST(Stability, RowsAreChosenByTheirNames) {
  const std::string slab =
      "[[case]]\nname = \"a\"\nhard = \"-\"\ntrace = \"slab_radiance\"\nslab = { g = 0 }\n"
      "set = [\"estimator.photons=1000\"]\nestimators = [\"view\"]\n"
      "oracle = { kind = \"table\" }\nbound = 1e-9\n";
  const auto rows = rowsOf(slab, {"a_tau2_albedo0.9"});
  ASSERT_EQ(rows.size(), 1u);
  EXPECT_EQ(rows[0].name, "a_tau2_albedo0.9");
  EXPECT_FALSE(rows[0].passed);
  EXPECT_TRUE(rowsOf(slab, {"a_tau8"}).empty());  // not in the small size
  EXPECT_NE(complaintAbout(slab, {"a_tau3"}).find("no hard case has a name that begins so"),
            std::string::npos);
  EXPECT_NE(complaintAbout(slab, {"b"}).find("no hard case has a name that begins so"),
            std::string::npos);
}

}  // namespace
}  // namespace photosphere::study
