// Inputs that once found something, kept in regressions/<target>/. Each is named after what it
// found.

#include <gtest/gtest.h>

#include <filesystem>

#include "photosphere/core/error.h"
#include "trial.h"

namespace photosphere::fuzz {
namespace {

namespace fs = std::filesystem;

TEST(Regressions, NoneComesBack) {
  int inputs = 0;
  for (const auto& entry :
       fs::recursive_directory_iterator(test::projectFile("test/fuzz/regressions"))) {
    if (!entry.is_regular_file()) continue;
    const std::string name = entry.path().parent_path().filename().string();
    const Target* target = findTarget(name);
    ASSERT_NE(target, nullptr) << name;
    attempt(
        *target, 1, [&](std::size_t) { return test::readText(entry.path()); },
        [&](std::size_t) { return entry.path().string(); });
    ++inputs;
  }
  EXPECT_GT(inputs, 0);
}

// Too long to be kept as a file.
TEST(Regressions, StatisticsWithinStatisticsAreRefused) {
  const test::TemporaryFolder folder;
  const std::string deep(300'000, '[');
  try {
    findTarget("stats")->read(
        "[{\"frame\": 1, \"a\": " + deep + std::string(deep.size(), ']') + "}]", folder.path());
    ADD_FAILURE() << "read";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("values within values"), std::string::npos)
        << error.what();
  }
}

}  // namespace
}  // namespace photosphere::fuzz
