#include "photosphere/core/shipped_data.h"

#include <gtest/gtest.h>

#include <cstdlib>

#include "support/support.h"

namespace photosphere::test {
namespace {

namespace fs = std::filesystem;

TEST(ShippedData, TheEnvironmentGoesBeforeTheSourceTree) {
  TemporaryFolder folder;
  fs::create_directories(folder / "color");
  writeText(folder / "color/config.ocio", "");
  setenv("PHOTOSPHERE_DATA", folder.path().c_str(), 1);
  EXPECT_EQ(findShipped("color/config.ocio"), folder / "color/config.ocio");
  // What it lacks is found elsewhere.
  EXPECT_EQ(findShipped("reference/slab.csv"), projectFile("data/reference/slab.csv"));
  unsetenv("PHOTOSPHERE_DATA");
  EXPECT_EQ(findShipped("color/config.ocio"), projectFile("data/color/config.ocio"));
  EXPECT_FALSE(findShipped("nothing/of/that/name"));
}

}  // namespace
}  // namespace photosphere::test
