// Frames that go on until their estimated error is small enough, and what the estimate is worth.

#include <cmath>

#include "fixture.h"
#include "photosphere/core/parallel.h"
#include "photosphere/core/rng.h"

namespace photosphere::test {
namespace {

using namespace scene;

// sqrt(relMSE) as METHOD.md section 7 defines it.
double relativeError(const std::vector<Rgb>& image, const std::vector<Rgb>& reference) {
  double mean = 0, sum = 0;
  for (const Rgb& r : reference)
    mean += static_cast<double>(r.x + r.y + r.z) / (3.0 * static_cast<double>(reference.size()));
  for (std::size_t i = 0; i < image.size(); ++i)
    for (int c = 0; c < 3; ++c) {
      const auto r = static_cast<double>(reference[i][c]);
      const double d = static_cast<double>(image[i][c]) - r;
      sum += d * d / (r * r + 0.01 * mean * mean);
    }
  return std::sqrt(sum / (3.0 * static_cast<double>(image.size())));
}

// A made-up frame of 80 x 50 pixels whose noise and bias are known.
struct MadeUp {
  std::vector<Rgb> truth, biased;  // without noise
  FrameError error{80};
  std::vector<Rgb> mean;
};

// `smooth` scales the frame as a whole and no kernel tells it; `fine` changes sign from pixel to
// pixel and grows with the kernel.
MadeUp madeUp(float smooth, float fine, int batches, int truths, float scale = 1.0f) {
  MadeUp m;
  Rng rng(RandomKey::fromSeed(21, 0), RandomStream::test, 0);
  const auto noise = [&](float size) {
    return scale * size * (Rgb(rng.uniform(), rng.uniform(), rng.uniform()) - 0.5f);
  };
  for (int i = 0; i < 4000; ++i) {
    const float x = static_cast<float>(i % 80) / 80, y = static_cast<float>(i) / 4000;
    const Rgb t = scale * Rgb(0.3f + x, 0.5f + y, 3.0f * x * y);
    m.truth.push_back(t);
    m.biased.push_back((1.0f + smooth + (i % 2 ? fine : -fine)) * t);
  }
  m.mean.resize(m.truth.size(), Rgb(0.0f));
  for (int b = 0; b < batches; ++b) {
    std::vector<Rgb> frame, wider;
    for (std::size_t i = 0; i < m.truth.size(); ++i) {
      const Rgb value = m.biased[i] + noise(0.3f);
      frame.push_back(value);
      wider.push_back(value + 0.5f * (i % 2 ? fine : -fine) * m.truth[i] + noise(0.02f));
      m.mean[i] += value / static_cast<float>(batches);
    }
    m.error.add(frame, wider, 1.5);
  }
  for (int b = 0; b < truths; ++b) {
    std::vector<Rgb> frame;
    for (const Rgb& t : m.truth)
      frame.push_back(t + noise(1.0f));
    m.error.addTruth(frame);
  }
  return m;
}

TEST(FrameErrorTest, FindsTheNoiseAndTheBiasThatAreThere) {
  const int batches = 8;
  for (const auto& [smooth, fine] :
       {std::pair{0.1f, 0.0f}, std::pair{0.0f, 0.08f}, std::pair{0.1f, 0.08f}}) {
    const MadeUp m = madeUp(smooth, fine, batches, 40);
    EXPECT_EQ(m.error.batches(), batches);
    EXPECT_EQ(m.error.truths(), 40);
    const ErrorEstimate e = m.error.estimate();
    std::vector<Rgb> noisy = m.truth;
    for (std::size_t i = 0; i < noisy.size(); ++i)
      noisy[i] += m.mean[i] - m.biased[i];
    EXPECT_NEAR(e.noise / relativeError(noisy, m.truth), 1.0, 0.05);
    EXPECT_NEAR(e.bias / relativeError(m.biased, m.truth), 1.0, 0.06) << smooth << " " << fine;
    EXPECT_NEAR(e.total() / relativeError(m.mean, m.truth), 1.0, 0.06);
    EXPECT_LT(e.doubt, 0.5 * e.bias);
    EXPECT_GT(e.bound(), e.total());
    double deviation = 0;
    for (const Rgb& s : m.error.standardError())
      deviation += static_cast<double>(s.x * s.x) / 4000;
    EXPECT_NEAR(std::sqrt(deviation), 0.3 / std::sqrt(12.0 * batches), 0.002);
  }
}

TEST(FrameErrorTest, NoiseAloneIsNotTakenForBias) {
  const ErrorEstimate e = madeUp(0, 0, 8, 8).error.estimate();
  EXPECT_GT(e.noise, 0.02);
  EXPECT_GT(e.doubt, 0.0);
  EXPECT_LT(e.bias, 2.5 * e.doubt);
}

// Four times the truths halve their variance twice, and with it the squared bias they can overlook.
TEST(FrameErrorTest, DoubtFallsWithTruths) {
  const double few = madeUp(0, 0, 32, 8).error.estimate().doubt;
  const double many = madeUp(0, 0, 32, 32).error.estimate().doubt;
  EXPECT_GT(few / many, 1.5);
  EXPECT_LT(few / many, 2.5);
  EXPECT_EQ(madeUp(0.1f, 0, 8, 1).error.estimate().doubt, 0.0);  // one truth tells nothing
}

TEST(FrameErrorTest, SaysNothingOfNothing) {
  FrameError error(2);
  EXPECT_EQ(error.estimate().total(), 0.0);
  for (int b = 0; b < 8; ++b)
    error.add(std::vector<Rgb>(4, Rgb(0.0f)));
  EXPECT_EQ(error.estimate().total(), 0.0);  // black is exactly black
}

// Radiances whose squares no float holds, of a sun or of a dim ember.
TEST(FrameErrorTest, AreRelativeWhateverTheRadiance) {
  const ErrorEstimate expected = madeUp(0.1f, 0.08f, 8, 20).error.estimate();
  for (const float scale : {1e30f, 1e-30f}) {
    const MadeUp m = madeUp(0.1f, 0.08f, 8, 20, scale);
    const ErrorEstimate e = m.error.estimate();
    EXPECT_NEAR(e.noise / expected.noise, 1.0, 1e-3) << scale;
    EXPECT_NEAR(e.bias / expected.bias, 1.0, 1e-2) << scale;
    EXPECT_NEAR(e.doubt / expected.doubt, 1.0, 1e-2) << scale;
    double deviation = 0;
    for (const Rgb& s : m.error.standardError())
      deviation += static_cast<double>(s.x) / static_cast<double>(scale) / 4000;
    EXPECT_NEAR(deviation, 0.3 / std::sqrt(12.0 * 8), 0.002) << scale;
  }
}

using Frame = std::vector<Rgb>;

Frame evenFrame(int pixels, float value, float noise, std::uint64_t seed) {
  Frame frame;
  Rng rng(RandomKey::fromSeed(seed, 0), RandomStream::test, 0);
  for (int i = 0; i < pixels; ++i)
    frame.emplace_back(value + noise * (rng.uniform() - 0.5f));
  return frame;
}

TEST(BlockNoise, IsThatOfTheFrames) {
  const Frame a[] = {evenFrame(4096, 1, 0.5f, 1), evenFrame(4096, 1, 0.5f, 2)};
  const Frame b[] = {evenFrame(4096, 1, 0.05f, 3), evenFrame(4096, 1, 0.05f, 4)};
  const auto noise = blockNoise({&a[0], &a[1]}, {&b[0], &b[1]}, 64);
  ASSERT_TRUE(noise);
  // By chance the other pair seems to miss some.
  EXPECT_GT((*noise)[1] / (*noise)[0], 0.005);
  EXPECT_LT((*noise)[1] / (*noise)[0], 0.2);
}

// Paths from the lamps that have met no pixel agree with each other to the bit.
TEST(BlockNoise, BlackFramesAreNotQuiet) {
  const Frame a[] = {evenFrame(4096, 1, 0.5f, 1), evenFrame(4096, 1, 0.5f, 2)};
  const Frame black(4096, Rgb(0.0f));
  const auto noise = blockNoise({&a[0], &a[1]}, {&black, &black}, 64);
  ASSERT_TRUE(noise);
  EXPECT_GT((*noise)[1], 10 * (*noise)[0]);
  const auto turned = blockNoise({&black, &black}, {&a[0], &a[1]}, 64);
  EXPECT_GT((*turned)[0], 10 * (*turned)[1]);
}

TEST(BlockNoise, IsOfSmallerBlocksInSmallFramesAndOfNoneInTiny) {
  const Frame a = evenFrame(64, 1, 0.5f, 1), b = evenFrame(64, 1, 0.5f, 2);
  EXPECT_TRUE(blockNoise({&a, &b}, {&b, &a}, 8));
  const Frame c = evenFrame(9, 1, 0.5f, 1);
  EXPECT_FALSE(blockNoise({&c, &c}, {&c, &c}, 3));
}

class TargetError : public ::testing::Test {
 protected:
  void SetUp() override {
    m_file = (m_folder / "ball.vdb").string();
    volume::writeVdb(m_file, {ballGrid("density", Vec3d(0.0), 0.1)});
  }
  SceneFile scene(const std::vector<std::string>& sets) {
    return parseScene(ballScene(m_file, Vec3d(0.0), 1.0), "test.toml", m_folder.path(), sets);
  }
  FrameResult render(const std::vector<std::string>& sets) { return renderScene(scene(sets), 1); }
  static std::string photons(std::uint64_t count) {
    return fmt::format("estimator.photons={}", fewer(count));
  }

