#include "reference.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>

#include "child.h"
#include "photosphere/core/error.h"
#include "photosphere/core/log.h"
#include "photosphere/core/resources.h"
#include "photosphere/core/shipped_data.h"
#include "photosphere/image/exr.h"
#include "photosphere/image/metrics.h"

namespace photosphere::study {

namespace fs = std::filesystem;

namespace {

constexpr std::array<const char*, 2> kMeanLayers{"", "multiple"};
constexpr std::array<const char*, 2> kVarianceLayers{"variance", "multiple_variance"};
constexpr const char* kSamples = "photosphere:samples";
constexpr const char* kPairs = "photosphere:pairs";
constexpr const char* kMethod = "photosphere:method";
constexpr const char* kKey = "photosphere:reference_key";

// Paths from the eye serve every scene.
constexpr std::array<const char*, 2> kMethods{"path_traced", "light_traced"};

// Seeds of chunks lie far from those that people choose for frames.
constexpr std::int64_t kFirstSeed = 7'000'000'000;

// A file that disappears with the object.
struct Scratch {
  explicit Scratch(fs::path file) : path(std::move(file)) {}
  ~Scratch() {
    std::error_code ignored;
    fs::remove(path, ignored);
  }
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;
  fs::path path;
};

Planes planesOf(const image::Image& image, const char* layer) {
  Planes planes;
  for (const char* letter : {"R", "G", "B"})
    planes.push_back(image.channel(image::Image::channelName(layer, letter)));
  return planes;
}

image::Image emptyReference(int width, int height) {
  image::Image image(width, height);
  for (const char* layer : {"", "multiple", "transmittance", "variance", "multiple_variance"})
    image.addLayer(layer, image::ChannelKind::data);
  return image;
}

// Weighted means of both, where `oldShare` is the samples of the old over those of both.
void mixMeans(std::span<float> into, std::span<const float> a, std::span<const float> b,
              double oldShare) {
  for (std::size_t i = 0; i < into.size(); ++i) {
    const double pair = 0.5 * (static_cast<double>(a[i]) + static_cast<double>(b[i]));
    into[i] = static_cast<float>(oldShare * static_cast<double>(into[i]) + (1 - oldShare) * pair);
  }
}

// Variance of the weighted mean of independent estimates.
void mixVariances(std::span<float> into, std::span<const float> pair, double oldShare) {
  const double newShare = 1 - oldShare;
  for (std::size_t i = 0; i < into.size(); ++i)
    into[i] = static_cast<float>(oldShare * oldShare * static_cast<double>(into[i]) +
                                 newShare * newShare * static_cast<double>(pair[i]));
}

std::uint64_t countAttribute(const fs::path& path, const image::ExrAttributes& attributes,
                             const char* name) {
  const auto found = attributes.find(name);
  const std::string* text =
      found == attributes.end() ? nullptr : std::get_if<std::string>(&found->second);
  if (!text || text->empty() || text->size() > 18 ||
      !std::all_of(text->begin(), text->end(), [](unsigned char c) { return std::isdigit(c); }))
    throw InputError(path.string(),
                     fmt::format("is no reference of a study: attribute {} is missing or no "
                                 "number; delete the file to render it anew",
                                 name));
  return std::stoull(*text);
}

// The file whose name ends with the key, or an empty path.
fs::path referenceIn(const fs::path& folder, const std::string& key) {
  if (folder.empty()) return {};
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error))
    if (entry.path().extension() == ".exr" && entry.path().stem().string().ends_with("-" + key))
      return entry.path();
  return {};
}

}  // namespace

Planes ReferenceImage::mean(std::size_t layer) const {
  return planesOf(pixels, kMeanLayers[layer]);
}

Planes ReferenceImage::variance(std::size_t layer) const {
  return planesOf(pixels, kVarianceLayers[layer]);
}

std::array<double, 2> ReferenceImage::noise() const {
  std::array<double, 2> noise{};
  if (empty()) return {kInfinity, kInfinity};
  for (std::size_t layer = 0; layer < kLayers.size(); ++layer) {
    image::MeasureOptions options;
    options.referenceVariance = variance(layer);
    noise[layer] =
        image::measure(mean(layer), mean(layer), pixels.width(), Vec2i(0), options).referenceNoise;
  }
  return noise;
}

