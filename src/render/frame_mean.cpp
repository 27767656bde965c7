#include "photosphere/render/frame.h"

namespace photosphere::render {

namespace {

template <class T>
void addTo(std::vector<T>& sum, const std::vector<T>& values) {
  for (std::size_t i = 0; i < sum.size(); ++i)
    sum[i] += values[i];
}

template <class T>
void scale(std::vector<T>& values, float factor) {
  for (T& v : values)
    v *= factor;
}

constexpr std::vector<Rgb> FrameLayers::*kColours[] = {
    &FrameLayers::beauty,   &FrameLayers::single,     &FrameLayers::multiple,
    &FrameLayers::emission, &FrameLayers::background, &FrameLayers::transmittance};

// What a sum of frames is made of.
template <class Layers, class State>
void eachMember(Layers& layers, State& state) {
  state.value(layers.crop);
  state.value(layers.resolution);
  for (const auto layer : kColours)
    state.value(layers.*layer);
  state.value(layers.alpha);
  state.value(layers.depth);
  state.value(layers.nanSamples);
  state.value(layers.negativeSamples);
  state.value(layers.firstBad);
  state.value(layers.counters);
}

}  // namespace

void FrameMean::add(const FrameLayers& frame) {
  if (m_count++ == 0) {
    m_sum = frame;
    return;
  }
  if (m_count == 2)
    for (std::size_t i = 0; i < m_sum.depth.size(); ++i)
      m_sum.depth[i] *= m_sum.alpha[i];
  for (const auto layer : kColours)
    addTo(m_sum.*layer, frame.*layer);
  addTo(m_sum.alpha, frame.alpha);
  for (std::size_t i = 0; i < frame.depth.size(); ++i)
    m_sum.depth[i] += frame.depth[i] * frame.alpha[i];
  m_sum.nanSamples += frame.nanSamples;
  m_sum.negativeSamples += frame.negativeSamples;
  if (m_sum.firstBad.x < 0) m_sum.firstBad = frame.firstBad;
  m_sum.counters.add(frame.counters);
}

FrameLayers FrameMean::mean() const {
  FrameLayers out = m_sum;
  if (m_count < 2) return out;
  for (std::size_t i = 0; i < out.depth.size(); ++i)
    out.depth[i] = m_sum.alpha[i] > 0.0f ? m_sum.depth[i] / m_sum.alpha[i] : kNoDepth;
  const float factor = 1.0f / static_cast<float>(m_count);
  for (const auto layer : kColours)
    scale(out.*layer, factor);
  scale(out.alpha, factor);
  return out;
}

void FrameMean::keep(StateWriter& w) const {
  w.value(m_count);
  eachMember(m_sum, w);
}

void FrameMean::resume(StateReader& r) {
  r.value(m_count);
  eachMember(m_sum, r);
}

}  // namespace photosphere::render
