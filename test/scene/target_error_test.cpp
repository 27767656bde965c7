// Frames that go on until their estimated error is small enough, and what the estimate is worth.

#include <cmath>
#include <cstring>

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

bool sameBits(const std::vector<Rgb>& a, const std::vector<Rgb>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(Rgb)) == 0;
}

// Batches of a made-up frame with known noise and bias.
TEST(FrameErrorTest, FindsTheNoiseAndTheBiasThatAreThere) {
  std::vector<Rgb> truth, biased;
  Rng rng(RandomKey::fromSeed(21, 0), RandomStream::test, 0);
  for (int i = 0; i < 4000; ++i) {
    const float x = static_cast<float>(i % 80) / 80, y = static_cast<float>(i) / 4000;
    truth.emplace_back(0.3f + x, 0.5f + y, 3.0f * x * y);
  }
  FrameError error(80);
  const int batches = 8;
  std::vector<Rgb> mean(truth.size(), Rgb(0.0f));
  for (int b = 0; b < batches; ++b) {
    std::vector<Rgb> frame, wider;
    for (const Rgb& t : truth) {
      const Rgb noise = 0.3f * (Rgb(rng.uniform(), rng.uniform(), rng.uniform()) - 0.5f);
      // At 1.5 times its width the kernel is off by 1.5 times as much.
      frame.push_back(t + noise + 0.04f * t);
      wider.push_back(t + noise + 1.5f * 0.04f * t + 0.02f * (rng.uniform() - 0.5f));
    }
    for (std::size_t i = 0; i < mean.size(); ++i)
      mean[i] += frame[i] / static_cast<float>(batches);
    error.add(frame, wider, 1.5);
  }
  EXPECT_EQ(error.batches(), batches);
  const ErrorEstimate e = error.estimate();
  std::vector<Rgb> shifted;
  for (const Rgb& t : truth)
    shifted.push_back(1.04f * t);
  EXPECT_NEAR(e.noise / relativeError(mean, shifted), 1.0, 0.05);
  EXPECT_NEAR(e.bias / relativeError(shifted, truth), 1.0, 0.06);
  EXPECT_NEAR(e.total() / relativeError(mean, truth), 1.0, 0.12);
  double deviation = 0;
  for (const Rgb& s : error.standardError())
    deviation += static_cast<double>(s.x * s.x) / 4000;
  EXPECT_NEAR(std::sqrt(deviation), 0.3 / std::sqrt(12.0 * batches), 0.002);
}

TEST(FrameErrorTest, NoiseAloneIsNotTakenForBias) {
  FrameError error(80);
  Rng rng(RandomKey::fromSeed(22, 0), RandomStream::test, 0);
  for (int b = 0; b < 8; ++b) {
    std::vector<Rgb> frame, wider;
    for (int i = 0; i < 4000; ++i) {
      frame.emplace_back(1.0f + rng.uniform());
      wider.emplace_back(1.0f + rng.uniform());
    }
    error.add(frame, wider, 1.5);
  }
  const ErrorEstimate e = error.estimate();
  EXPECT_GT(e.noise, 0.05);
  EXPECT_LT(e.bias, 0.03);
}

TEST(FrameErrorTest, SaysNothingOfNothing) {
  FrameError error(2);
  EXPECT_EQ(error.estimate().total(), 0.0);
  for (int b = 0; b < 8; ++b)
    error.add(std::vector<Rgb>(4, Rgb(0.0f)));
  EXPECT_EQ(error.estimate().total(), 0.0);  // black is exactly black
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

  TemporaryFolder m_folder;
  std::string m_file;
};

// What each estimator says of itself against path tracing with a hundred times the samples.
TEST_F(TargetError, TheEstimateIsTheErrorThatThereIs) {
  if (kSanitized) GTEST_SKIP() << "a truth of many paths, too slow under a sanitizer";
  const FrameResult truth = render({"estimator.type=path_traced", "estimator.samples=4000"});
  const std::vector<std::string> ways[] = {
      {"estimator.type=path_traced", "estimator.samples=32"},
      {"estimator.type=photosphere", "estimator.photons=20000"},
      {"estimator.type=photosphere", "estimator.photons=400000", "estimator.radius=0.5"},
      {"estimator.type=photon_map", "estimator.photons=40000"},
      {"estimator.type=photon_map", "estimator.photons=100000", "estimator.radius=0.3"}};
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
    EXPECT_GT(e.total(), 0.5 * is) << name;
    EXPECT_LT(e.total(), 2.0 * is) << name;
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
  const FrameResult plain = render({"estimator.photons=8000"});
  const FrameResult r = render({"estimator.photons=8000", "render.target_error=10"});
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
    return render({"estimator.photons=4000", "render.target_error=0.2"});
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
