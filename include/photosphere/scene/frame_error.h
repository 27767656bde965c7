#pragma once
// How far a frame is from the truth, estimated from independent batches of it.

#include <vector>

#include "photosphere/core/types.h"

namespace photosphere::scene {

/// Relative errors, sqrt(relMSE) of METHOD.md section 7 with the frame's own best guess as
/// reference.
struct ErrorEstimate {
  double noise = 0;  ///< of the mean of the batches, from their spread
  double bias = 0;   ///< from what a wider kernel changes; 0 where there is no kernel
  double total() const;
};

/// Adds up batches of one frame. Photon noise is shared by neighbouring pixels and samples, so only
/// whole batches with photons of their own tell it.
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

  int batches() const { return m_frames.count; }
  /// Zero noise before the second batch.
  ErrorEstimate estimate() const;
  /// Standard error of the mean, pixel by pixel and channel by channel [W m^-2 sr^-1].
  std::vector<Rgb> standardError() const;

 private:
  // Mean and sum of squared deviations (Welford 1962).
  struct Moments {
    std::vector<Vec3d> mean, squares;
    int count = 0;
    void add(const std::vector<Vec3d>& values);
    Vec3d varianceOfMean(std::size_t i) const;
  };

  std::vector<Vec3d> scales() const;

  int m_width;
  Moments m_frames, m_bias;
};

}  // namespace photosphere::scene
