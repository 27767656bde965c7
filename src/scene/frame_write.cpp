// A frame as a file: channels, header, preview.

#include <fmt/format.h>

#include <algorithm>

#include "photosphere/core/frames.h"
#include "photosphere/core/resources.h"
#include "photosphere/core/version.h"
#include "photosphere/scene/plan.h"

namespace photosphere::scene {

namespace {

void copyLayer(image::Image& to, const std::string& layer, image::ChannelKind kind,
               const std::vector<Rgb>& pixels) {
  to.addLayer(layer, kind);
  constexpr std::string_view letters[] = {"R", "G", "B"};
  for (int c = 0; c < 3; ++c) {
    const std::span<float> out =
        to.channel(image::Image::channelName(layer, letters[static_cast<std::size_t>(c)]));
    for (std::size_t i = 0; i < pixels.size(); ++i)
      out[i] = pixels[i][c];
  }
}

void copyPlane(image::Image& to, const std::string& name, const std::vector<float>& pixels) {
  const std::span<float> out = to.addChannel(name);
  std::copy(pixels.begin(), pixels.end(), out.begin());
}

image::Image emptyImage(const render::FrameLayers& layers) {
  const image::Window data{layers.crop.min.x, layers.crop.min.y, layers.width(), layers.height()};
  return {data, {0, 0, layers.resolution.x, layers.resolution.y}};
}

std::string secondsText(const StageSeconds& s) {
  return fmt::format("read {:.3f}, rasterize {:.3f}, trace {:.3f}, resolve {:.3f}, march {:.3f}",
                     s.read, s.rasterize, s.trace, s.resolve, s.march);
}

std::string boundsText(const std::vector<EffectState>& effects) {
  std::vector<std::string> parts;
  for (const EffectState& effect : effects)
    if (effect.bound) parts.push_back(fmt::format("{} {:.3g}", effect.name, *effect.bound));
  return fmt::format("{}", fmt::join(parts, ", "));
}

image::ExrAttributes header(const FrameResult& result,
                            const std::optional<image::Chromaticities>& chromaticities) {
  const FrameStatistics& s = result.statistics;
  image::FrameMetadata metadata;
  metadata.worldToCamera = result.cameraFromWorld;
  metadata.worldToNDC = result.ndcFromWorld;
  metadata.chromaticities = chromaticities;
  metadata.framesPerSecond = result.framesPerSecond;
  metadata.frame = result.frame;
  metadata.capDate = image::currentCapDate();
  metadata.software = versionText();
  auto& own = metadata.photosphere;
  own["estimator"] = result.estimator;
  own["photons"] = fmt::format("emitted {}, stored {}", s.photonsEmitted, s.photonsStored);
  if (!result.layout.empty()) {
    own["radius"] = fmt::format("{:.6g}", result.radius);
    own["histogram"] = result.layout;
  }
  own["scene_hash"] = s.sceneHash;
  own["medium_hash"] = s.mediumHash;
  own["seed"] = std::to_string(result.seed);
  own["effects"] = planLine(s.effects);
  own["effect_bounds"] = boundsText(s.effects);
  if (s.error)
    own["error"] = fmt::format("{:.4g} relative (noise {:.4g}, bias {:.4g}) from {} batches",
                               s.error->total(), s.error->noise, s.error->bias, s.batches);
  own["seconds"] = secondsText(s.seconds);
  own["peak_memory_bytes"] = std::to_string(s.peakMemoryBytes);
  return image::frameAttributes(metadata);
}

}  // namespace

image::Image frameImage(const FrameResult& result, const std::vector<std::string>& aovs) {
  ParamValues(outputParams()).set("aovs", aovs, "[output]");  // refuses what is no layer
  const std::vector<std::string>& names = aovs.empty() ? result.layerNames : aovs;
  const auto wanted = [&](std::string_view name) {
    return std::find(names.begin(), names.end(), name) != names.end();
  };
  const render::FrameLayers& layers = result.layers;
  image::Image out = emptyImage(layers);
  if (wanted("beauty")) {
    copyLayer(out, "", image::ChannelKind::color, layers.beauty);
    copyPlane(out, "A", layers.alpha);
  }
  using Pixels = std::vector<Rgb> render::FrameLayers::*;
  const std::pair<std::string, Pixels> colours[] = {
      {"single", &render::FrameLayers::single},
      {"multiple", &render::FrameLayers::multiple},
      {"emission", &render::FrameLayers::emission},
      {"background", &render::FrameLayers::background},
      {"transmittance", &render::FrameLayers::transmittance}};
  for (const auto& [name, pixels] : colours)
    if (wanted(name)) copyLayer(out, name, image::ChannelKind::color, layers.*pixels);
  if (wanted("error")) copyLayer(out, "error", image::ChannelKind::data, result.error);
  if (wanted("depth")) copyPlane(out, "Z", layers.depth);
  return out;
}

FrameWriter::FrameWriter(const SceneFile& scene, WriteRequest request)
    : m_request(std::move(request)),
      m_layers(scene.output.list("aovs")),
      m_config(image::ColorConfig::load(m_request.ocioConfig)),
      m_chromaticities(m_config.chromaticities(scene.output.text("colorspace"))) {
  m_display.renderingSpace = scene.output.text("colorspace");
  m_display.display = m_request.ocioDisplay;
  m_display.view = m_request.ocioView;
  m_display.exposure = m_request.exposure;
  if (!m_request.preview.empty()) image::checkPreview(m_request.preview, m_config, m_display);
}

void FrameWriter::write(FrameResult& result) const {
  const Stopwatch watch;
  if (!m_request.path.empty()) {
    image::ExrOptions options;
    options.floatColor = m_request.floatColor;
    options.compression = m_request.compression;
    image::writeExr(framePath(m_request.path, result.frame), frameImage(result, m_layers),
                    header(result, m_chromaticities), options);
  }
  if (!m_request.preview.empty())
    image::writePreview(framePath(m_request.preview, result.frame), frameImage(result, {"beauty"}),
                        m_config, m_display);
  result.statistics.seconds.write = watch.seconds();
  result.statistics.seconds.total += watch.seconds();
}

}  // namespace photosphere::scene
