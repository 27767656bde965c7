// Inputs that once found something, kept in regressions/<target>/. Each is named after what it
// found.

#include <gtest/gtest.h>

#include <filesystem>

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

}  // namespace
}  // namespace photosphere::fuzz
