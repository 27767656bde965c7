#include "photosphere/render/frame.h"

#include <cmath>
#include <cstring>
#include <mutex>
#include <type_traits>

#include "photosphere/core/error.h"
#include "photosphere/core/interrupt.h"
#include "photosphere/core/parallel.h"
#include "photosphere/core/progress.h"
#include "photosphere/core/resources.h"
#include "photosphere/core/sampling.h"

namespace photosphere::render {

namespace {

constexpr int kBandRows = 16;
constexpr double kBandSeconds = 0.5;  // where a frame may pause
constexpr int kChunk = 16;            // pixels of a row that one task traces
constexpr int kSamplesAtOnce = 16;    // bounds the samples kept, whatever render.samples is

bool finite(const Rgb& c) {
  return std::isfinite(c.x) && std::isfinite(c.y) && std::isfinite(c.z);
}

bool isNan(const RayRadiance& r) {
  return !finite(r.total() + r.transmittance) || !std::isfinite(r.depth) ||
         !std::isfinite(r.opacity);
}

bool isNegative(const RayRadiance& r) {
  for (const Rgb* layer : {&r.single, &r.multiple, &r.emission, &r.background})
    if (layer->x < 0 || layer->y < 0 || layer->z < 0) return true;
  return false;
}

// Weighted sum of samples: the fields of RayRadiance, which is floats throughout, as one array.
struct PixelSum {
  static constexpr std::size_t kFields = sizeof(RayRadiance) / sizeof(float);
  std::array<float, kFields> fields{};
  float weight = 0.0f;

  void add(const RayRadiance& r, float w) {
    std::array<float, kFields> values;
    std::memcpy(values.data(), &r, sizeof r);
    for (std::size_t i = 0; i < kFields; ++i)
      fields[i] += w * values[i];
    weight += w;
  }
  RayRadiance mean() const {
    RayRadiance r;
    std::array<float, kFields> values;
    const float scale = weight > 0.0f ? 1.0f / weight : 0.0f;
    for (std::size_t i = 0; i < kFields; ++i)
      values[i] = fields[i] * scale;
    std::memcpy(static_cast<void*>(&r), values.data(), sizeof r);
    return r;
  }
};
static_assert(std::is_trivially_copyable_v<RayRadiance>);

// Offset of sample s from the pixel centre: the R2 sequence (Roberts 2018), the same in every
// pixel, so that the samples of a frame form shifted lattices.
Vec2d sampleOffset(int s) {
  Vec2d u(0.5 + 0.7548776662466927 * s, 0.5 + 0.5698402909980532 * s);
  return u - glm::floor(u) - 0.5;
}

// Traces the samples of a frame band by band and filters them into pixels.
class FrameLoop {
 public:
  FrameLoop(const cameras::Camera& camera, const Integrator& integrator,
            const FrameOptions& options, FrameLayers& out)
      : m_camera(camera),
        m_integrator(integrator),
        m_options(options),
        m_out(out),
        m_filter(options.filter, options.filterWidth),
        m_border(static_cast<int>(std::ceil(m_filter.radius() - 0.5))),
        m_still(cameras::placementOf(camera)),
        m_sums(static_cast<std::size_t>(out.width()) * static_cast<std::size_t>(out.height())) {}

  void run() {
    const auto rows = static_cast<std::uint64_t>(m_out.height() + 2 * m_border);
    Progress progress("render", rows * static_cast<std::uint64_t>(m_options.samples));
    const int end = m_options.firstSample + m_options.samples;
    m_first = m_options.firstSample;
    m_row = m_out.crop.min.y;
    if (m_options.pause) m_bandRows = 1;  // until it is known what they take
    if (m_options.begun) resume(*m_options.begun, progress);
    for (; m_first < end; m_first += kSamplesAtOnce, m_row = m_out.crop.min.y)
      pass(std::min(end, m_first + kSamplesAtOnce), progress);
    finish();
  }

 private:
  int sampleRowWidth() const { return m_out.width() + 2 * m_border; }

