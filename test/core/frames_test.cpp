#include "photosphere/core/frames.h"

#include <gtest/gtest.h>

#include "photosphere/core/error.h"
#include "support/support.h"

namespace photosphere::test {

namespace {

using Frames = std::vector<std::int64_t>;

TEST(Frames, ReadsEveryForm) {
  EXPECT_EQ(parseFrames("7"), Frames({7}));
  EXPECT_EQ(parseFrames("1-5"), Frames({1, 2, 3, 4, 5}));
  EXPECT_EQ(parseFrames("1-6x2"), Frames({1, 3, 5}));
  EXPECT_EQ(parseFrames("1-5y2"), Frames({2, 4}));
  EXPECT_EQ(parseFrames("3,4,10-14x2"), Frames({3, 4, 10, 12, 14}));
  EXPECT_EQ(parseFrames("5-1"), Frames({5, 4, 3, 2, 1}));
  EXPECT_EQ(parseFrames("-10--8"), Frames({-10, -9, -8}));
  EXPECT_EQ(parseFrames("1-3, 2-4"), Frames({1, 2, 3, 4}));
  EXPECT_EQ(parseFrames(" 1 - 3 , 5 "), Frames({1, 2, 3, 5}));
}

TEST(Frames, RefusesEverythingElse) {
  for (const char* text :
       {"", "a", "1-", "1-5x0", "1-5x", "1:5", "1-5z2", "1,,2", "1-99999999999",
        "-9223372036854775808", "-9223372036854775808-5", "1-3 5", "1 2", "1-5y1"})
    EXPECT_THROW(parseFrames(text), ConfigError) << text;
}

TEST(Frames, FormatReadsBackAndNeverHoldsAColon) {
  for (const Frames& frames : {Frames{1, 2, 3}, Frames{5, 4, 3}, Frames{1, 3, 5, 7}, Frames{2},
                               Frames{-3, -2, 9, 20, 30}}) {
    const std::string text = formatFrames(frames);
    EXPECT_EQ(text.find(':'), std::string::npos);
    EXPECT_EQ(parseFrames(text), frames) << text;
  }
}

TEST(Frames, PathsTakeEveryToken) {
  EXPECT_EQ(framePath("a.####.exr", 7), "a.0007.exr");
  EXPECT_EQ(framePath("a.#.exr", 7), "a.0007.exr");
  EXPECT_EQ(framePath("a.##.exr", 123), "a.123.exr");
  EXPECT_EQ(framePath("a.%04d.exr", 7), "a.0007.exr");
  EXPECT_EQ(framePath("a.%d.exr", 7), "a.7.exr");
  EXPECT_EQ(framePath("a.$F4.exr", 7), "a.0007.exr");
  EXPECT_EQ(framePath("a.####.exr", -10), "a.-0010.exr");
  EXPECT_EQ(framePath("plain.exr", 3), "plain.exr");
  EXPECT_FALSE(hasFrameToken("plain.exr"));
}

// A folder's name may look like a token.
TEST(Frames, FoldersThatAreThereHaveNoToken) {
  const TemporaryFolder folder;
  std::filesystem::create_directories(folder / "take#2/v%03d");
  const std::string there = (folder / "take#2/v%03d/").string();
  EXPECT_FALSE(hasFrameToken(there + "smoke.vdb"));
  EXPECT_EQ(framePath(there + "smoke.vdb", 7), there + "smoke.vdb");
  EXPECT_EQ(framePath(there + "smoke.##.vdb", 7), there + "smoke.07.vdb");
  writeText(folder / "take#2/v%03d/smoke.07.vdb", "");
  EXPECT_EQ(findFrames(there + "smoke.##.vdb"), Frames({7}));
  const std::string each = (folder / "frame.####/smoke.vdb").string();
  EXPECT_EQ(framePath(each, 7), (folder / "frame.0007/smoke.vdb").string());
}

TEST(Frames, FindsWhatIsThere) {
  const TemporaryFolder folder;
  for (const char* name :
       {"s.0001.vdb", "s.0030.vdb", "s.0004.vdb", "s.x.vdb", "t.0002.vdb", "s.12.vdb"})
    writeText(folder / name, "");
  EXPECT_EQ(findFrames((folder / "s.####.vdb").string()), Frames({1, 4, 30}));
}

TEST(Frames, MissesThoseThatTheirStepWouldReach) {
  const auto missing = [](const std::string& there) {
    return formatFrames(missingFrames(parseFrames(there)));
  };
  EXPECT_EQ(missing("1,2,5"), "3-4");
  EXPECT_EQ(missing("-2,0,4,10"), "2,6,8");
  for (const char* whole : {"7", "1-5", "1-9x2", "3,90"})
    EXPECT_EQ(missing(whole), "") << whole;
  EXPECT_TRUE(missingFrames({}).empty());
  EXPECT_EQ(missingFrames({1, 2, 1'000'000'000}).size(), 100'000u);
}

TEST(Frames, HoldsBeyondTheCache) {
  std::int64_t mapped = 0;
  EXPECT_FALSE(mapFrame(11, 1, 10, CacheHold::clip, mapped));
  EXPECT_TRUE(mapFrame(11, 1, 10, CacheHold::extend, mapped));
  EXPECT_EQ(mapped, 10);
  EXPECT_TRUE(mapFrame(11, 1, 10, CacheHold::repeat, mapped));
  EXPECT_EQ(mapped, 1);
  EXPECT_TRUE(mapFrame(0, 1, 10, CacheHold::repeat, mapped));
  EXPECT_EQ(mapped, 10);
  EXPECT_TRUE(mapFrame(12, 1, 10, CacheHold::pingpong, mapped));
  EXPECT_EQ(mapped, 8);
  EXPECT_TRUE(mapFrame(5, 3, 3, CacheHold::pingpong, mapped));
  EXPECT_EQ(mapped, 3);
}

}  // namespace

}  // namespace photosphere::test
