#include "photosphere/scene/frame_error.h"

#include <algorithm>
#include <cmath>

namespace photosphere::scene {

namespace {

// Blocks are at most this part of the frame's longer side.
constexpr int kFewestBlocks = 32;
// Share of the squared error that blocks may leave in doubt before larger ones are taken.
constexpr double kDoubtShare = 0.1;
// Noise of the truths, as relMSE, that what errors are divided by may hold.
constexpr double kQuietTruth = 0.03;

double sumOf(const Vec3d& v) {
  return v.x + v.y + v.z;
}

double square(double x) {
  return x * x;
}

// Means of 2 x 2 values each; of fewer at the right and lower border.
std::vector<Rgb> halved(const std::vector<Rgb>& values, int width) {
  const int height = static_cast<int>(values.size()) / width;
  const int columns = (width + 1) / 2, rows = (height + 1) / 2;
  std::vector<Rgb> out(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows));
  for (int y = 0; y < rows; ++y)
    for (int x = 0; x < columns; ++x) {
      const int right = std::min(2 * x + 2, width), bottom = std::min(2 * y + 2, height);
      const float share = 1.0f / static_cast<float>((right - 2 * x) * (bottom - 2 * y));
      Rgb mean(0.0f);
      for (int v = 2 * y; v < bottom; ++v)
        for (int u = 2 * x; u < right; ++u)
          mean += share * values[static_cast<std::size_t>(v * width + u)];
      out[static_cast<std::size_t>(y * columns + x)] = mean;
    }
  return out;
}

// Weighted 1 2 1 along both axes, within the frame.
std::vector<Rgb> softened(const std::vector<Rgb>& values, int width) {
  const int height = static_cast<int>(values.size()) / width;
  std::vector<Rgb> out(values.size());
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      Rgb sum(0.0f);
      float weights = 0;
      for (int v = std::max(0, y - 1); v <= std::min(y + 1, height - 1); ++v)
        for (int u = std::max(0, x - 1); u <= std::min(x + 1, width - 1); ++u) {
          const float weight = (u == x ? 2.0f : 1.0f) * (v == y ? 2.0f : 1.0f);
          sum += weight * values[static_cast<std::size_t>(v * width + u)];
          weights += weight;
        }
      out[static_cast<std::size_t>(y * width + x)] = sum / weights;
    }
  return out;
}

// Index of the block of the given level that holds pixel i.
std::size_t blockOf(std::size_t i, int width, int columns, std::size_t level) {
  const int x = static_cast<int>(i) % width >> level, y = static_cast<int>(i) / width >> level;
  return static_cast<std::size_t>(y * columns + x);
}

}  // namespace

std::optional<std::array<double, 2>> blockNoise(const FramePair& a, const FramePair& b, int width) {
  constexpr int kMostHalvings = 3;
  constexpr std::size_t kFewest = 16;  // blocks
  std::vector<Rgb> frames[] = {*a[0], *a[1], *b[0], *b[1]};
  for (int i = 0; i < kMostHalvings; ++i) {
    std::vector<Rgb> coarser = halved(frames[0], width);
    if (coarser.size() < kFewest) break;
    frames[0] = std::move(coarser);
    for (int k = 1; k < 4; ++k)
      frames[k] = halved(frames[k], width);
    width = (width + 1) / 2;
  }
  const std::size_t blocks = frames[0].size();
  if (blocks < kFewest) return std::nullopt;
  const auto value = [&](int frame, std::size_t i) {
    return static_cast<double>(meanComponent(frames[frame][i]));
  };
  const auto sumOfAll = [&](std::size_t i) {
    return value(0, i) + value(1, i) + value(2, i) + value(3, i);
  };
  double mean = 0;
  for (std::size_t i = 0; i < blocks; ++i)
    mean += sumOfAll(i) / static_cast<double>(blocks);
  std::array<double, 2> sum{};
  for (std::size_t i = 0; i < blocks; ++i) {
    const double scale = square(sumOfAll(i) + mean);
    if (!(scale > 0)) continue;
    const double own[] = {square(value(0, i) - value(1, i)), square(value(2, i) - value(3, i))};
    // Of means of two, each with a quarter of `own` as its variance; beyond two standard errors.
    const double apart = 0.5 * (value(0, i) + value(1, i) - value(2, i) - value(3, i));
    const double missed = std::max(0.0, square(apart) - own[0] - own[1]);
    for (const std::size_t which : {0u, 1u})
      sum[which] += (own[which] + ((apart < 0) == (which == 0) ? 4 * missed : 0.0)) / scale;
  }
  return sum;
}