  // The rest of one pass over the frame, with samples [m_first, endSample) of every pixel.
  void pass(int endSample, Progress& progress) {
    m_count = endSample - m_first;
    for (int s = m_first; s < endSample; ++s)
      m_offsets[static_cast<std::size_t>(s - m_first)] = sampleOffset(s);
    const std::vector<Tap> filter = taps();
    const int bottom = m_out.crop.max.y + m_border;
    std::vector<std::vector<RayRadiance>> rows;  // traced, from row `kept` on
    int kept = m_row - m_border, traced = kept;
    while (m_row < m_out.crop.max.y) {
      const Stopwatch watch;
      const int end = std::min(m_row + m_bandRows, m_out.crop.max.y);
      const int needed = std::min(end + m_border, bottom);
      rows.resize(static_cast<std::size_t>(needed - kept));
      band(rows, kept, traced, needed);
      progress.add(static_cast<std::uint64_t>(needed - traced) *
                   static_cast<std::uint64_t>(m_count));
      traced = needed;
      {
        const InterruptDelay delay;  // pixels are added to all or none
        parallelFor(static_cast<std::size_t>(end - m_row), 1,
                    [&](std::size_t begin, std::size_t last) {
                      for (std::size_t i = begin; i < last; ++i)
                        filterRow(rows, kept, m_row + static_cast<int>(i), filter);
                    });
      }
      const int keep = end - m_border;
      rows.erase(rows.begin(), rows.begin() + (keep - kept));
      kept = keep;
      m_row = end;
      if (!m_options.pause) continue;
      // Bands are what an interruption loses.
      const double fit = kBandSeconds / std::max(watch.seconds(), 1e-3);
      m_bandRows = std::clamp(static_cast<int>(std::min(fit, 2.0) * m_bandRows), 1, kBandRows);
      pause();
    }
  }

  // Traces rows of samples. Where that is interrupted the frame is what the bands before made it.
  void band(std::vector<std::vector<RayRadiance>>& rows, int kept, int begin, int end) {
    const IntegratorCounters counters = m_out.counters;
    const std::uint64_t nans = m_out.nanSamples, negatives = m_out.negativeSamples;
    const Vec2i bad = m_out.firstBad;
    try {
      traceRows(rows, kept, begin, end, m_first);
    } catch (const InterruptedError&) {
      m_out.counters = counters;
      m_out.nanSamples = nans;
      m_out.negativeSamples = negatives;
      m_out.firstBad = bad;
      pause();
      throw;
    }
  }

  void pause() const {
    if (m_options.pause) m_options.pause([this](StateWriter& w) { keep(w); });
  }
  // All that the bands so far have made.
  template <class Loop, class State>
  static void eachMember(Loop& loop, State& state) {
    state.value(loop.m_first);
    state.value(loop.m_row);
    state.value(loop.m_out.counters);
    state.value(loop.m_out.nanSamples);
    state.value(loop.m_out.negativeSamples);
    state.value(loop.m_out.firstBad);
    state.value(loop.m_sums);
  }
  void keep(StateWriter& w) const { eachMember(*this, w); }
  void resume(StateReader& r, Progress& progress) {
    const std::size_t size = m_sums.size();
    eachMember(*this, r);
    if (m_sums.size() != size || m_row < m_out.crop.min.y || m_row > m_out.crop.max.y) r.fail();
    const auto passes = static_cast<std::uint64_t>(m_first - m_options.firstSample);
    progress.add(passes * static_cast<std::uint64_t>(m_out.height()) +
                 static_cast<std::uint64_t>(m_row - m_out.crop.min.y));
  }

  void traceRows(std::vector<std::vector<RayRadiance>>& rows, int kept, int begin, int end,
                 int firstSample) {
    const int width = sampleRowWidth();
    for (int y = begin; y < end; ++y)
      rows[static_cast<std::size_t>(y - kept)].resize(static_cast<std::size_t>(width * m_count));
    const int chunks = (width + kChunk - 1) / kChunk;
    parallelFor(static_cast<std::size_t>(chunks) * static_cast<std::size_t>(end - begin), 1,
                [&](std::size_t first, std::size_t last) {
                  IntegratorCounters counters;
                  Bad bad;
                  for (std::size_t task = first; task < last; ++task) {
                    const int y = begin + static_cast<int>(task / static_cast<std::size_t>(chunks));
                    const int x0 =
                        static_cast<int>(task % static_cast<std::size_t>(chunks)) * kChunk;
                    auto& row = rows[static_cast<std::size_t>(y - kept)];
                    for (int x = x0; x < std::min(x0 + kChunk, width); ++x)
                      tracePixel(&row[static_cast<std::size_t>(x * m_count)],
                                 m_out.crop.min.x - m_border + x, y, firstSample, counters, bad);
                  }
                  report(counters, bad);
                });
  }

  struct Bad {
    std::uint64_t nans = 0, negatives = 0;
    Vec2i first{-1};
  };

