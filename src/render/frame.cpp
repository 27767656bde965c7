#include "photosphere/render/frame.h"

#include <cmath>
#include <mutex>

#include "photosphere/core/parallel.h"
#include "photosphere/core/progress.h"

namespace photosphere::render {

namespace {

constexpr int kTile = 16;

double defaultWidth(FilterKind filter) {
  switch (filter) {
    case FilterKind::box: return 1.0;
    case FilterKind::triangle: return 2.0;
    case FilterKind::blackmanHarris: return 3.0;
  }
  return 1.0;
}

// Blackman-Harris window over [0, 1] (Harris 1978, four terms).
double blackmanHarris(double x) {
  const double a = 2 * kPi * x;
  return 0.35875 - 0.48829 * std::cos(a) + 0.14128 * std::cos(2 * a) - 0.01168 * std::cos(3 * a);
}

// Inverse of the window's cumulative distribution, tabulated once.
double sampleBlackmanHarris(double u) {
  constexpr int kSize = 1024;
  static const std::array<double, kSize + 1> inverse = [] {
    std::array<double, kSize + 1> table{};
    constexpr int fine = 1 << 16;
    std::vector<double> cumulative(fine + 1, 0.0);
    for (int i = 0; i < fine; ++i)
      cumulative[static_cast<std::size_t>(i) + 1] =
          cumulative[static_cast<std::size_t>(i)] + blackmanHarris((i + 0.5) / fine);
    int at = 0;
    for (int i = 0; i <= kSize; ++i) {
      const double target = cumulative.back() * i / kSize;
      while (at < fine && cumulative[static_cast<std::size_t>(at) + 1] < target) ++at;
      table[static_cast<std::size_t>(i)] = static_cast<double>(at) / fine;
    }
    table[kSize] = 1.0;
    return table;
  }();
  const double x = u * kSize;
  const auto i = static_cast<std::size_t>(std::min(x, kSize - 1.0));
  return inverse[i] + (inverse[i + 1] - inverse[i]) * (x - static_cast<double>(i));
}

struct PixelSum {
  RayRadiance sum;
  std::uint64_t nans = 0, negatives = 0;
};

bool finite(const Rgb& c) { return std::isfinite(c.x) && std::isfinite(c.y) && std::isfinite(c.z); }

void addSample(PixelSum& pixel, const RayRadiance& r) {
  const Rgb total = r.total() + r.transmittance + Rgb(r.depth);
  if (!finite(total)) {
    ++pixel.nans;
    return;
  }
  for (const Rgb* layer : {&r.single, &r.multiple, &r.emission, &r.background})
    if (layer->x < 0 || layer->y < 0 || layer->z < 0) {
      ++pixel.negatives;
      break;
    }
  pixel.sum.single += r.single;
  pixel.sum.multiple += r.multiple;
  pixel.sum.emission += r.emission;
  pixel.sum.background += r.background;
  pixel.sum.transmittance += r.transmittance;
  pixel.sum.depth += r.depth;
  pixel.sum.opacity += r.opacity;
}

void merge(IntegratorCounters& a, const IntegratorCounters& b) {
  a.tracking.majorantViolations += b.tracking.majorantViolations;
  a.tracking.lookups += b.tracking.lookups;
  a.scatterings += b.scatterings;
  a.capped += b.capped;
  a.cappedRadiance += b.cappedRadiance;
}

}  // namespace

Vec2d sampleFilter(FilterKind filter, double width, const Vec2d& u) {
  const double w = width > 0 ? width : defaultWidth(filter);
  switch (filter) {
    case FilterKind::box: return (u - 0.5) * w;
    case FilterKind::triangle: {
      auto tent = [](double x) { return x < 0.5 ? std::sqrt(2 * x) - 1 : 1 - std::sqrt(2 - 2 * x); };
      return Vec2d(tent(u.x), tent(u.y)) * (0.5 * w);
    }
    case FilterKind::blackmanHarris:
      return (Vec2d(sampleBlackmanHarris(u.x), sampleBlackmanHarris(u.y)) - 0.5) * w;
  }
  return Vec2d(0.0);
}

FrameLayers renderFrame(const cameras::Camera& camera, const Integrator& integrator,
                        const FrameOptions& options) {
  FrameLayers out;
  out.crop = options.crop;
  out.resolution = camera.resolution();
  const int width = out.width(), height = out.height();
  const auto pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  for (auto* layer : {&out.beauty, &out.single, &out.multiple, &out.emission, &out.background,
                      &out.transmittance})
    layer->assign(pixels, Rgb(0.0f));
  out.alpha.assign(pixels, 0.0f);
  out.depth.assign(pixels, kNoDepth);

  const int tilesX = (width + kTile - 1) / kTile, tilesY = (height + kTile - 1) / kTile;
  const auto tiles = static_cast<std::size_t>(tilesX) * static_cast<std::size_t>(tilesY);
  const Vec3d axis = camera.viewDirection();
  const double unitsPerMeter = 1.0 / options.space.metersPerUnit;
  std::mutex mutex;
  Progress progress("render", pixels);

  auto renderPixel = [&](int x, int y, IntegratorCounters& counters) {
    PixelSum pixel;
    pixel.sum.transmittance = Rgb(0.0f);
    double axisDepth = 0.0;
    const auto index = static_cast<std::uint64_t>(y) * static_cast<std::uint64_t>(out.resolution.x) +
                       static_cast<std::uint64_t>(x);
    // Positions in the pixel: the R2 sequence (Roberts 2018), shifted at random for each pixel.
    Rng shiftRng(options.key, RandomStream::camera, index);
    const Vec2d shift(shiftRng.uniformDouble(), shiftRng.uniformDouble());
    for (int s = 0; s < options.samples; ++s) {
      Rng rng(options.key, RandomStream::camera,
              (static_cast<std::uint64_t>(s) + 1) << 40 | index);
      Vec2d u(shift.x + 0.7548776662466927 * s, shift.y + 0.5698402909980532 * s);
      u -= glm::floor(u);
      const Vec2d raster = Vec2d(x + 0.5, y + 0.5) +
                           sampleFilter(options.filter, options.filterWidth, u);
      const cameras::CameraRay ray = camera.ray(raster);
      const RayRadiance r = integrator.radiance(options.space.localFromWorld(ray.origin),
                                                Vec3f(ray.direction), rng, counters);
      addSample(pixel, r);
      axisDepth += static_cast<double>(r.depth) * glm::dot(ray.direction, axis);
    }
    const float scale = 1.0f / static_cast<float>(options.samples);
    const std::size_t at = static_cast<std::size_t>(y - options.crop.min.y) * static_cast<std::size_t>(width) +
                           static_cast<std::size_t>(x - options.crop.min.x);
    out.single[at] = pixel.sum.single * scale;
    out.multiple[at] = pixel.sum.multiple * scale;
    out.emission[at] = pixel.sum.emission * scale;
    out.background[at] = pixel.sum.background * scale;
    out.beauty[at] = pixel.sum.total() * scale;
    out.transmittance[at] = pixel.sum.transmittance * scale;
    out.alpha[at] = 1.0f - meanComponent(out.transmittance[at]);
    if (pixel.sum.opacity > 1e-6f)
      out.depth[at] = static_cast<float>(axisDepth / static_cast<double>(pixel.sum.opacity) * unitsPerMeter);
    return pixel;
  };

  parallelFor(tiles, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t tile = begin; tile < end; ++tile) {
      IntegratorCounters counters;
      std::uint64_t nans = 0, negatives = 0;
      Vec2i bad(-1);
      const int x0 = options.crop.min.x + static_cast<int>(tile % static_cast<std::size_t>(tilesX)) * kTile;
      const int y0 = options.crop.min.y + static_cast<int>(tile / static_cast<std::size_t>(tilesX)) * kTile;
      const int x1 = std::min(x0 + kTile, options.crop.max.x);
      const int y1 = std::min(y0 + kTile, options.crop.max.y);
      for (int y = y0; y < y1; ++y)
        for (int x = x0; x < x1; ++x) {
          const PixelSum pixel = renderPixel(x, y, counters);
          if ((pixel.nans || pixel.negatives) && bad.x < 0) bad = Vec2i(x, y);
          nans += pixel.nans;
          negatives += pixel.negatives;
        }
      const std::lock_guard lock(mutex);
      out.nanSamples += nans;
      out.negativeSamples += negatives;
      if (bad.x >= 0 && out.firstBad.x < 0) out.firstBad = bad;
      merge(out.counters, counters);
      progress.add(static_cast<std::uint64_t>(x1 - x0) * static_cast<std::uint64_t>(y1 - y0));
    }
  });
  return out;
}

}  // namespace photosphere::render
