// A frame that shows nothing says why.

#include "fixture.h"

namespace photosphere::test {
namespace {

using namespace scene;

struct BlackRow {
  const char* label;
  std::vector<std::string> sets;
  const char* why;  // part of the one warning; empty where there is none
};
void PrintTo(const BlackRow& row, std::ostream* out) {
  *out << row.label;
}

class BlackFrame : public ::testing::TestWithParam<BlackRow> {
 protected:
  FrameResult render(const std::vector<std::string>& sets) {
    const std::string path = (m_folder / "ball.vdb").string();
    volume::writeVdb(
        path, {ballGrid("density", Vec3d(0.0), 0.1), ballGrid("none", Vec3d(0.0), 0.1, 0.0f)});
    std::vector<std::string> all{"camera.resolution=[8, 8]", "estimator.photons=500"};
    all.insert(all.end(), sets.begin(), sets.end());
    return renderScene(parseScene(ballScene(path, Vec3d(0), 1), "test.toml", m_folder.path(), all),
                       1);
  }

  TemporaryFolder m_folder;
};

TEST_P(BlackFrame, SaysWhy) {
  const FrameResult r = render(GetParam().sets);
  const std::string why = GetParam().why;
  EXPECT_EQ(r.statistics.imageMax > 0, why.empty());
  ASSERT_EQ(r.warnings.size(), why.empty() ? 0u : 1u);
  for (const std::string& warning : r.warnings)
    EXPECT_TRUE(contains(warning, "the frame is black: " + why)) << warning;
}

const BlackRow kBlackRows[] = {
    {"Lit", {}, ""},
    {"EmptyGrid", {"volume.0.density=none"}, "no volume holds smoke at this frame"},
    {"DensityScaleZero", {"volume.0.density_scale=0"}, "no volume holds smoke at this frame"},
    {"Near", {"camera.near=1e30"}, "no smoke is in view"},
    {"TurnedAway", {"camera.look_at=[0, 0, 20]"}, "no smoke is in view"},
    {"NoLight", {"light=[]"}, "there is no light"},
    {"DarkLight", {"light.0.intensity=0"}, "no light shines on the smoke"},
    {"SpotThatMisses", {"light.0.target=[30, 40, 20]"}, "no light shines on the smoke"},
    {"Soot", {"volume.0.albedo=0"}, "the smoke only absorbs"},
    {"ScatteringOff",
     {"effects.single_scattering=off", "effects.multiple_scattering=off"},
     "effects.single_scattering is off"},
};
INSTANTIATE_TEST_SUITE_P(Table, BlackFrame, ::testing::ValuesIn(kBlackRows),
                         [](const auto& test) { return std::string(test.param.label); });

}  // namespace
}  // namespace photosphere::test