  void tracePixel(RayRadiance* samples, int x, int y, int firstSample, IntegratorCounters& counters,
                  Bad& bad) {
    // Distinct for every pixel, also of the border beyond the frame.
    const auto pixel =
        static_cast<std::uint64_t>(y + 65536) << 20 | static_cast<std::uint64_t>(x + 65536);
    for (int s = 0; s < m_count; ++s) {
      Rng rng(m_options.key, RandomStream::camera,
              static_cast<std::uint64_t>(firstSample + s) << 40 | pixel);
      const Vec2d raster = Vec2d(x + 0.5, y + 0.5) + m_offsets[static_cast<std::size_t>(s)];
      const float u = m_options.moving ? shutterTime(firstSample + s, pixel) : 0.5f;
      const cameras::MovingCamera* motion = m_options.motion;
      const cameras::Placement place = motion ? motion->placement(u) : m_still;
      cameras::CameraRay ray = motion ? motion->ray(raster, u) : m_camera.ray(raster);
      if (m_options.lens.radius > 0.0)
        ray = throughLens(ray, place, lensPoint(firstSample + s, pixel));
      RayRadiance r = m_integrator.radiance(m_options.space.localFromWorld(ray.origin),
                                            Vec3f(ray.direction), moment(u), rng, counters);
      if (!m_camera.isPanorama())
        r.depth *= static_cast<float>(glm::dot(ray.direction, place.axis));
      const bool nan = isNan(r);
      if (nan || isNegative(r)) {
        ++(nan ? bad.nans : bad.negatives);
        if (bad.first.x < 0) bad.first = Vec2i(x, y);
      }
      samples[s] = nan ? RayRadiance{} : r;
    }
  }

  // On the unit disc: samples of a pixel follow the R2 sequence, turned by a random shift of each
  // pixel.
  Vec2f lensPoint(int sample, std::uint64_t pixel) const {
    // No sample has this number.
    Rng rng(m_options.key, RandomStream::camera, std::uint64_t{0xffffff} << 40 | pixel);
    Vec2d u = Vec2d(rng.uniform2()) +
              Vec2d(0.7548776662466927, 0.5698402909980532) * static_cast<double>(sample);
    u -= glm::floor(u);
    return sampleDisc(Vec2f(glm::min(u, Vec2d(1.0 - 0x1p-24))));
  }

  // Part of the shutter's time that has passed, in [0, 1): samples of a pixel follow the golden
  // ratio's sequence from a random start of each pixel.
  float shutterTime(int sample, std::uint64_t pixel) const {
    // No sample has this number.
    Rng rng(m_options.key, RandomStream::camera, std::uint64_t{0xfffffe} << 40 | pixel);
    const double u = rng.uniformDouble() + 0.6180339887498949 * sample;
    return static_cast<float>(std::min(u - std::floor(u), 1.0 - 0x1p-24));
  }
  transport::Moment moment(float u) const {
    const transport::Shutter& shutter = m_options.shutter;
    return {
        static_cast<float>(shutter.open + static_cast<double>(u) * (shutter.close - shutter.open))};
  }

  // The ray from a point of the lens to where the ray through its middle meets the plane in focus.
  cameras::CameraRay throughLens(const cameras::CameraRay& ray, const cameras::Placement& place,
                                 const Vec2f& point) const {
    const Vec3d focus = place.eye + ray.direction * (m_options.lens.focusDistance /
                                                     glm::dot(ray.direction, place.axis));
    const Vec3d shift = m_options.lens.radius * (place.right * static_cast<double>(point.x) +
                                                 place.up * static_cast<double>(point.y));
    const Vec3d direction = glm::normalize(focus - (place.eye + shift));
    // It begins where the other does, at the same distance along the axis.
    const double near = glm::dot(ray.origin - place.eye, place.axis);
    return {place.eye + shift + direction * (near / glm::dot(direction, place.axis)), direction};
  }

  void report(const IntegratorCounters& counters, const Bad& bad) {
    const std::lock_guard lock(m_mutex);
    m_out.counters.add(counters);
    m_out.nanSamples += bad.nans;
    m_out.negativeSamples += bad.negatives;
    if (bad.first.x >= 0 && m_out.firstBad.x < 0) m_out.firstBad = bad.first;
  }

