// photosphere compare: error metrics on linear pixels.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "command.h"
#include "job_files.h"
#include "number_check.h"
#include "photosphere/core/error.h"
#include "photosphere/core/log.h"
#include "photosphere/image/exr.h"
#include "photosphere/image/metrics.h"
#include "print.h"

namespace photosphere::cli::plugins {

namespace {

struct CompareArguments {
  std::string image, reference, secondReference, errorMap;
  std::vector<std::string> layers;
  std::optional<double> tolerance;
  bool json = false, allowCrop = false;
};

/// JSON has no infinities and no NaN.
nlohmann::ordered_json number(double value) {
  if (std::isfinite(value)) return value;
  return nullptr;
}

nlohmann::ordered_json toJson(const image::ErrorMetrics& m) {
  return {{"rel_mse", number(m.relMse)},
          {"relative_error", number(m.relativeError)},
          {"reference_noise", number(m.referenceNoise)},
          {"unbiased_rel_mse", number(m.unbiasedRelMse)},
          {"rmse", number(m.rmse)},
          {"relative_l2", number(m.relativeL2)},
          {"mean_image", number(m.meanImage)},
          {"mean_reference", number(m.meanReference)},
          {"mean_ratio", number(m.meanRatio)},
          {"max_difference", number(m.maxDifference)},
          {"worst_pixel", {m.worstPixel.x, m.worstPixel.y}},
          {"pixels", m.pixels},
          {"non_finite_image", m.nonFiniteImage},
          {"non_finite_reference", m.nonFiniteReference}};
}

void printText(const image::ImageComparison& comparison) {
  printLine("{:<16} {:>12} {:>12} {:>12} {:>12} {:>12}  worst pixel", "layer", "rel. error", "RMSE",
            "rel. L2", "mean ratio", "max diff");
  auto row = [](const std::string& name, const image::ErrorMetrics& m) {
    printLine("{:<16} {:>12.6g} {:>12.6g} {:>12.6g} {:>12.6g} {:>12.6g}  ({}, {})", name,
              m.relativeError, m.rmse, m.relativeL2, m.meanRatio, m.maxDifference, m.worstPixel.x,
              m.worstPixel.y);
    if (m.nonFiniteImage + m.nonFiniteReference > 0)
      printLine("{:<16} pixels not finite: {} in the image, {} in the reference", "",
                m.nonFiniteImage, m.nonFiniteReference);
  };
  for (const image::LayerComparison& layer : comparison.layers) {
    row(layer.layer, layer.all);
    if (layer.smokeOnly) row("  smoke only", *layer.smokeOnly);
  }
  if (!comparison.onlyInImage.empty())
    printLine("channels of the image alone: {}", fmt::join(comparison.onlyInImage, ", "));
  if (!comparison.onlyInReference.empty())
    printLine("channels of the reference alone: {}", fmt::join(comparison.onlyInReference, ", "));
}

void printJson(const image::ImageComparison& comparison, const CompareArguments& options,
               bool within) {
  nlohmann::ordered_json layers = nlohmann::ordered_json::object();
  for (const image::LayerComparison& layer : comparison.layers) {
    layers[layer.layer] = {{"all", toJson(layer.all)}};
    if (layer.smokeOnly) layers[layer.layer]["smoke_only"] = toJson(*layer.smokeOnly);
  }
  nlohmann::ordered_json root{{"image", options.image},
                              {"reference", options.reference},
                              {"layers", std::move(layers)},
                              {"only_in_image", comparison.onlyInImage},
                              {"only_in_reference", comparison.onlyInReference}};
  if (options.tolerance) {
    root["tolerance"] = *options.tolerance;
    root["within_tolerance"] = within;
  }
  printLine("{}", root.dump(2, ' ', false, nlohmann::json::error_handler_t::replace));
}

void keepLayers(image::ImageComparison& comparison, const std::vector<std::string>& wanted) {
  if (wanted.empty()) return;
  std::vector<std::string> names;
  for (const image::LayerComparison& layer : comparison.layers)
    names.push_back(layer.layer);
  for (const std::string& name : wanted)
    if (std::find(names.begin(), names.end(), name) == names.end())
      throw ConfigError(fmt::format("--layer: the images do not share a layer '{}' (shared: {})",
                                    name, fmt::join(names, ", ")));
  std::erase_if(comparison.layers, [&](const image::LayerComparison& layer) {
    return std::find(wanted.begin(), wanted.end(), layer.layer) == wanted.end();
  });
}

/// Each pixel's share of the relative error: |d| / sqrt(ref^2 + (0.1 mean ref)^2), whose mean
/// square is relMSE.
void writeErrorMap(const std::string& path, const image::Image& test, const image::Image& reference,
                   const image::ImageComparison& comparison) {
  const image::Window window = comparison.window;
  image::Image map(window, reference.displayWindow());
  for (const image::LayerComparison& layer : comparison.layers)
    for (const image::Layer& channels : reference.layers()) {
      if (channels.name != layer.layer) continue;
      const double floor = 0.1 * layer.all.meanReference;
      for (const std::size_t c : channels.channels) {
        const std::string& name = reference.channels()[c].name;
        const std::span<const float> a = test.channel(name), b = reference.channel(name);
        const std::span<float> out = map.addChannel(name, image::ChannelKind::data);
        for (int y = window.y; y < window.y + window.height; ++y)
          for (int x = window.x; x < window.x + window.width; ++x) {
            const double ref = b[reference.index(x, y)];
            const double d = std::abs(a[test.index(x, y)] - ref);
            const double relative = d == 0 ? 0 : d / std::sqrt(ref * ref + floor * floor);
            out[map.index(x, y)] = std::isnan(relative) ? kInfinity : static_cast<float>(relative);
          }
      }
    }
  image::writeExr(path, map);
}

bool withinTolerance(const image::ImageComparison& comparison, const CompareArguments& options) {
  bool within = true;
  for (const image::LayerComparison& layer : comparison.layers) {
    const image::ErrorMetrics& m = layer.all;
    const bool finite = m.nonFiniteImage + m.nonFiniteReference == 0;
    if (finite && m.relativeError <= *options.tolerance) continue;
    within = false;
    log::error("layer {}: relative error {:.6g} {}", layer.layer, m.relativeError,
               finite ? fmt::format("is above the tolerance {:g}", *options.tolerance)
                      : std::string("leaves out pixels that are not finite"));
  }
  return within;
}

int runCompare(const CompareArguments& options) {
  JobFiles files;
  files.reads("IMAGE", options.image);
  files.reads("REFERENCE", options.reference);
  files.reads("--second-reference", options.secondReference);
  files.writes("--error-map", options.errorMap);
  const image::Image test = image::readExr(options.image).image;
  const image::Image reference = image::readExr(options.reference).image;
  std::optional<image::Image> second;
  if (!options.secondReference.empty()) second = image::readExr(options.secondReference).image;
  image::ImageComparison comparison = image::compareImages(
      test, reference,
      {.allowCrop = options.allowCrop, .secondReference = second ? &*second : nullptr});
  keepLayers(comparison, options.layers);
  if (!options.errorMap.empty()) writeErrorMap(options.errorMap, test, reference, comparison);
  if (!options.json) printText(comparison);
  const bool within = !options.tolerance || withinTolerance(comparison, options);
  if (options.json) printJson(comparison, options, within);
  return static_cast<int>(within ? ExitCode::ok : ExitCode::accuracy);
}

std::function<int()> declareCompare(CLI::App& app) {
  auto options = std::make_shared<CompareArguments>();
  app.add_option("IMAGE", options->image, "Image to judge")->type_name("A.exr")->required();
  app.add_option("REFERENCE", options->reference, "Image that is right")
      ->type_name("B.exr")
      ->required();
  app.add_option("--second-reference", options->secondReference,
                 "Independent, equally noisy reference: their mean is compared with, their noise "
                 "subtracted")
      ->type_name("C.exr");
  app.add_option("--tolerance", options->tolerance,
                 "Largest relative error, sqrt(relMSE), of any layer; past it exit 7 [none]")
      ->check(finiteNumber({.least = 0}))
      ->type_name("E");
  app.add_option("--layer", options->layers, "Only this layer, such as RGB or single; repeatable")
      ->type_name("NAME")
      ->allow_extra_args(false);
  app.add_flag("--allow-crop", options->allowCrop, "Compare where the data windows overlap");
  app.add_option("--error-map", options->errorMap, "EXR of each pixel's relative error")
      ->type_name("OUT.exr");
  app.add_flag("--json", options->json, "Metrics as JSON");
  return [options] { return runCompare(*options); };
}

}  // namespace

extern const Command compare;
const Command compare = {"compare", "Measure the error of an image against a reference",
                         declareCompare};

}  // namespace photosphere::cli::plugins
