#include "photosphere/scene/frame_error.h"

#include <algorithm>
#include <cmath>

namespace photosphere::scene {

namespace {

double sumOf(const Vec3d& v) {
  return v.x + v.y + v.z;
}

}  // namespace

double ErrorEstimate::total() const {
  return std::sqrt(noise * noise + bias * bias);
}

void FrameError::Moments::add(const std::vector<Vec3d>& values) {
  mean.resize(values.size(), Vec3d(0.0));
  squares.resize(values.size(), Vec3d(0.0));
  ++count;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const Vec3d before = values[i] - mean[i];
    mean[i] += before / static_cast<double>(count);
    squares[i] += before * (values[i] - mean[i]);
  }
}

Vec3d FrameError::Moments::varianceOfMean(std::size_t i) const {
  if (count < 2) return Vec3d(0.0);
  return squares[i] / (static_cast<double>(count) * (count - 1.0));
}

void FrameError::add(const std::vector<Rgb>& frame) {
  m_frames.add({frame.begin(), frame.end()});
}

void FrameError::add(const std::vector<Rgb>& frame, const std::vector<Rgb>& wider,
                     double widening) {
  add(frame);
  std::vector<Vec3d> values(frame.size());
  for (std::size_t i = 0; i < values.size(); ++i)
    values[i] = (Vec3d(wider[i]) - Vec3d(frame[i])) / (widening - 1.0);
  m_bias.add(values);
}

// What squared errors are divided by: ref^2 + (0.1 mean ref)^2. The reference is the mean of a
// pixel and its neighbours: one that a rare bright path hit is bright and noisy at once, and would
// look better than it is by its own brightness.
std::vector<Vec3d> FrameError::scales() const {
  const std::vector<Vec3d>& frame = m_frames.mean;
  const int height = m_width > 0 ? static_cast<int>(frame.size()) / m_width : 0;
  std::vector<Vec3d> scale(frame.size());
  double mean = 0;
  for (const Vec3d& pixel : frame)
    mean += sumOf(pixel) / (3.0 * static_cast<double>(frame.size()));
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < m_width; ++x) {
      Vec3d sum(0.0);
      double count = 0;
      for (int v = std::max(0, y - 1); v <= std::min(y + 1, height - 1); ++v)
        for (int u = std::max(0, x - 1); u <= std::min(x + 1, m_width - 1); ++u, ++count)
          sum += frame[static_cast<std::size_t>(v * m_width + u)];
      sum /= count;
      scale[static_cast<std::size_t>(y * m_width + x)] = sum * sum + 0.01 * mean * mean;
    }
  return scale;
}

ErrorEstimate FrameError::estimate() const {
  const std::vector<Vec3d> scale = scales();
  double noise = 0, bias = 0;
  for (std::size_t i = 0; i < scale.size(); ++i) {
    if (!(sumOf(scale[i]) > 0)) continue;  // a black frame
    noise += sumOf(m_frames.varianceOfMean(i) / scale[i]);
    // The square of a noisy mean is too large by its variance.
    if (m_bias.count > 0)
      bias += sumOf((m_bias.mean[i] * m_bias.mean[i] - m_bias.varianceOfMean(i)) / scale[i]);
  }
  const double count = 3.0 * static_cast<double>(std::max<std::size_t>(1, scale.size()));
  return {std::sqrt(noise / count), std::sqrt(std::max(0.0, bias) / count)};
}

std::vector<Rgb> FrameError::standardError() const {
  std::vector<Rgb> out(m_frames.mean.size());
  for (std::size_t i = 0; i < out.size(); ++i)
    out[i] = Rgb(glm::sqrt(m_frames.varianceOfMean(i)));
  return out;
}

}  // namespace photosphere::scene
