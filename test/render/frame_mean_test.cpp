// The mean of frames, layer by layer.

#include <gtest/gtest.h>

#include "photosphere/render/frame.h"

namespace photosphere::test {

namespace {

render::FrameLayers onePixel(float value, float alpha, float depth) {
  render::FrameLayers f;
  f.crop = {Vec2i(3, 4), Vec2i(4, 5)};
  f.resolution = Vec2i(10);
  f.beauty = {Rgb(value)};
  f.single = {Rgb(value, 0, 0)};
  f.multiple = {Rgb(0, value, 0)};
  f.emission = {Rgb(2 * value)};
  f.background = {Rgb(3 * value)};
  f.transmittance = {Rgb(1 - alpha)};
  f.alpha = {alpha};
  f.depth = {depth};
  f.nanSamples = 1;
  f.counters.scatterings = 5;
  return f;
}

TEST(FrameMeanTest, AveragesEveryLayer) {
  render::FrameMean mean;
  mean.add(onePixel(1.0f, 0.5f, 10.0f));
  mean.add(onePixel(3.0f, 0.0f, render::kNoDepth));
  render::FrameLayers last = onePixel(8.0f, 1.0f, 4.0f);
  last.firstBad = Vec2i(3, 4);
  mean.add(last);
  EXPECT_EQ(mean.count(), 3);
  const render::FrameLayers f = mean.mean();
  EXPECT_EQ(f.beauty[0], Rgb(4.0f));
  EXPECT_EQ(f.single[0], Rgb(4, 0, 0));
  EXPECT_EQ(f.multiple[0], Rgb(0, 4, 0));
  EXPECT_EQ(f.emission[0], Rgb(8.0f));
  EXPECT_EQ(f.background[0], Rgb(12.0f));
  EXPECT_FLOAT_EQ(f.alpha[0], 0.5f);
  EXPECT_FLOAT_EQ(f.transmittance[0].x, 0.5f);
  // Weighed with what was opaque: a pass that met nothing has no depth to give.
  EXPECT_FLOAT_EQ(f.depth[0], (0.5f * 10 + 1.0f * 4) / 1.5f);
  EXPECT_EQ(f.nanSamples, 3u);
  EXPECT_EQ(f.counters.scatterings, 15u);
  EXPECT_EQ(f.firstBad, Vec2i(3, 4));
  EXPECT_EQ(f.crop.min, Vec2i(3, 4));
}

TEST(FrameMeanTest, NothingMetStaysWithoutDepth) {
  render::FrameMean mean;
  mean.add(onePixel(0.0f, 0.0f, render::kNoDepth));
  mean.add(onePixel(0.0f, 0.0f, render::kNoDepth));
  EXPECT_EQ(mean.mean().depth[0], render::kNoDepth);
}

}  // namespace

}  // namespace photosphere::test
