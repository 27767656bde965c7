#include "stability_frame.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "child.h"
#include "photosphere/image/exr.h"

namespace photosphere::study {

namespace {

using nlohmann::json;

const std::vector<Rgb>& layerOf(const render::FrameLayers& layers, const std::string& name) {
  if (name == "single") return layers.single;
  if (name == "multiple") return layers.multiple;
  if (name == "emission") return layers.emission;
  if (name == "transmittance") return layers.transmittance;
  return layers.beauty;
}

// Type of the colour channels as they came back, and what is not finite in any of the file's.
std::string writtenType(scene::FrameResult& frame, const StabilityFrameJob& job) {
  scene::WriteRequest request;
  request.path = job.exr.string();
  scene::FrameWriter(job.scene, request).write(frame);
  const image::ExrFile file = image::readExr(job.exr);
  for (const image::Channel& channel : file.image.channels())
    for (const float v : channel.pixels)
      if (!std::isfinite(v)) return fmt::format("{} in channel {}", v, channel.name);
  bool isHalf = true;  // what it could not hold would be infinite
  for (const char* name : {"R", "G", "B"})
    for (const float v : file.image.channel(name))
      isHalf = isHalf && std::abs(v) <= 65504.0f;
  return isHalf ? "half" : "float";
}

// Sums of the frames of all seeds.
class Mean {
 public:
  explicit Mean(const StabilityFrameJob& job) : m_job(job) {}

  void add(scene::FrameResult frame) {
    const std::vector<Rgb>& pixels = layerOf(frame.layers, m_job.layer);
    m_width = frame.layers.width();
    m_height = frame.layers.height();
    m_sums.resize(3 * static_cast<std::size_t>(m_width) * static_cast<std::size_t>(m_height));
    // A layer that the frame does not have is black.
    for (std::size_t i = 0; i < pixels.size() && 3 * i + 2 < m_sums.size(); ++i)
      for (int c = 0; c < 3; ++c)
        m_sums[3 * i + static_cast<std::size_t>(c)] += static_cast<double>(pixels[i][c]);
    const scene::FrameStatistics& s = frame.statistics;
    m_nans += s.nanSamples;
    m_negatives += s.negativeSamples;
    m_violations += s.majorantViolations;
    m_emitted += s.energyEmitted.x + s.energyEmitted.y + s.energyEmitted.z;
    m_capped += s.energyCapped.x + s.energyCapped.y + s.energyCapped.z;
    std::string notes;  // those of the last frame stand for all
    for (const std::string& note : frame.notes)
      notes += note + "; ";
    m_answer["notes"] = notes;
    if (!m_job.writes.empty()) m_answer["type"] = writtenType(frame, m_job);
  }

  std::string text() {
    for (double& sum : m_sums)
      sum /= m_job.seeds;
    m_answer["nan"] = m_nans;
    m_answer["negative"] = m_negatives;
    m_answer["violations"] = m_violations;
    m_answer["capped"] = m_emitted > 0 ? m_capped / m_emitted : 0.0;
    m_answer["width"] = m_width;
    m_answer["height"] = m_height;
    m_answer["pixels"] = m_sums;
    return m_answer.dump();
  }

 private:
  const StabilityFrameJob& m_job;
  int m_width = 0, m_height = 0;
  std::vector<double> m_sums;
  std::uint64_t m_nans = 0, m_negatives = 0, m_violations = 0;
  double m_emitted = 0, m_capped = 0;
  json m_answer;
};

std::string frameWork(const StabilityFrameJob& job) {
  Mean mean(job);
  try {
    for (int i = 0; i < job.seeds; ++i) {
      scene::RenderRequest request = job.request;
      if (job.seeds > 1) request.seed = 1000 + i;
      mean.add(scene::renderScene(job.scene, 1, request));
    }
  } catch (const scene::SampleError& error) {
    return json{{"bad", error.what()}, {"nan", error.nans()}, {"negative", error.negatives()}}
        .dump();
  }
  return mean.text();
}

bool allFinite(const StabilityFrame& frame) {
  return std::all_of(frame.pixels.begin(), frame.pixels.end(),
                     [](double v) { return std::isfinite(v); });
}

// Means of blocks, row by row, by channel.
std::vector<double> blockMeans(const StabilityFrame& frame, int block) {
  const int across = (frame.width + block - 1) / block, down = (frame.height + block - 1) / block;
  std::vector<double> sums(3 * static_cast<std::size_t>(across) * static_cast<std::size_t>(down));
  std::vector<double> counts(sums.size());
  for (int y = 0; y < frame.height; ++y)
    for (int x = 0; x < frame.width; ++x)
      for (int c = 0; c < 3; ++c) {
        const auto at = static_cast<std::size_t>(3 * (y / block * across + x / block) + c);
        sums[at] += frame.pixels[static_cast<std::size_t>(3 * (y * frame.width + x) + c)];
        counts[at] += 1;
      }
  for (std::size_t i = 0; i < sums.size(); ++i)
    sums[i] /= counts[i];
  return sums;
}

}  // namespace

StabilityFrame renderStabilityFrame(const StabilityFrameJob& job) {
  const ChildResult child = runInChild([&] { return frameWork(job); }, job.cpuLimit);
  StabilityFrame frame;
  frame.seconds = child.seconds;
  frame.failed = child.failed;
  frame.code = child.code;
  frame.message = child.message;
  if (child.failed) return frame;
  const json values = json::parse(child.text);
  frame.nanSamples = values.at("nan");
  frame.negativeSamples = values.at("negative");
  if (values.contains("bad")) {
    frame.failed = true;
    frame.code = ExitCode::unspecified;
    frame.message = values.at("bad");
    return frame;
  }
  frame.majorantViolations = values.at("violations");
  frame.cappedShare = values.at("capped");
  frame.notes = values.at("notes");
  frame.width = values.at("width");
  frame.height = values.at("height");
  if (values.contains("type")) frame.fileType = values.at("type");
  for (const json& v : values.at("pixels"))
    frame.pixels.push_back(v.is_null() ? std::numeric_limits<double>::quiet_NaN()
                                       : v.get<double>());
  return frame;
}

double meanOf(const StabilityFrame& frame) {
  double sum = 0;
  for (const double v : frame.pixels)
    sum += v;
  return frame.pixels.empty() ? 0 : sum / static_cast<double>(frame.pixels.size());
}

double blockError(const StabilityFrame& frame, const StabilityFrame& reference, int block,
                  double scale) {
  constexpr double none = std::numeric_limits<double>::infinity();
  if (frame.width != reference.width || frame.height != reference.height) return none;
  if (!allFinite(frame) || !allFinite(reference)) return none;
  const std::vector<double> a = blockMeans(frame, block), b = blockMeans(reference, block);
  double mean = 0;
  for (const double v : b)
    mean += v * scale / static_cast<double>(b.size());
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const double ref = b[i] * scale, d = a[i] - ref;
    if (d != 0) sum += d * d / (ref * ref + 0.01 * mean * mean);
  }
  return std::sqrt(sum / static_cast<double>(a.size()));
}

double meanError(const StabilityFrame& frame, const StabilityFrame& reference, double scale) {
  return blockError(frame, reference, std::max(frame.width, frame.height), scale);
}

double frameError(const StabilityFrame& frame, const StabilityFrame& reference, int block,
                  double scale) {
  return std::max(blockError(frame, reference, block, scale), meanError(frame, reference, scale));
}

}  // namespace photosphere::study
