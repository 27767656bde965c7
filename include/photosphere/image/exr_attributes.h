#pragma once
// What an EXR header says beside its channels, and the set that every frame of this tool carries.

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <variant>

#include "photosphere/core/types.h"

namespace photosphere::image {

/// A ratio, such as frames a second. `denominator` 0 is not written.
struct Rational {
  std::int32_t numerator = 0;
  std::uint32_t denominator = 1;
  bool operator==(const Rational&) const = default;
};

/// CIE 1931 x, y of the primaries and the white point of an RGB space.
struct Chromaticities {
  Vec2f red{0.0f};
  Vec2f green{0.0f};
  Vec2f blue{0.0f};
  Vec2f white{0.0f};
  bool operator==(const Chromaticities&) const = default;
};

/// SMPTE ST 12-1 time of a frame. Rates above 30 count pairs of frames; `fieldPhase` marks the
/// second of a pair.
struct TimeCode {
  int hours = 0;
  int minutes = 0;
  int seconds = 0;
  int frame = 0;
  bool dropFrame = false;
  bool fieldPhase = false;
  bool operator==(const TimeCode&) const = default;
};

/// One value. A Mat4d takes column vectors, as everywhere in this project; the file holds its
/// transpose in single precision, since OpenEXR matrices take row vectors.
using ExrAttribute = std::variant<std::string, std::int32_t, float, double, Vec2f, Vec3f, Mat4d,
                                  Rational, Chromaticities, TimeCode>;
using ExrAttributes = std::map<std::string, ExrAttribute>;

/// What a frame's header says about how it was made.
struct FrameMetadata {
  /// World to RenderMan camera space (left-handed, +Z forward).
  std::optional<Mat4d> worldToCamera;
  /// World to the screen; after the division by w, x and y in [-1, 1] over the screen window.
  std::optional<Mat4d> worldToNDC;
  std::optional<Chromaticities> chromaticities;  ///< of the rendering space; see ColorConfig
  double framesPerSecond = 0;                    ///< 0: neither rate nor time code is written
  std::optional<std::int64_t> frame;             ///< gives the time code
  std::string capDate;                           ///< `YYYY:MM:DD hh:mm:ss`, UTC; see currentCapDate
  std::string software;                          ///< empty: versionText()
  std::string comments;
  /// Written as `photosphere:key`.
  std::map<std::string, std::string> photosphere;
};

/// The attributes of a frame under their standard names.
ExrAttributes frameAttributes(const FrameMetadata& metadata);

/// The exact rate for a rounded one: 23.976 and 24000/1001 give 24000/1001, 25 gives 25/1.
Rational exactFrameRate(double framesPerSecond);

/// Time code of a frame that counts from 0 at midnight, without dropped numbers: a 24000/1001
/// sequence counts 24 frames a second. Frames before 0 and past a day wrap.
/// @return nothing when a rate below 0.5 or above 60 frames a second has no time code
std::optional<TimeCode> timeCodeFromFrame(std::int64_t frame, const Rational& framesPerSecond);

/// Now, as `YYYY:MM:DD hh:mm:ss` in UTC.
std::string currentCapDate();

}  // namespace photosphere::image
