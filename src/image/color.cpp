#include "photosphere/image/color.h"

#include <OpenColorIO/OpenColorIO.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdlib>
#include <filesystem>

#include "photosphere/core/error.h"
#include "photosphere/core/exhaustion.h"
#include "photosphere/core/log.h"
#include "photosphere/core/shipped_data.h"

namespace photosphere::image {

namespace OCIO = OCIO_NAMESPACE;
namespace fs = std::filesystem;

struct ColorConverter::Impl {
  OCIO::ConstCPUProcessorRcPtr processor;
};

struct ColorConfig::Impl {
  OCIO::ConstConfigRcPtr config;
  std::string source;

  void requireSpace(const std::string& name) const;
};

namespace {

struct NamedChromaticities {
  std::string_view name;
  Chromaticities value;
};

constexpr Vec2f kD65{0.3127f, 0.3290f};
// SMPTE ST 2065-1 and ACES S-2014-004 give the ACES white, near D60.
constexpr Vec2f kAcesWhite{0.32168f, 0.33767f};
const Chromaticities kAp0{{0.7347f, 0.2653f}, {0.0f, 1.0f}, {0.0001f, -0.077f}, kAcesWhite};
const Chromaticities kAp1{{0.713f, 0.293f}, {0.165f, 0.83f}, {0.128f, 0.044f}, kAcesWhite};
const Chromaticities kRec709{{0.64f, 0.33f}, {0.30f, 0.60f}, {0.15f, 0.06f}, kD65};
const Chromaticities kRec2020{{0.708f, 0.292f}, {0.170f, 0.797f}, {0.131f, 0.046f}, kD65};
const Chromaticities kP3D65{{0.680f, 0.320f}, {0.265f, 0.690f}, {0.150f, 0.060f}, kD65};

// Names and aliases of linear spaces in the ACES CG and Studio configs and in older ACES configs.
const std::array<NamedChromaticities, 19> kKnownSpaces{{
    {"acescg", kAp1},
    {"lin_ap1", kAp1},
    {"aces - acescg", kAp1},
    {"aces2065-1", kAp0},
    {"aces2065_1", kAp0},
    {"lin_ap0", kAp0},
    {"aces - aces2065-1", kAp0},
    {"lin_rec709", kRec709},
    {"lin_rec709_srgb", kRec709},
    {"lin_srgb", kRec709},
    {"linear rec.709 (srgb)", kRec709},
    {"utility - linear - rec.709", kRec709},
    {"utility - linear - srgb", kRec709},
    {"lin_rec2020", kRec2020},
    {"linear rec.2020", kRec2020},
    {"utility - linear - rec.2020", kRec2020},
    {"lin_p3d65", kP3D65},
    {"linear p3-d65", kP3D65},
    {"utility - linear - p3-d65", kP3D65},
}};

/// At most this many names in a message: studio configs have hundreds.
constexpr std::size_t kMostNames = 40;

std::string listNames(const std::vector<std::string>& names) {
  const std::size_t shown = std::min(names.size(), kMostNames);
  std::string text = fmt::format(
      "{}", fmt::join(names.begin(), names.begin() + static_cast<std::ptrdiff_t>(shown), ", "));
  if (shown < names.size()) text += fmt::format(" and {} more", names.size() - shown);
  return text;
}

ColorConverter makeConverter(const OCIO::ConstProcessorRcPtr& processor) {
  auto impl = std::make_shared<ColorConverter::Impl>();
  impl->processor = processor->getDefaultCPUProcessor();
  return ColorConverter(std::move(impl));
}

}  // namespace

std::optional<Chromaticities> knownChromaticities(std::string name) {
  std::transform(name.begin(), name.end(), name.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  for (const NamedChromaticities& known : kKnownSpaces)
    if (known.name == name) return known.value;
  return std::nullopt;
}

Rgb ColorConverter::operator()(const Rgb& color) const {
  Rgb result = color;
  m_impl->processor->applyRGB(&result.x);
  return result;
}

void ColorConverter::apply(std::span<float> rgb) const {
  if (rgb.size() < 3) return;
  OCIO::PackedImageDesc pixels(rgb.data(), static_cast<long>(rgb.size() / 3), 1, 3);
  m_impl->processor->apply(pixels);
}

std::string shippedColorConfig() {
  constexpr const char* kConfig = "color/config.ocio";
  if (const auto found = findShipped(kConfig)) return found->string();
  std::vector<std::string> places;
  for (const fs::path& place : shippedPlaces(kConfig))
    places.push_back(place.string());
  throw InputMissingError(
      kConfig,
      fmt::format("the colour config shipped with this tool is in none of {}; set PHOTOSPHERE_DATA "
                  "to the folder that holds color/, or give a config with --ocio",
                  listNames(places)));
}

ColorConfig ColorConfig::load(const std::string& optionPath) {
  std::string path = optionPath;
  std::string origin = "--ocio";
  if (path.empty()) {
    const char* environment = std::getenv("OCIO");
    path = environment ? environment : "";
    origin = "$OCIO";
  }
  if (path.empty()) {
    path = shippedColorConfig();
    origin = "the shipped config";
  }
  if (path.rfind("ocio://", 0) == 0)
    throw ConfigError(
        fmt::format("{}: '{}' needs OpenColorIO 2.2, this build has {}; name a config file, or "
                    "leave {} out for "
                    "the shipped config",
                    origin, path, OCIO::GetVersion(), origin));
  std::error_code error;
  if (!fs::is_regular_file(path, error))
    throw InputMissingError(
        path,
        fmt::format("no colour config is here (from {}); correct the path, or leave it out for "
                    "the shipped config",
                    origin));
  // OpenColorIO's own messages would go to standard error past the log.
  OCIO::SetLoggingFunction([](const char* message) { log::debug("{}", message); });
  try {
    auto impl = std::make_shared<Impl>();
    impl->config = OCIO::Config::CreateFromFile(path.c_str());
    impl->config->validate();
    impl->source = path;
    return ColorConfig(std::move(impl));
  } catch (const std::exception& failure) {
    // Nothing is wrong with the config.
    if (exhausted() != Resource::none) throw;
    if (failure.what() ==
        fmt::format("Error: Loading the OCIO profile '{}' failed. std::bad_alloc", path))
      throw std::bad_alloc();
    throw InputError(
        path, fmt::format("is not a colour config that OpenColorIO {} can use: {}; correct it, "
                          "or leave it out for the shipped config",
                          OCIO::GetVersion(), failure.what()));
  }
}

const std::string& ColorConfig::source() const {
  return m_impl->source;
}

std::vector<std::string> ColorConfig::colorSpaces() const {
  std::vector<std::string> names;
  for (int i = 0; i < m_impl->config->getNumColorSpaces(); ++i)
    names.emplace_back(m_impl->config->getColorSpaceNameByIndex(i));
  return names;
}

std::vector<std::string> ColorConfig::displays() const {
  std::vector<std::string> names;
  for (int i = 0; i < m_impl->config->getNumDisplays(); ++i)
    names.emplace_back(m_impl->config->getDisplay(i));
  return names;
}

std::vector<std::string> ColorConfig::views(const std::string& display) const {
  std::vector<std::string> names;
  for (int i = 0; i < m_impl->config->getNumViews(display.c_str()); ++i)
    names.emplace_back(m_impl->config->getView(display.c_str(), i));
  return names;
}

void ColorConfig::Impl::requireSpace(const std::string& name) const {
  if (config->getColorSpace(name.c_str())) return;
  std::vector<std::string> known;
  for (int i = 0; i < config->getNumColorSpaces(); ++i)
    known.emplace_back(config->getColorSpaceNameByIndex(i));
  throw ConfigError(fmt::format("{}: no color space '{}'; choose one of {}, or another config",
                                source, name, listNames(known)));
}

ColorConverter ColorConfig::converter(const std::string& from, const std::string& to) const {
  m_impl->requireSpace(from);
  m_impl->requireSpace(to);
  try {
    return makeConverter(m_impl->config->getProcessor(from.c_str(), to.c_str()));
  } catch (const std::exception& failure) {
    throw ConfigError(fmt::format("{}: cannot convert '{}' to '{}': {}", m_impl->source, from, to,
                                  failure.what()));
  }
}

ColorConverter ColorConfig::displayConverter(const std::string& from, const std::string& display,
                                             const std::string& view) const {
  m_impl->requireSpace(from);
  const auto contains = [](const std::vector<std::string>& names, const std::string& name) {
    return std::find(names.begin(), names.end(), name) != names.end();
  };
  const std::string chosen = display.empty() ? m_impl->config->getDefaultDisplay() : display;
  if (!contains(displays(), chosen))
    throw ConfigError(fmt::format("{}: no display '{}'; choose one of {}", m_impl->source, chosen,
                                  listNames(displays())));
  const std::string chosenView =
      view.empty() ? m_impl->config->getDefaultView(chosen.c_str()) : view;
  if (!contains(views(chosen), chosenView))
    throw ConfigError(fmt::format("{}: display '{}' has no view '{}'; choose one of {}",
                                  m_impl->source, chosen, chosenView, listNames(views(chosen))));
  try {
    return makeConverter(m_impl->config->getProcessor(
        from.c_str(), chosen.c_str(), chosenView.c_str(), OCIO::TRANSFORM_DIR_FORWARD));
  } catch (const std::exception& failure) {
    throw ConfigError(fmt::format("{}: cannot show '{}' on '{}', view '{}': {}", m_impl->source,
                                  from, chosen, chosenView, failure.what()));
  }
}

std::optional<Chromaticities> ColorConfig::chromaticities(const std::string& space) const {
  m_impl->requireSpace(space);
  const OCIO::ConstColorSpaceRcPtr found = m_impl->config->getColorSpace(space.c_str());
  if (auto known = knownChromaticities(found->getName())) return known;
  for (std::size_t i = 0; i < found->getNumAliases(); ++i)
    if (auto known = knownChromaticities(found->getAlias(i))) return known;
  return std::nullopt;
}

}  // namespace photosphere::image
