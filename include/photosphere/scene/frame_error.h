#pragma once
// How far a frame is from the truth, estimated from independent batches of it.

#include <array>
#include <optional>
#include <vector>

#include "photosphere/core/checkpoint.h"
#include "photosphere/core/types.h"

namespace photosphere::scene {

/// Relative errors, sqrt(relMSE) of METHOD.md section 7 with a best guess as reference.
struct ErrorEstimate {
  double noise = 0;  ///< of the mean of the batches, from their spread
  double bias = 0;   ///< what more batches do not mend
  double doubt = 0;  ///< one standard error of the squared bias, as its root: a bias of about this
                     ///< size can have been overlooked
  int block = 0;     ///< edge of the blocks that the bias was told by [pixels]; 0 = not told
  /// The estimate.
  double total() const;
  /// What the estimate is after one standard error of the bias; a target is met when this is.
  double bound() const;
};

/// Two independent frames of one kind.
using FramePair = std::array<const std::vector<Rgb>*, 2>;

/// How noisy two ways are to the same frame, from a pair of each: the squared difference of the two
/// in the means of blocks of at most 8 x 8 pixels, relative to these beside the frame's own mean,
/// summed over blocks. Where rare bright paths have met neither frame of a pair it looks quiet, so
/// that by which the ways differ beyond their own differences is the darker one's.
/// @param width  of all [pixels]
/// @return nothing for a frame of so few pixels that chance would tell
std::optional<std::array<double, 2>> blockNoise(const FramePair& a, const FramePair& b, int width);

/// Adds up batches of one frame. Photon noise is shared by neighbouring pixels and samples, so only
/// whole batches with photons of their own tell it.
///
/// A bias is told in two parts that add up. Means over square blocks of pixels are held against
/// those of unbiased frames, so that any cause of a bias counts, known or not: paths are
/// noisy pixel by pixel and far less so block by block. What stays within a block is told by a
/// wider kernel. The blocks are the smallest that the unbiased frames at hand tell anything about.
class FrameError {
 public:
  /// @param width  of the frame [pixels]
  explicit FrameError(int width) : m_width(width) {}
  /// A batch.
  void add(const std::vector<Rgb>& frame);
  /// A batch, and the same photons seen through a kernel `widening` times as wide. The bias is
  /// taken to be in proportion to the width, as it is at the smoke's edge, where most of it sits;
  /// inside, where it is of second order, that is too much rather than too little.
  void add(const std::vector<Rgb>& frame, const std::vector<Rgb>& wider, double widening);
  /// An unbiased frame, independent of all batches and of the other truths.
  void addTruth(const std::vector<Rgb>& frame);

  int batches() const { return m_frames[0].count + m_frames[1].count; }
  int truths() const { return m_truths.count; }
  /// Zero noise before the second batch; no bias before the second truth, unless by a wider kernel.
  ErrorEstimate estimate() const;
  /// Standard error of the mean, pixel by pixel and channel by channel [W m^-2 sr^-1].
  std::vector<Rgb> standardError() const;
  void keep(StateWriter& w) const;
  void resume(StateReader& r);

 private:
  // Mean and sum of squared deviations (Welford 1962) of the pixels of one size.
  struct Moments {
    int width = 0;
    std::vector<Rgb> mean, squares;
  };
  // The same for the frame, for blocks of 2 x 2 pixels, of 4 x 4, and so on.
  struct Pyramid {
    std::vector<Moments> levels;
    int count = 0;
    void add(std::vector<Rgb> values, int width);
    Vec3d varianceOfMean(std::size_t level, std::size_t i) const;
  };
  struct Scale;

  std::vector<Rgb> inUnits(std::vector<Rgb> frame);
  Pyramid allFrames() const;
  double noiseByHalves() const;
  Scale scaleBy(const Pyramid& frames, std::size_t level) const;
  Scale scaleOf(const Pyramid& frames) const;
  Scale blockScale(const Scale& pixels, std::size_t level) const;
  static double noiseOf(const Pyramid& noisy, const Scale& scale, std::size_t level);
  double widening(const Scale& pixels, const Scale& blocks, std::size_t level) const;
  void judge(const Pyramid& frames, const Scale& blocks, std::size_t level, double& bias,
             double& standardError) const;

  int m_width;
  // Radiance of about the first frame's brightest pixel [W m^-2 sr^-1], a power of two, in which
  // all is kept: squares of radiances leave a float's range long before these do. 0 = all is black.
  double m_unit = 0;
  std::array<Pyramid, 2> m_frames;  // batches in turn
  Pyramid m_wider, m_truths;
};

}  // namespace photosphere::scene
