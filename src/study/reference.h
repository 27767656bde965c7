#pragma once
// The truth of a scene, by paths from the eye or from the lamps: rendered in pairs of independent
// chunks, kept on disk after each, so that it can be interrupted, continued and reused.

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "photosphere/image/image.h"
#include "photosphere/scene/scene_file.h"
#include "photosphere/study/statistics.h"
#include "scene_source.h"

namespace photosphere::study {

/// The mean of all paths so far and the variance of that mean. A pair of chunks a and b adds
/// (a + b) / 2 with image::varianceOfMean(a, b); pairs combine by their samples. Both stay
/// unbiased, and d^2 - variance is the squared error against the noiseless truth.
struct ReferenceImage {
  image::Image pixels;  ///< layers total, multiple, transmittance, variance, multiple_variance
  std::uint64_t samples = 0;  ///< a pixel
  std::uint64_t pairs = 0;
  std::string method = "path_traced";  ///< estimator.type that it is made with

  bool empty() const { return samples == 0; }
  Planes mean(std::size_t layer) const;      ///< R, G, B of kLayers[layer]
  Planes variance(std::size_t layer) const;  ///< of that mean
  /// relMSE that its noise adds over all pixels, [layer].
  std::array<double, 2> noise() const;
};

/// Adds a pair of independent chunks of `samples` paths a pixel each.
/// @throws ConfigError when the sizes differ
void addPair(ReferenceImage& reference, const image::Image& a, const image::Image& b,
             std::uint64_t samples);

/// @throws OutputError
void writeReference(const std::filesystem::path& path, const ReferenceImage& reference,
                    const std::string& key);
/// @return nothing where there is no file. @throws InputError for one that is no reference, that
/// is damaged, or that has another key
std::optional<ReferenceImage> readReference(const std::filesystem::path& path,
                                            const std::string& key);

/// Noise of two young references of one picture by different methods, which their own variances
/// tell in part: rare bright paths that a method has not yet met leave its pixels dark and their
/// variance small. Where the means of 8 x 8 pixels differ by more than their variances explain, the
/// darker one is taken to have missed that. Mean over pixels, channels and both layers of the
/// squared error, over the square of both means' mean there and over the frame.
std::array<double, 2> roughNoise(const ReferenceImage& a, const ReferenceImage& b);

/// Grows the reference of one scene and frame, by paths from the eye or from the lamps: whichever
/// is quieter in the same time, which the first pair of each tells.
class ReferenceMaker {
 public:
  /// Starts from `folder`, else from the references shipped in data/studies, where one has that
  /// key.
  /// @param truth   the scene, with an estimator of defaults but for its type
  /// @param name    begins the file's name; letters, digits, - and _ of it are kept
  /// @param chunk   paths a pixel of each half of a pair
  ReferenceMaker(const SceneSource& truth, std::int64_t frame, const std::string& name,
                 std::string key, std::filesystem::path folder, int chunk);

  const ReferenceImage& image() const { return m_image; }
  const std::string& key() const { return m_key; }
  /// File that it was continued from; empty when it was begun here.
  const std::string& origin() const { return m_origin; }
  std::uint64_t samplesBefore() const { return m_samplesBefore; }
  double seconds() const { return m_seconds; }
  /// Seconds that the next pair should take; 0 before the first.
  double pairSeconds() const { return m_pairSeconds; }

  /// Renders a pair in children and saves. @throws InterruptedError, Error; what was saved stays
  void addPair();

 private:
  struct Method {
    std::string type;
    scene::SceneFile scene;
  };
  void load(const std::filesystem::path& path);
  void begin();
  std::optional<ReferenceImage> firstPair(const Method& method, bool mayFail,
                                          double& seconds) const;
  /// @return false when that method does not serve the scene
  bool addPair(const Method& method, bool mayFail, ReferenceImage& image) const;

  std::vector<Method> m_methods;
  std::int64_t m_frame;
  std::string m_key, m_origin;
  std::filesystem::path m_folder, m_file;
  int m_chunk;
  ReferenceImage m_image;
  std::uint64_t m_samplesBefore = 0;
  double m_seconds = 0, m_pairSeconds = 0;
};

/// A name of letters, digits, - and _ alone, for files.
std::string fileStem(const std::string& text);

/// `data/studies` of this tool; empty when there is none.
std::filesystem::path shippedStudies();

}  // namespace photosphere::study
