#include "photosphere/image/exr_attributes.h"

#include <OpenEXR/ImfFramesPerSecond.h>

#include <chrono>
#include <cmath>
#include <ctime>

#include "photosphere/core/version.h"

namespace photosphere::image {

ExrAttributes frameAttributes(const FrameMetadata& metadata) {
  ExrAttributes attributes;
  if (metadata.worldToCamera) attributes["worldToCamera"] = *metadata.worldToCamera;
  if (metadata.worldToNDC) attributes["worldToNDC"] = *metadata.worldToNDC;
  if (metadata.chromaticities) attributes["chromaticities"] = *metadata.chromaticities;
  if (metadata.framesPerSecond > 0) {
    const Rational rate = exactFrameRate(metadata.framesPerSecond);
    attributes["framesPerSecond"] = rate;
    if (metadata.frame)
      if (const auto timeCode = timeCodeFromFrame(*metadata.frame, rate))
        attributes["timeCode"] = *timeCode;
  }
  if (!metadata.capDate.empty()) {
    attributes["capDate"] = metadata.capDate;
    attributes["utcOffset"] = 0.0f;  // the date above is UTC
  }
  attributes["Software"] = metadata.software.empty() ? versionText() : metadata.software;
  if (!metadata.comments.empty()) attributes["comments"] = metadata.comments;
  for (const auto& [key, value] : metadata.photosphere)
    attributes["photosphere:" + key] = value;
  return attributes;
}

Rational exactFrameRate(double framesPerSecond) {
  const Imf::Rational rate = Imf::guessExactFps(framesPerSecond);
  return {rate.n, rate.d};
}

std::optional<TimeCode> timeCodeFromFrame(std::int64_t frame, const Rational& framesPerSecond) {
  if (framesPerSecond.denominator == 0) return std::nullopt;
  const double rate = static_cast<double>(framesPerSecond.numerator) / framesPerSecond.denominator;
  if (!(rate >= 0.5 && rate < 60.5)) return std::nullopt;
  const auto perSecond = static_cast<std::int64_t>(std::lround(rate));
  const std::int64_t perDay = perSecond * 86400;
  const std::int64_t inDay = ((frame % perDay) + perDay) % perDay;
  const std::int64_t second = inDay / perSecond;
  const std::int64_t rest = inDay % perSecond;
  TimeCode code;
  code.hours = static_cast<int>(second / 3600);
  code.minutes = static_cast<int>(second / 60 % 60);
  code.seconds = static_cast<int>(second % 60);
  // Two binary-coded digits hold frames up to 29 (39 in the bits): faster rates number pairs.
  const bool pairs = perSecond > 30;
  code.frame = static_cast<int>(pairs ? rest / 2 : rest);
  code.fieldPhase = pairs && rest % 2 == 1;
  return code;
}

std::string currentCapDate() {
  const std::time_t now = std::chrono::system_clock::to_time_t(std::chrono::system_clock::now());
  std::tm parts{};
  gmtime_r(&now, &parts);
  char text[32];
  const std::size_t length = std::strftime(text, sizeof(text), "%Y:%m:%d %H:%M:%S", &parts);
  return {text, length};
}

}  // namespace photosphere::image