  // The samples that a pixel is made of, and their weights: the same for every pixel of a pass.
  struct Tap {
    int row;             // of samples, relative to the pixel's
    std::size_t sample;  // in that row, from the pixel's own place on
    float weight;
  };
  std::vector<Tap> taps() const {
    std::vector<Tap> all;
    for (int dy = -m_border; dy <= m_border; ++dy)
      for (int dx = -m_border; dx <= m_border; ++dx)
        for (int s = 0; s < m_count; ++s) {
          const float w = m_filter.weight(Vec2d(dx, dy) + m_offsets[static_cast<std::size_t>(s)]);
          if (w > 0.0f)
            all.push_back({dy, static_cast<std::size_t>((dx + m_border) * m_count + s), w});
        }
    return all;
  }

  void filterRow(const std::vector<std::vector<RayRadiance>>& rows, int kept, int y,
                 const std::vector<Tap>& taps) {
    const auto width = static_cast<std::size_t>(m_out.width());
    PixelSum* sums = m_sums.data() + static_cast<std::size_t>(y - m_out.crop.min.y) * width;
    for (std::size_t x = 0; x < width; ++x) {
      PixelSum sum = sums[x];
      for (const Tap& tap : taps)
        sum.add(rows[static_cast<std::size_t>(y + tap.row - kept)]
                    [x * static_cast<std::size_t>(m_count) + tap.sample],
                tap.weight);
      sums[x] = sum;
    }
  }

  void finish() {
    const double unitsPerMeter = 1.0 / m_options.space.metersPerUnit;
    for (std::size_t i = 0; i < m_sums.size(); ++i) {
      const RayRadiance mean = m_sums[i].mean();
      m_out.single[i] = mean.single;
      m_out.multiple[i] = mean.multiple;
      m_out.emission[i] = mean.emission;
      m_out.background[i] = mean.background;
      m_out.beauty[i] = mean.total();
      m_out.transmittance[i] = mean.transmittance;
      m_out.alpha[i] = 1.0f - meanComponent(m_out.transmittance[i]);
      if (mean.opacity > 1e-6f)
        m_out.depth[i] =
            static_cast<float>(static_cast<double>(mean.depth / mean.opacity) * unitsPerMeter);
    }
  }

  const cameras::Camera& m_camera;
  const Integrator& m_integrator;
  const FrameOptions& m_options;
  FrameLayers& m_out;
  PixelFilter m_filter;
  int m_border;
  cameras::Placement m_still;
  int m_first = 0, m_row = 0;  // next: samples from m_first on, of pixels from row m_row on
  int m_bandRows = kBandRows;
  int m_count = 0;
  std::array<Vec2d, kSamplesAtOnce> m_offsets{};
  std::vector<PixelSum> m_sums;
  std::mutex m_mutex;
};

}  // namespace

PixelFilter::PixelFilter(FilterKind kind, double width) : m_kind(kind) {
  const double own = kind == FilterKind::box ? 1.0 : kind == FilterKind::triangle ? 2.0 : 3.0;
  m_radius = 0.5 * (width > 0 ? width : own);
}

float PixelFilter::profile(double x) const {
  const double t = std::abs(x) / m_radius;  // 0 at the centre, 1 at the edge
  if (t > 1.0) return 0.0f;
  switch (m_kind) {
    case FilterKind::box:
      return 1.0f;
    case FilterKind::triangle:
      return static_cast<float>(1.0 - t);
    case FilterKind::blackmanHarris: {
      // Four-term window (Harris 1978), its argument counted from the centre.
      const double a = kPi * t;
      return static_cast<float>(0.35875 + 0.48829 * std::cos(a) + 0.14128 * std::cos(2 * a) +
                                0.01168 * std::cos(3 * a));
    }
  }
  return 0.0f;
}

void setMultiple(FrameLayers& layers, std::vector<Rgb> multiple) {
  layers.multiple = std::move(multiple);
  for (std::size_t i = 0; i < layers.beauty.size(); ++i)
    layers.beauty[i] =
        layers.single[i] + layers.multiple[i] + layers.emission[i] + layers.background[i];
}

FrameLayers renderFrame(const cameras::Camera& camera, const Integrator& integrator,
                        const FrameOptions& options) {
  FrameLayers out;
  out.crop = options.crop;
  out.resolution = camera.resolution();
  const auto pixels =
      static_cast<std::size_t>(out.width()) * static_cast<std::size_t>(out.height());
  for (auto* layer : {&out.beauty, &out.single, &out.multiple, &out.emission, &out.background,
                      &out.transmittance})
    layer->assign(pixels, Rgb(0.0f));
  out.alpha.assign(pixels, 0.0f);
  out.depth.assign(pixels, kNoDepth);
  FrameLoop(camera, integrator, options, out).run();
  return out;
}

}  // namespace photosphere::render
