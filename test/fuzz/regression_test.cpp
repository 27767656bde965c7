// Inputs that once found something, kept in regressions/<target>/. Each is named after what it
// found.

#include <gtest/gtest.h>

#include <filesystem>

#include "trial.h"

namespace photosphere::fuzz {
namespace {

namespace fs = std::filesystem;

TEST(Regressions, NoneComesBack) {
  const test::TemporaryFolder folder;
  const fs::path root = test::projectFile("test/fuzz/regressions");
  int inputs = 0;
  for (const auto& entry : fs::recursive_directory_iterator(root)) {
    if (!entry.is_regular_file()) continue;
    const std::string name = entry.path().parent_path().filename().string();
    const Target* target = findTarget(name);
    ASSERT_NE(target, nullptr) << name;
    attempt(*target, test::readText(entry.path()), entry.path().string(), folder);
    ++inputs;
  }
  EXPECT_GT(inputs, 0) << root;
}

}  // namespace
}  // namespace photosphere::fuzz
