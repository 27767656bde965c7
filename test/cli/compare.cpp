// photosphere compare: figures that can be worked out by hand.

#include <nlohmann/json.hpp>

#include "fixture.h"

namespace photosphere::test {
namespace {

class Compare : public ::testing::Test {
 protected:
  void SetUp() override {
    image::Image reference(4, 2);
    reference.addLayer("", image::ChannelKind::color);
    for (int i = 0; i < 8; ++i)
      reference.setRgb("", i % 4, i / 4, Rgb(2.0f));
    image::writeExr(m_folder / "reference.exr", reference);
    reference.setRgb("", 3, 1, Rgb(3.0f));  // one pixel of eight is off by one
    image::writeExr(m_folder / "image.exr", reference);
  }
  RunResult compare(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {"compare", "image.exr", "reference.exr"});
    return runTool(arguments, m_folder.path());
  }
  TemporaryFolder m_folder;
};

TEST_F(Compare, MetricsAreThoseOfTheDefinition) {
  const RunResult result = compare({"--json"});
  ASSERT_EQ(result.exitCode, 0) << result.err;
  const auto metrics = nlohmann::json::parse(result.out).at("layers").at("RGB").at("all");
  EXPECT_NEAR(metrics.at("rel_mse").get<double>(), (1.0 / 8) / (4 + 0.2 * 0.2), 1e-9);
  EXPECT_NEAR(metrics.at("rmse").get<double>(), std::sqrt(1.0 / 8), 1e-9);
  EXPECT_NEAR(metrics.at("mean_ratio").get<double>(), 17.0 / 16, 1e-9);
  EXPECT_EQ(metrics.at("worst_pixel"), nlohmann::json({3, 1}));
}

TEST_F(Compare, ToleranceIsTheRootOfRelMse) {
  const double error = std::sqrt(1.0 / 8 / 4.04);  // 0.1759
  EXPECT_EQ(compare({"--tolerance", std::to_string(error * 1.001)}).exitCode, 0);
  EXPECT_EQ(compare({"--tolerance", std::to_string(error * 0.999)}).exitCode, 7);
  const RunResult json = compare({"--tolerance", "0.1", "--json"});
  EXPECT_EQ(json.exitCode, 7);
  EXPECT_EQ(nlohmann::json::parse(json.out).at("within_tolerance"), false);
}

TEST_F(Compare, ErrorMapShowsWhereTheErrorIs) {
  ASSERT_EQ(compare({"--error-map", "map.exr"}).exitCode, 0);
  const image::Image map = image::readExr(m_folder / "map.exr").image;
  EXPECT_NEAR(map.rgb("", 3, 1).r, 1 / std::sqrt(4.04), 1e-6);
  EXPECT_EQ(map.rgb("", 0, 0).g, 0.0f);
}

}  // namespace
}  // namespace photosphere::test
