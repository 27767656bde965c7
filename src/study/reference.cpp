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
constexpr const char* kKey = "photosphere:reference_key";

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
  attributes[kKey] = key;
  attributes["comments"] = std::string(
      "Path-traced reference of photosphere study: mean (R, G, B, multiple, transmittance) and "
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
  const image::Image wanted = emptyReference(file.image.width(), file.image.height());
  for (const image::Channel& channel : wanted.channels())
    if (!file.image.has(channel.name))
      throw InputError(path.string(), fmt::format("is no reference of a study: it lacks channel "
                                                  "{}; delete the file to render it anew",
                                                  channel.name));
  reference.pixels = std::move(file.image);
  return reference;
}

ReferenceMaker::ReferenceMaker(scene::SceneFile pathTraced, std::int64_t frame,
                               const std::string& name, std::string key, fs::path folder, int chunk)
    : m_scene(std::move(pathTraced)),
      m_frame(frame),
      m_key(std::move(key)),
      m_folder(std::move(folder)),
      m_file(m_folder / fmt::format("{}-{}.exr", fileStem(name), m_key)),
      m_chunk(chunk) {
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

void ReferenceMaker::addPair() {
  const Stopwatch watch;
  image::Image halves[2];
  for (int half = 0; half < 2; ++half) {
    RenderJob job;
    job.scene = m_scene;
    job.scene.estimator.set("samples", static_cast<std::int64_t>(m_chunk), "reference");
    job.frame = m_frame;
    job.request.seed = kFirstSeed + 2 * static_cast<std::int64_t>(m_image.pairs) + half;
    // Two studies may share this folder.
    const Scratch scratch(m_folder / fmt::format(".chunk-{}-{}.exr", m_key, getpid()));
    job.image = scratch.path;
    const RenderOutcome outcome = renderInChild(job);
    if (outcome.failed) throw Error(outcome.code, "reference: " + outcome.message);
    halves[half] = image::readExr(job.image).image;
  }
  study::addPair(m_image, halves[0], halves[1], static_cast<std::uint64_t>(m_chunk));
  writeReference(m_file, m_image, m_key);
  m_pairSeconds = watch.seconds();
  m_seconds += m_pairSeconds;
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