void addPair(ReferenceImage& reference, const image::Image& a, const image::Image& b,
             std::uint64_t samples) {
  if (reference.empty()) reference.pixels = emptyReference(a.width(), a.height());
  const image::Image& old = reference.pixels;
  if (a.dataWindow() != old.dataWindow() || b.dataWindow() != old.dataWindow())
    throw ConfigError("a chunk of the reference has another size than what is there already");
  const auto before = static_cast<double>(reference.samples);
  const double share = before / (before + 2 * static_cast<double>(samples));
  for (const char* layer : {"", "multiple", "transmittance"})
    for (const char* letter : {"R", "G", "B"}) {
      const std::string name = image::Image::channelName(layer, letter);
      mixMeans(reference.pixels.channel(name), a.channel(name), b.channel(name), share);
    }
  for (std::size_t layer = 0; layer < kLayers.size(); ++layer)
    for (const char* letter : {"R", "G", "B"}) {
      const std::string name = image::Image::channelName(kMeanLayers[layer], letter);
      mixVariances(
          reference.pixels.channel(image::Image::channelName(kVarianceLayers[layer], letter)),
          image::varianceOfMean(a.channel(name), b.channel(name)), share);
    }
  reference.samples += 2 * samples;
  ++reference.pairs;
}

void writeReference(const fs::path& path, const ReferenceImage& reference, const std::string& key) {
  image::ExrAttributes attributes;
  attributes[kSamples] = std::to_string(reference.samples);
  attributes[kPairs] = std::to_string(reference.pairs);
  attributes[kMethod] = reference.method;
  attributes[kKey] = key;
  attributes["comments"] = std::string(
      "Reference of photosphere study: mean (R, G, B, multiple, transmittance) and "
      "variance of that mean (variance, multiple_variance)");
  // What was read back and goes on has lost its channels' kinds; half would lose small variances.
  image::ExrOptions options;
  options.floatColor = true;
  image::writeExr(path, reference.pixels, attributes, options);
}

std::optional<ReferenceImage> readReference(const fs::path& path, const std::string& key) {
  std::error_code error;
  if (!fs::exists(path, error)) return std::nullopt;
  image::ExrFile file = image::readExr(path);
  const auto found = file.attributes.find(kKey);
  const std::string* written =
      found == file.attributes.end() ? nullptr : std::get_if<std::string>(&found->second);
  if (!written || *written != key)
    throw InputError(path.string(),
                     "is not the reference of this scene, whatever its name says; move it away");
  ReferenceImage reference;
  reference.samples = countAttribute(path, file.attributes, kSamples);
  reference.pairs = countAttribute(path, file.attributes, kPairs);
  // Files without it are older than the choice.
  if (const auto method = file.attributes.find(kMethod); method != file.attributes.end())
    if (const std::string* name = std::get_if<std::string>(&method->second))
      reference.method = *name;
  if (std::find(kMethods.begin(), kMethods.end(), reference.method) == kMethods.end())
    throw InputError(path.string(),
                     fmt::format("is a reference made in an unknown way, '{}'; delete the file to "
                                 "render it anew",
                                 reference.method));
  const image::Image wanted = emptyReference(file.image.width(), file.image.height());
  for (const image::Channel& channel : wanted.channels())
    if (!file.image.has(channel.name))
      throw InputError(path.string(), fmt::format("is no reference of a study: it lacks channel "
                                                  "{}; delete the file to render it anew",
                                                  channel.name));
  reference.pixels = std::move(file.image);
  return reference;
}

std::array<double, 2> roughNoise(const ReferenceImage& a, const ReferenceImage& b) {
  constexpr int kEdge = 8;
  constexpr double kUnlikely = 4;  // two standard errors
  const int width = a.pixels.width(), height = a.pixels.height();
  std::array<double, 2> sum{};
  for (std::size_t layer = 0; layer < kLayers.size(); ++layer) {
    const Planes means[] = {a.mean(layer), b.mean(layer)};
    const Planes variances[] = {a.variance(layer), b.variance(layer)};
    for (std::size_t c = 0; c < means[0].size(); ++c) {
      // Sums over pixels [x0, x1) of [y0, y1).
      const auto total = [&](const Planes& planes, int x0, int y0, int x1, int y1) {
        double all = 0;
        for (int y = y0; y < y1; ++y)
          for (int x = x0; x < x1; ++x)
            all += static_cast<double>(planes[c][static_cast<std::size_t>(y * width + x)]);
        return all;
      };
      const double whole =
          0.5 * (total(means[0], 0, 0, width, height) + total(means[1], 0, 0, width, height)) /
          (static_cast<double>(width) * height);
      for (int y = 0; y < height; y += kEdge)
        for (int x = 0; x < width; x += kEdge) {
          const int x1 = std::min(x + kEdge, width), y1 = std::min(y + kEdge, height);
          const double n = (x1 - x) * (y1 - y);
          const double first = total(means[0], x, y, x1, y1) / n,
                       second = total(means[1], x, y, x1, y1) / n;
          const double own[] = {total(variances[0], x, y, x1, y1),
                                total(variances[1], x, y, x1, y1)};
          const double missed = std::max(
              0.0, (first - second) * (first - second) - kUnlikely * (own[0] + own[1]) / (n * n));
          const double scale = 0.5 * (first + second) + whole;
          if (!(scale > 0)) continue;
          for (const std::size_t which : {0u, 1u})
            sum[which] += (own[which] + ((first < second) == (which == 0) ? n * missed : 0.0)) /
                          (scale * scale);
        }
    }
  }
  const double values = 6.0 * width * height;
  return {sum[0] / values, sum[1] / values};
}