double ErrorEstimate::total() const {
  return std::sqrt(noise * noise + bias * bias);
}

double ErrorEstimate::bound() const {
  return std::sqrt(noise * noise + bias * bias + doubt * doubt);
}

void FrameError::Pyramid::add(std::vector<Rgb> values, int width) {
  ++count;
  const int most =
      std::max(width, width > 0 ? static_cast<int>(values.size()) / width : 0) / kFewestBlocks;
  for (std::size_t level = 0; level == 0 || 1 << level <= most; ++level) {
    if (level > 0) {
      values = halved(values, width);
      width = (width + 1) / 2;
    }
    if (level == levels.size())
      levels.push_back({width, std::vector<Rgb>(values.size(), Rgb(0.0f)),
                        std::vector<Rgb>(values.size(), Rgb(0.0f))});
    Moments& m = levels[level];
    for (std::size_t i = 0; i < values.size(); ++i) {
      const Rgb before = values[i] - m.mean[i];
      m.mean[i] += before / static_cast<float>(count);
      m.squares[i] += before * (values[i] - m.mean[i]);
    }
  }
}

Vec3d FrameError::Pyramid::varianceOfMean(std::size_t level, std::size_t i) const {
  if (count < 2) return Vec3d(0.0);
  return Vec3d(levels[level].squares[i]) / (count * (count - 1.0));
}

std::vector<Rgb> FrameError::inUnits(std::vector<Rgb> frame) {
  if (m_unit == 0) {
    float most = 0;
    for (const Rgb& value : frame)
      most = std::max(most, maxComponent(glm::abs(value)));
    if (!(most > 0) || !std::isfinite(most)) return frame;
    m_unit = std::exp2(std::ilogb(static_cast<double>(most)));
  }
  for (Rgb& value : frame)
    value = Rgb(Vec3d(value) / m_unit);
  return frame;
}

void FrameError::add(const std::vector<Rgb>& frame) {
  m_frames[static_cast<std::size_t>(batches() % 2)].add(inUnits(frame), m_width);
}

void FrameError::add(const std::vector<Rgb>& frame, const std::vector<Rgb>& wider,
                     double widening) {
  add(frame);
  std::vector<Rgb> values(frame.size());
  for (std::size_t i = 0; i < values.size(); ++i)
    values[i] = (wider[i] - frame[i]) / static_cast<float>(widening - 1.0);
  m_wider.add(inUnits(std::move(values)), m_width);
}

void FrameError::addTruth(const std::vector<Rgb>& frame) {
  m_truths.add(inUnits(frame), m_width);
}

// Both turns of batches as one (Chan et al. 1979).
FrameError::Pyramid FrameError::allFrames() const {
  const Pyramid& b = m_frames[1];
  Pyramid all = m_frames[0];
  if (b.count == 0) return all;
  const float n = static_cast<float>(all.count + b.count);
  const float share = static_cast<float>(b.count) / n;
  for (std::size_t level = 0; level < all.levels.size(); ++level) {
    Moments& a = all.levels[level];
    for (std::size_t i = 0; i < a.mean.size(); ++i) {
      const Rgb difference = b.levels[level].mean[i] - a.mean[i];
      a.mean[i] += share * difference;
      a.squares[i] += b.levels[level].squares[i] +
                      static_cast<float>(all.count) * share * difference * difference;
    }
  }
  all.count += b.count;
  return all;
}

// What squared errors are divided by, guess^2 + (0.1 mean guess)^2, pixel by pixel or block by
// block.
struct FrameError::Scale {
  std::vector<Vec3d> values;
  std::vector<double> counts;  // pixels of each
  double pixels = 0;           // of the frame
  // Mean over the frame's pixels and channels.
  double mean(const std::vector<Vec3d>& squares) const {
    double sum = 0;
    for (std::size_t i = 0; i < values.size(); ++i)
      sum += counts[i] * sumOf(squares[i] / values[i]);
    return sum / (3.0 * pixels);
  }
};

