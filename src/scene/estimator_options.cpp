#include "estimator_options.h"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "photosphere/core/error.h"
#include "photosphere/estimators/layout_names.h"

namespace photosphere::scene {

using namespace estimators;

namespace {

// Min & Ihm 2010 as published; energy rule, kernel widths and radii are left open there, and have
// the values of README.md.
constexpr PresetValue kPaper[] = {
    {"carrier", "particles"}, {"basis", "histogram"},
    {"deposit", "collision"}, {"rows", "2"},
    {"direction", "nearest"}, {"representative", "bin"},
    {"energy", "scatter"},    {"merge", "sampled"},
    {"evaluate", "per_step"}, {"kernel", "gaussian"},
    {"bandwidth", "0.3"},     {"truncation", "3.0"},
    {"directions", "128"},    {"spatial_kernel", "epanechnikov"},
};
constexpr Preset kPresets[] = {
    {"paper", "the settings of Min & Ihm 2010, errata corrected", kPaper},
};

// The rows of [estimator] admit no other names.
template <class E>
E choice(const ParamValues& values, std::string_view key) {
  return named<E>(values.text(key)).value();
}

}  // namespace

std::span<const Preset> estimatorPresets() {
  return kPresets;
}

void applyPreset(ParamValues& estimator, const std::string& place) {
  const std::string& wished = estimator.text("preset");
  if (wished.empty()) return;
  std::vector<std::string_view> known;
  for (const Preset& preset : kPresets) {
    known.push_back(preset.name);
    if (wished != preset.name) continue;
    for (const PresetValue& value : preset.values)
      if (!estimator.given(value.key)) estimator.setText(value.key, value.value, place);
    return;
  }
  throw ConfigError(fmt::format("{}: preset = '{}' is unknown{} (known: {})", place, wished,
                                suggestion(wished, known), fmt::join(known, ", ")));
}

LightFieldLayout layoutOf(const ParamValues& e, bool lightCache) {
  LightFieldLayout l;
  l.carrier = choice<Carrier>(e, "carrier");
  l.deposit = choice<Deposit>(e, "deposit");
  l.energy = choice<EnergyRule>(e, "energy");
  l.kernel = choice<SpatialKernel>(e, "spatial_kernel");
  l.smoothing = choice<Smoothing>(e, "smoothing");
  l.direction = choice<sphere::DirectionDeposit>(e, "direction");
  l.representative = choice<Representative>(e, "representative");
  l.merge = choice<Merge>(e, "merge");
  l.evaluate = choice<Evaluate>(e, "evaluate");
  l.angularKernel = choice<sphere::AngularKernel>(e, "kernel");
  l.bandwidth = e.real("bandwidth");
  l.truncation = e.real("truncation");
  l.directions = static_cast<int>(e.integer("directions"));
  l.rows = static_cast<int>(e.integer("rows"));
  l.order = static_cast<int>(e.integer("order"));
  // Rays after the first bounce come from everywhere.
  if (e.integer("final_gather") > 0) l.evaluate = Evaluate::perStep;
  l.lightVoxel = e.real("light_voxel");
  const bool ofBins = l.direction != sphere::DirectionDeposit::nearest ||
                      l.representative != Representative::bin || l.merge != Merge::full ||
                      l.evaluate != Evaluate::perView ||
                      l.angularKernel != sphere::AngularKernel::none;
  const Basis automatic = lightCache || ofBins ? Basis::histogram : Basis::view;
  l.basis = named<Basis>(e.text("basis")).value_or(automatic);
  return l;
}

void checkEstimator(const ParamValues& e, const std::string& place) {
  const auto refuse = [&](bool wrong, std::string_view message) {
    if (wrong) throw ConfigError(fmt::format("{}: {}", place, message));
  };
  const bool cached = !e.text("cache").empty();
  const bool gathers = e.integer("final_gather") > 0;
  if (gathers && e.text("type") != "photosphere")
    throw ConfigError(
        fmt::format("{}: 'final_gather' looks the photosphere up; it needs type = "
                    "\"photosphere\", not \"{}\"",
                    place, e.text("type")));
  refuse(gathers && e.text("basis") == "view",
         "'final_gather' reads light toward every direction, and basis = \"view\" holds it toward "
         "one camera; choose \"histogram\" or \"spherical_harmonics\"");
  refuse(gathers && e.given("evaluate") && e.text("evaluate") == "per_view",
         "'final_gather' reads light toward every direction: leave 'evaluate' out, or set it to "
         "\"per_step\"");
  const LightFieldLayout layout = layoutOf(e, cached);
  refuse(e.real("deposit_radius") > 0 && !layout.holdsPower(),
         "'deposit_radius' needs carrier = \"particles\" and deposit = \"collision\"; elsewhere "
         "use 'radius'");
  if (cached && e.text("type") != "photosphere")
    throw ConfigError(
        fmt::format("{}: 'cache' needs type = \"photosphere\", not \"{}\"", place, e.text("type")));
  refuse(cached && e.text("basis") == "view",
         "basis = \"view\" holds light for one camera and is never cached; leave 'basis' at auto "
         "with a 'cache'");
  if (e.text("type") != "photosphere" || cached) return;  // the cache decides; see light_stage.cpp
  try {
    checkLayout(layout);
  } catch (const ConfigError& error) {
    throw ConfigError(fmt::format("{}: {}", place, error.what()));
  }
  if (!e.text("preset").empty()) return;  // it gives keys that another may leave without work
  const bool smooths = layout.angularKernel != sphere::AngularKernel::none;
  const ParamValues defaults(estimatorParams());
  const auto changed = [&](std::string_view key) { return e.format(key) != defaults.format(key); };
  refuse(!smooths && (changed("bandwidth") || changed("truncation")),
         "'bandwidth' and 'truncation' are those of 'kernel': set kernel = \"gaussian\" or "
         "\"epanechnikov\"");
  refuse(changed("directions") &&
             !(layout.merge == Merge::sampled && layout.evaluate == Evaluate::perStep),
         "'directions' are restored with merge = \"sampled\" and evaluate = \"per_step\" alone; "
         "elsewhere directions are integrated");
}

std::string describeLayout(const LightFieldLayout& l) {
  const std::string basis =
      l.basis == Basis::view ? "view"
      : l.basis == Basis::sphericalHarmonics
          ? fmt::format("{} spherical harmonics (order {})", l.bins(), l.order)
          : fmt::format("histogram of {} bins ({} rows)", l.bins(), l.rows);
  std::string text = fmt::format("{}, {}, {}, {} channel{}", nameOf(l.carrier), basis,
                                 nameOf(l.deposit), l.channels, l.channels == 1 ? "" : "s");
  if (l.holdsPower()) text += fmt::format(", {}", nameOf(l.energy));
  if (l.smoothing != Smoothing::twicing) text += fmt::format(", smoothing {}", nameOf(l.smoothing));
  if (l.direction != sphere::DirectionDeposit::nearest)
    text += fmt::format(", direction {}", nameOf(l.direction));
  if (l.representative != Representative::bin)
    text += fmt::format(", representative {}", nameOf(l.representative));
  if (l.merge != Merge::full) text += fmt::format(", merge {}", nameOf(l.merge));
  if (l.evaluate != Evaluate::perView) text += fmt::format(", evaluate {}", nameOf(l.evaluate));
  if (l.angularKernel != sphere::AngularKernel::none)
    text += fmt::format(", kernel {} of bandwidth {} cut at {}", nameOf(l.angularKernel),
                        l.bandwidth, l.truncation);
  if (l.merge == Merge::sampled && l.evaluate == Evaluate::perStep)
    text += fmt::format(", {} restored directions", l.directions);
  return text;
}

}  // namespace photosphere::scene