ReferenceMaker::ReferenceMaker(const SceneSource& truth, std::int64_t frame,
                               const std::string& name, std::string key, fs::path folder, int chunk)
    : m_frame(frame),
      m_key(std::move(key)),
      m_folder(std::move(folder)),
      m_file(m_folder / fmt::format("{}-{}.exr", fileStem(name), m_key)),
      m_chunk(chunk) {
  for (const char* type : kMethods)
    m_methods.push_back({type, truth.open({std::string("estimator.type=") + type})});
  // Another scene's study may have made it under that scene's name.
  if (const fs::path found = referenceIn(m_folder, m_key); !found.empty()) m_file = found;
  load(m_file);
  if (m_image.empty()) load(referenceIn(shippedStudies(), m_key));
}

void ReferenceMaker::load(const fs::path& path) {
  if (path.empty()) return;
  auto found = readReference(path, m_key);
  if (!found) return;
  m_image = std::move(*found);
  m_origin = path.string();
  m_samplesBefore = m_image.samples;
  log::info("reference: {} has {} samples a pixel", m_origin, m_image.samples);
}

bool ReferenceMaker::addPair(const Method& method, bool mayFail, ReferenceImage& image) const {
  image::Image halves[2];
  for (int half = 0; half < 2; ++half) {
    RenderJob job;
    job.scene = method.scene;
    job.scene.estimator.set("samples", static_cast<std::int64_t>(m_chunk), "reference");
    job.frame = m_frame;
    job.request.seed = kFirstSeed + 2 * static_cast<std::int64_t>(image.pairs) + half;
    // Two studies may share this folder.
    const Scratch scratch(m_folder / fmt::format(".chunk-{}-{}.exr", m_key, getpid()));
    job.image = scratch.path;
    const RenderOutcome outcome = renderInChild(job);
    // Not every scene can be rendered from the lamps; what else fails is worth knowing of.
    if (outcome.failed && mayFail && outcome.code == ExitCode::usage) {
      log::info("reference: no {} paths: {}", method.type, outcome.message);
      return false;
    }
    if (outcome.failed) throw Error(outcome.code, "reference: " + outcome.message);
    halves[half] = image::readExr(job.image).image;
  }
  study::addPair(image, halves[0], halves[1], static_cast<std::uint64_t>(m_chunk));
  return true;
}

std::optional<ReferenceImage> ReferenceMaker::firstPair(const Method& method, bool mayFail,
                                                        double& seconds) const {
  ReferenceImage image;
  image.method = method.type;
  const Stopwatch watch;
  if (!addPair(method, mayFail, image)) return std::nullopt;
  seconds = watch.seconds();
  return image;
}

// A pair by each method; that of the one which is quieter in the same time stays.
void ReferenceMaker::begin() {
  std::array<double, 2> seconds{};
  m_image = *firstPair(m_methods[0], false, seconds[0]);
  m_pairSeconds = seconds[0];
  const auto other = firstPair(m_methods[1], true, seconds[1]);
  if (!other) return;
  const std::array<double, 2> noise = roughNoise(m_image, *other);
  for (std::size_t i : {0, 1})
    log::debug("reference: {}: noise {:.3g} in {:.3g} s", m_methods[i].type, noise[i], seconds[i]);
  if (!(noise[1] * seconds[1] < noise[0] * seconds[0])) return;
  m_image = *other;
  m_pairSeconds = seconds[1];
}

void ReferenceMaker::addPair() {
  const Stopwatch watch;
  if (m_image.empty()) {
    begin();
  } else {
    const auto method = std::find_if(m_methods.begin(), m_methods.end(),
                                     [&](const Method& m) { return m.type == m_image.method; });
    addPair(*method, false, m_image);
    m_pairSeconds = watch.seconds();
  }
  writeReference(m_file, m_image, m_key);
  m_seconds += watch.seconds();
}

std::string fileStem(const std::string& text) {
  std::string stem;
  for (const char c : text)
    stem += std::isalnum(static_cast<unsigned char>(c)) || c == '-' ? c : '_';
  return stem.empty() ? "scene" : stem.substr(0, 64);
}

fs::path shippedStudies() {
  return findShipped("studies").value_or(fs::path());
}

}  // namespace photosphere::study
