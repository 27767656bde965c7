#pragma once
// Colour management: OpenColorIO behind names.

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "photosphere/core/types.h"
#include "photosphere/image/exr_attributes.h"

namespace photosphere::image {

/// The rendering space unless the scene names another.
inline constexpr std::string_view kDefaultRenderingSpace = "ACEScg";

/// Converts RGB between two spaces of a config. Thread-safe; cheap to copy.
class ColorConverter {
 public:
  struct Impl;
  explicit ColorConverter(std::shared_ptr<const Impl> impl) : m_impl(std::move(impl)) {}

  Rgb operator()(const Rgb& color) const;
  /// In place; `rgb` holds r, g, b, r, g, b...
  void apply(std::span<float> rgb) const;

 private:
  std::shared_ptr<const Impl> m_impl;
};

/// An OpenColorIO config. Thread-safe; cheap to copy.
class ColorConfig {
 public:
  /// Loads `optionPath` where given, else what `$OCIO` names, else the config shipped with this
  /// tool.
  /// @throws InputMissingError when that file is not there
  /// @throws InputError when OpenColorIO cannot read it
  /// @throws ConfigError for an `ocio://` name, which this version of OpenColorIO does not know
  static ColorConfig load(const std::string& optionPath = {});

  /// Path of the config file.
  const std::string& source() const;
  std::vector<std::string> colorSpaces() const;
  std::vector<std::string> displays() const;
  std::vector<std::string> views(const std::string& display) const;

  /// From one space, by name, alias or role, to another.
  /// @throws ConfigError that lists the spaces, or when the config has no way between them
  ColorConverter converter(const std::string& from, const std::string& to) const;
  /// From a space to what a display shows; empty names mean the config's defaults.
  /// @throws ConfigError that lists displays or views
  ColorConverter displayConverter(const std::string& from, const std::string& display,
                                  const std::string& view) const;

  /// Primaries and white of a linear space, known by its name or one of its aliases; nothing for a
  /// space that this table lacks. @throws ConfigError when the config has no such space
  std::optional<Chromaticities> chromaticities(const std::string& space) const;

 private:
  struct Impl;
  explicit ColorConfig(std::shared_ptr<const Impl> impl) : m_impl(std::move(impl)) {}
  std::shared_ptr<const Impl> m_impl;
};

/// Primaries and white of a linear space by the name or alias it has in ACES configs, whatever the
/// config; nothing for others.
std::optional<Chromaticities> knownChromaticities(std::string space);

/// The config shipped with this tool: `$PHOTOSPHERE_DATA/color/config.ocio`, else in the source
/// tree, else in `share/photosphere` of the installation. @throws InputMissingError naming every
/// place
std::string shippedColorConfig();

}  // namespace photosphere::image
