// The table of phase functions as the scene parser sees it.
#include <cmath>

#include "photosphere/core/error.h"
#include "photosphere/core/registry.h"
#include "photosphere/phase/phase.h"
#include "support/support.h"

namespace photosphere::phase {
namespace {

TEST(PhaseTable, CreatesEveryModelWithItsDefaults) {
  for (const PhasePlugin* plugin : phaseFunctions()) {
    EXPECT_FALSE(plugin->help.empty()) << plugin->name;
    const PhaseFunction phase = plugin->create(ParamValues(plugin->params));
    EXPECT_GT(phase.maximum(), 1 / (4 * kPi) - 1e-8) << plugin->name;
  }
}

TEST(PhaseTable, TakesTheMeanCosineFromTheScene) {
  const PhasePlugin& plugin =
      findPlugin(phaseFunctions(), "henyey_greenstein", "phase function", "scene.toml:1");
  ParamValues values(plugin.params);
  values.set("g", -0.25, "scene.toml:2");
  EXPECT_EQ(plugin.create(values).plain()->g(), -0.25);
  EXPECT_THROW(values.set("g", 1.25, "scene.toml:2"), ConfigError);
  values.set("g", 1.0, "scene.toml:2");
  EXPECT_THROW(plugin.create(values), ConfigError);
}

TEST(PhaseTable, ListsTheKnownModelsForAnUnknownName) {
  try {
    findPlugin(phaseFunctions(), "mie", "phase function", "scene.toml:7");
    FAIL() << "accepted an unknown phase function";
  } catch (const ConfigError& error) {
    EXPECT_NE(std::string(error.what())
                  .find("isotropic, henyey_greenstein, double_henyey_greenstein, rayleigh, draine, "
                        "mie_fog"),
              std::string::npos);
  }
}

}  // namespace
}  // namespace photosphere::phase