// By the frame, moved by what the truths say of each block, softened.
FrameError::Scale FrameError::scaleBy(const Pyramid& frames, std::size_t level) const {
  const std::vector<Rgb>& mean = frames.levels[0].mean;
  const Moments& blocks = frames.levels[level];
  std::vector<Rgb> correction(blocks.mean.size(), Rgb(0.0f));
  if (m_truths.count > 0) {
    for (std::size_t b = 0; b < correction.size(); ++b)
      correction[b] = m_truths.levels[level].mean[b] - blocks.mean[b];
    correction = softened(correction, blocks.width);
  }
  Scale out;
  out.pixels = static_cast<double>(mean.size());
  out.counts.resize(mean.size(), 1.0);
  double average = 0;
  for (std::size_t i = 0; i < mean.size(); ++i) {
    const Vec3d guess(mean[i] + correction[blockOf(i, m_width, blocks.width, level)]);
    average += sumOf(guess) / (3.0 * out.pixels);
    out.values.push_back(guess * guess);
  }
  for (Vec3d& value : out.values)
    value += 0.01 * average * average;
  return out;
}

// Means over the blocks of a level.
FrameError::Scale FrameError::blockScale(const Scale& pixels, std::size_t level) const {
  const int columns = m_truths.levels[level].width;
  Scale out;
  out.pixels = pixels.pixels;
  out.values.resize(m_truths.levels[level].mean.size(), Vec3d(0.0));
  out.counts.resize(out.values.size(), 0.0);
  for (std::size_t i = 0; i < pixels.values.size(); ++i) {
    const std::size_t b = blockOf(i, m_width, columns, level);
    out.values[b] += pixels.values[i];
    ++out.counts[b];
  }
  for (std::size_t b = 0; b < out.values.size(); ++b)
    out.values[b] /= out.counts[b];
  return out;
}

// relMSE of the noise of means.
double FrameError::noiseOf(const Pyramid& noisy, const Scale& scale, std::size_t level) {
  std::vector<Vec3d> variances(scale.values.size());
  for (std::size_t i = 0; i < variances.size(); ++i)
    variances[i] = noisy.varianceOfMean(level, i);
  return scale.mean(variances);
}

// With blocks of a size at which the truths have little noise: where they are noisy, a pixel that
// no bright path hit looks dark and sure of it, and its error large.
FrameError::Scale FrameError::scaleOf(const Pyramid& frames) const {
  Scale scale;
  for (std::size_t level = 0; level < frames.levels.size(); ++level) {
    scale = scaleBy(frames, level);
    if (m_truths.count < 2) break;
    if (noiseOf(m_truths, blockScale(scale, level), level) <= kQuietTruth) break;
  }
  return scale;
}

// Without truths, each half of the batches is the guess for the other's noise: a pixel that a rare
// bright path hit is bright and noisy at once, and would hide its noise by its own brightness.
// Softened, as noise in what is divided by makes errors look larger.
double FrameError::noiseByHalves() const {
  const Pyramid &a = m_frames[0], &b = m_frames[1];
  if (b.count == 0) return 0;
  const std::vector<Rgb> first = softened(a.levels[0].mean, m_width);
  const std::vector<Rgb> second = softened(b.levels[0].mean, m_width);
  const double values = 3.0 * static_cast<double>(first.size());
  double average = 0;
  for (std::size_t i = 0; i < first.size(); ++i)
    average += 0.5 * sumOf(Vec3d(first[i]) + Vec3d(second[i])) / values;
  if (!(average > 0)) return 0;
  const double floor = 0.01 * average * average;
  const auto part = [&](const Pyramid& noisy, const Rgb& guess, std::size_t i) {
    const Vec3d scale = Vec3d(guess) * Vec3d(guess) + floor;
    // A half of fewer than two batches has no spread; the other stands for both.
    return sumOf(Vec3d(noisy.levels[0].squares[i]) / scale) / std::max(1, noisy.count - 1);
  };
  double sum = 0;
  const double halves = (a.count > 1 ? 1.0 : 0.0) + (b.count > 1 ? 1.0 : 0.0);
  for (std::size_t i = 0; i < first.size(); ++i)
    sum += part(a, second[i], i) + part(b, first[i], i);
  return halves > 0 ? sum / halves / values / (a.count + b.count) : 0;
}

