#pragma once
// Pictures of a study: frames through the OCIO view, error maps as shades.

#include <string>
#include <vector>

#include "photosphere/image/color.h"
#include "photosphere/study/result.h"
#include "photosphere/study/study.h"

namespace photosphere::study {

/// What all pictures of a page share.
struct PictureSettings {
  image::ColorConfig config;
  std::string renderingSpace, display, view;
};

/// @throws what ColorConfig::load throws
PictureSettings pictureSettings(const RunFacts& facts, const StudyOptions& options);

/// The exposure [stops] that shows the 99th percentile of the reference's lit pixels as 0.7.
float exposureFor(const image::Image& reference);

/// PNG of layer total through the view.
std::string framePicture(const image::Image& frame, float exposure,
                         const PictureSettings& settings);

/// The relative error of a map's ends.
inline constexpr double kMapLimit = 0.5;
/// PNG of the signed relative error, mean of R, G, B: (x - ref) / sqrt(ref^2 + (0.1 mean ref)^2)
/// from -kMapLimit (black) over 0 (middle grey) to kMapLimit (white).
std::string errorMapPicture(const image::Image& frame, const image::Image& reference);
/// PNG of the map's scale, left to right.
std::string errorScalePicture(int width, int height);

}  // namespace photosphere::study
