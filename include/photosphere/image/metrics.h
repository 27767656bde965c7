#pragma once
// Error metrics on linear pixels, defined once (METHOD section 7).

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "photosphere/image/image.h"

namespace photosphere::image {

/// Error of an image against a reference, over the pixels measured and their channels. With d =
/// image
/// - reference, and "mean" over those pixels and channels. Pixels with a value that is not finite
/// in either image count in the two fields for it and nowhere else.
struct ErrorMetrics {
  double rmse = 0;  ///< sqrt(mean d^2) [unit of the pixels]
  /// mean of d^2 / (ref^2 + (0.1 mean ref)^2). 0 / 0, where the reference is black, is 0.
  double relMse = 0;
  double relativeError = 0;  ///< sqrt(relMse)
  /// The part of relMse that the reference's own noise adds: its variance in place of d^2. 0 when
  /// the variance is not given.
  double referenceNoise = 0;
  /// relMse - referenceNoise: its expectation is that against a noiseless reference, up to the
  /// noise in the denominator. It may be negative where the two are close.
  double unbiasedRelMse = 0;
  double meanImage = 0;
  double meanReference = 0;
  double meanRatio = 0;                ///< meanImage / meanReference; 1 when both are 0
  double relativeL2 = 0;               ///< sqrt(sum d^2 / sum ref^2); 0 when both are 0
  double maxDifference = 0;            ///< largest |d|
  Vec2i worstPixel{0};                 ///< where it is, in display window coordinates
  std::size_t pixels = 0;              ///< measured
  std::size_t nonFiniteImage = 0;      ///< pixels
  std::size_t nonFiniteReference = 0;  ///< pixels
};

/// What to measure beside the two images.
struct MeasureOptions {
  std::span<const unsigned char> mask;  ///< one per pixel, 0 leaves it out; empty: all pixels
  /// Variance of each pixel value of the reference, planes as the reference's; empty: not known.
  std::vector<std::span<const float>> referenceVariance;
};

/// Measures planes of one size, 3 for colour or 1. Sums run in pixel order in double: the same bits
/// every time.
/// @param width  of the planes, for worstPixel, which counts from `origin`
/// @throws ConfigError when the planes differ in number or size
ErrorMetrics measure(const std::vector<std::span<const float>>& image,
                     const std::vector<std::span<const float>>& reference, int width,
                     Vec2i origin = Vec2i(0), const MeasureOptions& options = {});

/// Mean over pixels and channels of (a - ref)(b - ref) / (ref^2 + (0.1 mean ref)^2): relMse for
/// a = b. For two independent frames of one estimator its expectation is the squared bias, without
/// their noise. Pixels with a value that is not finite in any of the three are left out.
/// @throws ConfigError when the planes differ in number or size
double relativeProduct(const std::vector<std::span<const float>>& a,
                       const std::vector<std::span<const float>>& b,
                       const std::vector<std::span<const float>>& reference,
                       std::span<const unsigned char> mask = {});

/// Variance of the mean of two independent, equally noisy estimates, per pixel: (a - b)^2 / 4. With
/// reference (a + b) / 2, d^2 minus it is (x - a)(x - b), whose mean has no noise of the reference.
std::vector<float> varianceOfMean(std::span<const float> a, std::span<const float> b);

/// "Smoke only": 1 where the reference's mean transmittance is below 0.99, from its layer
/// `transmittance` or else from A = 1 - mean transmittance.
/// @return nothing when the reference has neither
std::optional<std::vector<unsigned char>> smokeMask(const Image& reference);

/// One layer of two images.
struct LayerComparison {
  std::string layer;
  ErrorMetrics all;
  std::optional<ErrorMetrics>
      smokeOnly;  ///< for colour, where the reference tells smoke from empty
};

struct ImageComparison {
  std::vector<LayerComparison> layers;   ///< in the reference's order
  std::vector<std::string> onlyInImage;  ///< channels
  std::vector<std::string> onlyInReference;
  Window window;  ///< the pixels compared
};

struct CompareOptions {
  bool allowCrop = false;  ///< compare where both data windows overlap; else they must be equal
  /// An independent estimate of the same truth, as noisy as the reference: the reference becomes
  /// the mean of both and its noise is subtracted in unbiasedRelMse. It needs the reference's
  /// windows.
  const Image* secondReference = nullptr;
};

/// Compares every layer that both images have. Of a depth (`Z`), pixels that are at 1e10 or beyond
/// in both, where neither met anything, are left out.
/// @throws ConfigError when windows do not match, or the images share no layer
ImageComparison compareImages(const Image& image, const Image& reference,
                              const CompareOptions& options = {});

}  // namespace photosphere::image