// What the wider kernel says of the bias within blocks: all of it less that of the blocks' means.
// The square of a noisy mean is too large by its variance.
double FrameError::widening(const Scale& pixels, const Scale& blocks, std::size_t level) const {
  if (m_wider.count == 0) return 0;
  const auto squares = [&](std::size_t at) {
    std::vector<Vec3d> out;
    for (std::size_t i = 0; i < m_wider.levels[at].mean.size(); ++i) {
      const Vec3d mean(m_wider.levels[at].mean[i]);
      out.push_back(mean * mean - m_wider.varianceOfMean(at, i));
    }
    return out;
  };
  const double all = pixels.mean(squares(0));
  return std::max(0.0, m_truths.count > 1 ? all - blocks.mean(squares(level)) : all);
}

// The bias of the blocks' means: the squared difference of two noisy means, less its variance. The
// standard error takes differences for normally distributed, and noise to be common to channels.
void FrameError::judge(const Pyramid& frames, const Scale& blocks, std::size_t level, double& bias,
                       double& standardError) const {
  std::vector<Vec3d> squares;
  double sum = 0;
  for (std::size_t b = 0; b < blocks.values.size(); ++b) {
    const Vec3d difference =
        Vec3d(frames.levels[level].mean[b]) - Vec3d(m_truths.levels[level].mean[b]);
    const Vec3d variance = frames.varianceOfMean(level, b) + m_truths.varianceOfMean(level, b);
    squares.push_back(difference * difference - variance);
    const Vec3d spread =
        glm::sqrt(2.0 * variance * variance + 4.0 * variance * glm::max(squares[b], Vec3d(0.0)));
    sum += square(blocks.counts[b] * sumOf(spread / blocks.values[b]));
  }
  bias = blocks.mean(squares);
  standardError = std::sqrt(sum) / (3.0 * blocks.pixels);
}

ErrorEstimate FrameError::estimate() const {
  if (batches() == 0 || m_frames[0].levels[0].mean.empty()) return {};
  ErrorEstimate e;
  if (m_truths.count < 2) e.noise = std::sqrt(noiseByHalves());
  if (m_truths.count < 2 && m_wider.count == 0) return e;
  const Pyramid frames = allFrames();
  const Scale pixels = scaleOf(frames);
  if (!(sumOf(pixels.values[0]) > 0)) return {};  // black: every scale holds the mean
  if (m_truths.count < 2) {
    e.bias = std::sqrt(widening(pixels, pixels, 0));
    return e;
  }
  e.noise = std::sqrt(noiseOf(frames, pixels, 0));
  for (std::size_t level = 0; level < frames.levels.size(); ++level) {
    const Scale blocks = blockScale(pixels, level);
    double bias = 0, doubt = 0;
    judge(frames, blocks, level, bias, doubt);
    const double all = std::max(0.0, bias + widening(pixels, blocks, level));
    e = {e.noise, std::sqrt(all), std::sqrt(doubt), 1 << level};
    if (doubt <= kDoubtShare * (e.noise * e.noise + all)) break;
  }
  return e;
}

std::vector<Rgb> FrameError::standardError() const {
  const Pyramid frames = allFrames();
  std::vector<Rgb> out(frames.count > 0 ? frames.levels[0].mean.size() : 0);
  for (std::size_t i = 0; i < out.size(); ++i)
    out[i] = Rgb(m_unit * glm::sqrt(frames.varianceOfMean(0, i)));
  return out;
}

void FrameError::keep(StateWriter& w) const {
  w.value(m_unit);
  for (const Pyramid* pyramid : {&m_frames[0], &m_frames[1], &m_wider, &m_truths}) {
    w.value(pyramid->count);
    w.value(static_cast<std::uint64_t>(pyramid->levels.size()));
    for (const Moments& level : pyramid->levels) {
      w.value(level.width);
      w.value(level.mean);
      w.value(level.squares);
    }
  }
}

void FrameError::resume(StateReader& r) {
  r.value(m_unit);
  for (Pyramid* pyramid : {&m_frames[0], &m_frames[1], &m_wider, &m_truths}) {
    r.value(pyramid->count);
    const auto levels = r.value<std::uint64_t>();
    if (levels > 64) r.fail();
    pyramid->levels.resize(static_cast<std::size_t>(levels));
    for (Moments& level : pyramid->levels) {
      r.value(level.width);
      r.value(level.mean);
      r.value(level.squares);
    }
  }
}

}  // namespace photosphere::scene