  TemporaryFolder m_folder;
  std::string m_file;
};

// What each estimator says of itself against path tracing with sixty times the samples.
TEST_F(TargetError, TheEstimateIsTheErrorThatThereIs) {
  const RunOnly runOnly;
  const FrameResult truth =
      render({"estimator.type=path_traced", fmt::format("estimator.samples={}", fewer(1000))});
  const std::vector<std::string> ways[] = {
      {"estimator.type=path_traced", "estimator.samples=32"},
      {"estimator.type=light_traced", "estimator.samples=32"},
      {"estimator.type=photosphere", photons(20000)},
      {"estimator.type=photosphere", photons(400000), "estimator.radius=0.5"},
      {"estimator.type=photon_map", photons(40000)},
      {"estimator.type=photon_map", photons(100000), "estimator.radius=0.3"}};
  for (std::vector<std::string> sets : ways) {
    const std::string name = sets[0] + " " + sets[1];
    sets.emplace_back("render.target_error=10");
    const FrameResult r = render(sets);
    ASSERT_TRUE(r.statistics.error) << name;
    const double is = relativeError(r.layers.beauty, truth.layers.beauty);
    const ErrorEstimate e = *r.statistics.error;
    std::printf("  %s: estimate %.4f (noise %.4f, bias %.4f), error %.4f\n", name.c_str(),
                e.total(), e.noise, e.bias, is);
    EXPECT_EQ(r.statistics.batches, 8) << name;
    EXPECT_FALSE(r.statistics.targetMissed) << name;
    EXPECT_GT(e.total(), 0.7 * is) << name;
    EXPECT_LT(e.total(), 1.4 * is) << name;
  }
}

// The few pixels of a crop, at the edge of the smoke and in it, are judged as a frame is.
TEST_F(TargetError, OfACropIsThatOfItsPixels) {
  const RunOnly runOnly;
  for (const render::Crop& crop :
       {render::Crop{{2, 8}, {18, 24}}, render::Crop{{12, 12}, {20, 20}}}) {
    RenderRequest request;
    request.crop = crop;
    const auto with = [&](const std::vector<std::string>& sets) {
      return renderScene(scene(sets), 1, request);
    };
    const FrameResult truth =
        with({"estimator.type=path_traced", fmt::format("estimator.samples={}", fewer(2500))});
    for (std::vector<std::string> sets :
         {std::vector<std::string>{"estimator.type=path_traced", "estimator.samples=32"},
          {"estimator.type=light_traced", "estimator.samples=32"},
          {"estimator.type=photosphere", photons(400000), "estimator.radius=0.5"}}) {
      sets.emplace_back("render.target_error=10");
      const FrameResult r = with(sets);
      ASSERT_TRUE(r.statistics.error) << sets[0];
      const double is = relativeError(r.layers.beauty, truth.layers.beauty);
      const ErrorEstimate e = *r.statistics.error;
      std::printf("  %s: estimate %.4f (noise %.4f, bias %.4f), error %.4f\n", sets[0].c_str(),
                  e.total(), e.noise, e.bias, is);
      EXPECT_EQ(r.error.size(), truth.layers.beauty.size());
      EXPECT_GT(e.total(), 0.6 * is) << sets[0];
      EXPECT_LT(e.total(), 1.6 * is) << sets[0];
    }
  }
}

TEST_F(TargetError, GoesOnUntilItIsMet) {
  const auto until = [&](const std::string& target) {
    return render(
        {"estimator.type=path_traced", "estimator.samples=16", "render.target_error=" + target});
  };
  const FrameResult first = until("10");
  ASSERT_TRUE(first.statistics.error);
  const double target = 0.6 * first.statistics.error->total();
  const FrameResult r = until(fmt::format("{}", target));
  EXPECT_LE(r.statistics.error->total(), target);
  EXPECT_GT(r.statistics.error->total(), 0.85 * target);
  // Noise falls with the root of the batches: 8 / 0.36 = 22.
  EXPECT_NEAR(r.statistics.batches, 22, 8);
  EXPECT_FALSE(r.statistics.targetMissed);
  EXPECT_EQ(r.statistics.error->bias, 0.0);
  // The layer says where.
  EXPECT_EQ(r.error.size(), r.layers.beauty.size());
  EXPECT_EQ(r.layerNames.back(), "error");
  EXPECT_NE(frameImage(r, {"error"}).channel("error.R").size(), 0u);
  EXPECT_TRUE(contains(statsJson(r.statistics), "\"target_missed\": false"));
}

TEST_F(TargetError, EveryBatchHasPhotonsOfItsOwn) {
  const FrameResult plain = render({"estimator.photons=8000", "estimator.light_voxel=1"});
  const FrameResult r =
      render({"estimator.photons=8000", "estimator.light_voxel=1", "render.target_error=10"});
  EXPECT_EQ(r.statistics.photonsEmitted, 8000u);
  EXPECT_EQ(r.statistics.batches, 8);
  EXPECT_GT(r.statistics.error->noise, 0.0);
  EXPECT_NEAR(r.statistics.energyEmitted.x, plain.statistics.energyEmitted.x,
              1e-6 * plain.statistics.energyEmitted.x);
  EXPECT_FALSE(plain.statistics.error);
  EXPECT_TRUE(plain.error.empty());
}

TEST_F(TargetError, ABiasThatPhotonsCannotMendEndsIt) {
  const FrameResult r = render({"estimator.type=photon_map", "estimator.photons=20000",
                                "estimator.radius=0.6", "render.target_error=0.01"});
  EXPECT_TRUE(r.statistics.targetMissed);
  EXPECT_GE(r.statistics.error->bias, 0.01);
  ASSERT_FALSE(r.notes.empty());
  EXPECT_TRUE(contains(r.notes.back(), "estimator.radius")) << r.notes.back();
}

TEST_F(TargetError, TimeEndsItAfterThePartAtHand) {
  const FrameResult r =
      render({"estimator.photons=800", "render.time_limit=1e-9", "render.target_error=0.1"});
  EXPECT_EQ(r.statistics.batches, 1);
  EXPECT_TRUE(r.statistics.targetMissed);
  EXPECT_FALSE(r.statistics.error);  // one batch has no spread
  ASSERT_FALSE(r.notes.empty());
  EXPECT_TRUE(contains(r.notes.back(), "1 of the 8 parts")) << r.notes.back();
  const FrameResult limit = render({"estimator.photons=800", "render.time_limit=1e-9"});
  EXPECT_EQ(limit.statistics.batches, 1);
  EXPECT_FALSE(limit.statistics.targetMissed);
  const FrameResult ample = render({"estimator.photons=800", "render.time_limit=3600"});
  EXPECT_EQ(ample.statistics.batches, 8);
  EXPECT_FALSE(ample.statistics.targetMissed);
}

TEST_F(TargetError, ThreadsDoNotChangeOneBit) {
  const auto with = [&](unsigned threads) {
    const ThreadLimit limit(threads);
    return render({"estimator.photons=4000", "estimator.light_voxel=1",
                   std::string("render.target_error=") + (kSanitized ? "2" : "0.2")});
  };
  const FrameResult one = with(1), three = with(3);
  EXPECT_EQ(one.statistics.batches, three.statistics.batches);
  EXPECT_TRUE(sameBits(one.layers.beauty, three.layers.beauty));
  EXPECT_TRUE(sameBits(one.error, three.error));
}

TEST_F(TargetError, RefusesWhatItCannotJudge) {
  EXPECT_TRUE(contains(complaint([&] {
                         scene({"render.target_error=0.1", "estimator.cache=light.vdb"});
                       }),
                       "target_error"));
  EXPECT_TRUE(contains(
      complaint([&] {
        scene({"render.target_error=0.1", "estimator.type=photon_map", "estimator.passes=2"});
      }),
      "target_error"));
}

}  // namespace
}  // namespace photosphere::test
