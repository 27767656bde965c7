// What frames say in their headers.

#include "photosphere/image/exr_attributes.h"

#include <gtest/gtest.h>

#include <cctype>

#include "photosphere/core/version.h"
#include "photosphere/image/exr.h"
#include "support/support.h"

namespace photosphere::image {
namespace {

TimeCode code(std::int64_t frame, const Rational& rate) {
  const auto result = timeCodeFromFrame(frame, rate);
  EXPECT_TRUE(result.has_value());
  return result.value_or(TimeCode{});
}

TEST(TimeCode, countsTwentyFourFramesASecondAt24AndAt23_976) {
  const std::int64_t frame = 24 * 3661 + 5;
  const TimeCode expected{1, 1, 1, 5, false, false};
  EXPECT_EQ(code(frame, {24, 1}), expected);
  EXPECT_EQ(code(frame, {24000, 1001}), expected);
  EXPECT_EQ(code(0, {24, 1}), TimeCode{});
  EXPECT_EQ(code(23, {24000, 1001}), (TimeCode{0, 0, 0, 23, false, false}));
}

TEST(TimeCode, wrapsAtMidnightInBothDirections) {
  EXPECT_EQ(code(-1, {25, 1}), (TimeCode{23, 59, 59, 24, false, false}));
  EXPECT_EQ(code(25 * 86400 + 1, {25, 1}), (TimeCode{0, 0, 0, 1, false, false}));
}

TEST(TimeCode, fastRatesCountPairs) {
  EXPECT_EQ(code(60 + 59, {60, 1}), (TimeCode{0, 0, 1, 29, false, true}));
  EXPECT_EQ(code(60 + 58, {60000, 1001}), (TimeCode{0, 0, 1, 29, false, false}));
  EXPECT_FALSE(timeCodeFromFrame(1, {120, 1}).has_value());
  EXPECT_FALSE(timeCodeFromFrame(1, {24, 0}).has_value());
}

TEST(FrameRate, roundedRatesBecomeExact) {
  EXPECT_EQ(exactFrameRate(23.976), (Rational{24000, 1001}));
  EXPECT_EQ(exactFrameRate(24000.0 / 1001.0), (Rational{24000, 1001}));
  EXPECT_EQ(exactFrameRate(24.0), (Rational{24, 1}));
  EXPECT_EQ(exactFrameRate(29.97), (Rational{30000, 1001}));
  EXPECT_EQ(exactFrameRate(12.5), (Rational{25, 2}));
}

TEST(FrameMetadata, standardAttributesReachTheFile) {
  const test::TemporaryFolder folder;
  FrameMetadata metadata;
  // Camera at (1, 2, 3) that looks along +Z: world to camera is a shift.
  Mat4d worldToCamera(1.0);
  worldToCamera[3] = glm::dvec4(-1, -2, -3, 1);
  // Perspective with a half-angle whose tangent is 0.5: x / (0.5 z).
  Mat4d ndcFromCamera(0.0);
  ndcFromCamera[0][0] = 2.0;
  ndcFromCamera[1][1] = 2.0;
  ndcFromCamera[2][2] = 1.0;
  ndcFromCamera[2][3] = 1.0;
  metadata.worldToCamera = worldToCamera;
  metadata.worldToNDC = ndcFromCamera * worldToCamera;
  metadata.framesPerSecond = 23.976;
  metadata.frame = 1001;
  metadata.capDate = "2024:02:29 12:34:56";
  metadata.comments = "wedge 3";
  metadata.photosphere["seed"] = "7";
  Image image(4, 4);
  image.addLayer("", ChannelKind::color);
  writeExr(folder / "a.exr", image, frameAttributes(metadata));
  const ExrAttributes read = readExr(folder / "a.exr").attributes;

  // A point two units ahead of the camera and half a unit right: x / (0.5 z) = 0.5.
  const auto& worldToNDC = std::get<Mat4d>(read.at("worldToNDC"));
  const glm::dvec4 projected = worldToNDC * glm::dvec4(1.5, 2, 5, 1);
  EXPECT_NEAR(projected.x / projected.w, 0.5, 1e-6);
  EXPECT_NEAR(projected.y / projected.w, 0.0, 1e-6);
  EXPECT_EQ(std::get<Mat4d>(read.at("worldToCamera")), worldToCamera);
  EXPECT_EQ(std::get<Rational>(read.at("framesPerSecond")), (Rational{24000, 1001}));
  EXPECT_EQ(std::get<TimeCode>(read.at("timeCode")), (TimeCode{0, 0, 41, 17, false, false}));
  EXPECT_EQ(std::get<std::string>(read.at("capDate")), "2024:02:29 12:34:56");
  EXPECT_EQ(std::get<float>(read.at("utcOffset")), 0.0f);
  EXPECT_EQ(std::get<std::string>(read.at("Software")), versionText());
  EXPECT_EQ(std::get<std::string>(read.at("comments")), "wedge 3");
  EXPECT_EQ(std::get<std::string>(read.at("photosphere:seed")), "7");
}

TEST(FrameMetadata, whatIsNotKnownIsNotWritten) {
  const ExrAttributes attributes = frameAttributes({});
  EXPECT_EQ(attributes.size(), 1u);
  EXPECT_TRUE(attributes.count("Software"));
}

TEST(FrameMetadata, capDateHasTheFormatOfTheStandard) {
  const std::string date = currentCapDate();
  const std::string pattern = "dddd:dd:dd dd:dd:dd";
  ASSERT_EQ(date.size(), pattern.size());
  for (std::size_t i = 0; i < date.size(); ++i) {
    const bool digit = std::isdigit(static_cast<unsigned char>(date[i])) != 0;
    EXPECT_TRUE(pattern[i] == 'd' ? digit : date[i] == pattern[i]) << date;
  }
}

}  // namespace
}  // namespace photosphere::image
