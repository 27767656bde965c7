// Paths from the lamps against paths from the eye, and against what every frame of them must hold.

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numeric>

#include "photosphere/core/error.h"
#include "photosphere/core/parallel.h"
#include "photosphere/core/registry.h"
#include "photosphere/render/light_paths.h"
#include "support/frames.h"
#include "support/support.h"

namespace photosphere::test {
namespace {

using render::FrameLayers;

render::Crop whole(const cameras::Camera& camera) {
  return {Vec2i(0), camera.resolution()};
}

// What both ways must take alike.
struct Picture {
  render::Lens lens{};
  lights::LocalSpace space{};
  render::FilterKind filter = render::FilterKind::blackmanHarris;
  double filterWidth = 0;
  int maxScatter = 0;
};

std::vector<Rgb> lightPaths(const TestScene& scene, std::uint64_t photons, std::uint64_t seed,
                            const Picture& picture = {}) {
  render::LightPathOptions options;
  options.photons = photons;
  options.key = RandomKey::fromSeed(seed, 0);
  options.crop = whole(*scene.camera);
  options.lens = picture.lens;
  options.space = picture.space;
  options.filter = picture.filter;
  options.filterWidth = picture.filterWidth;
  options.maxScatter = picture.maxScatter;
  return render::traceLightPaths(*scene.camera, *scene.medium, scene.lights, options).multiple;
}

std::vector<Rgb> eyePaths(const TestScene& scene, int samples, std::uint64_t seed,
                          const Picture& picture = {}) {
  render::PathOptions way;
  way.maxScatter = picture.maxScatter;
  const auto path = render::makePathIntegrator(*scene.medium, scene.lights, way);
  render::FrameOptions options;
  options.samples = samples;
  options.key = RandomKey::fromSeed(seed, 0);
  options.crop = whole(*scene.camera);
  options.lens = picture.lens;
  options.space = picture.space;
  options.filter = picture.filter;
  options.filterWidth = picture.filterWidth;
  return render::renderFrame(*scene.camera, *path, options).multiple;
}

// Means over blocks of pixels of several frames, and the errors of these means.
struct Blocks {
  std::vector<double> mean, error;
};

template <class Render>
Blocks blocksOf(const cameras::Camera& camera, int edge, int seeds, int channel,
                const Render& render) {
  const Vec2i size = camera.resolution();
  const Vec2i count = (size + edge - 1) / edge;
  std::vector<double> sum(static_cast<std::size_t>(count.x * count.y)), squares(sum.size());
  for (int seed = 1; seed <= seeds; ++seed) {
    const std::vector<Rgb> frame = render(static_cast<std::uint64_t>(seed));
    std::vector<double> block(sum.size());
    for (int y = 0; y < size.y; ++y)
      for (int x = 0; x < size.x; ++x)
        block[static_cast<std::size_t>(y / edge * count.x + x / edge)] +=
            static_cast<double>(frame[static_cast<std::size_t>(y * size.x + x)][channel]);
    for (std::size_t i = 0; i < sum.size(); ++i) {
      const double mean = block[i] / (edge * edge);
      sum[i] += mean / seeds;
      squares[i] += mean * mean / seeds;
    }
  }
  Blocks blocks{sum, {}};
  for (std::size_t i = 0; i < sum.size(); ++i)
    blocks.error.push_back(std::sqrt(std::max(0.0, squares[i] - sum[i] * sum[i]) / (seeds - 1)));
  return blocks;
}

// Both ways agree in every block, and in the mean to `close`.
void expectAgreement(const TestScene& scene, std::uint64_t photons, int samples, double close,
                     const Picture& picture = {}, int channel = 1) {
  constexpr int kSeeds = 8, kEdge = 8;
  const cameras::Camera& camera = *scene.camera;
  const Blocks ours = blocksOf(camera, kEdge, kSeeds, channel, [&](std::uint64_t seed) {
    return lightPaths(scene, photons, seed, picture);
  });
  const Blocks theirs = blocksOf(camera, kEdge, kSeeds, channel, [&](std::uint64_t seed) {
    return eyePaths(scene, samples, 100 + seed, picture);
  });
  const double a = std::accumulate(ours.mean.begin(), ours.mean.end(), 0.0);
  const double b = std::accumulate(theirs.mean.begin(), theirs.mean.end(), 0.0);
  // Of the few paths that a sanitizer leaves time for hardly one meets a dark block, and the spread
  // of eight frames does not tell their error.
  const double dark = kSanitized ? 1e-4 * b / static_cast<double>(theirs.mean.size()) : 1e-12;
  double noise = 0;
  for (std::size_t i = 0; i < ours.mean.size(); ++i) {
    const double error = std::hypot(ours.error[i], theirs.error[i]);
    noise += error * error;
    // Student's t of seven degrees: beyond 7 one block in 5000.
    EXPECT_NEAR(ours.mean[i], theirs.mean[i], 7 * error + 0.003 * theirs.mean[i] + dark)
        << "block " << i;
  }
  ASSERT_GT(b, 0);
  EXPECT_NEAR(a / b, 1.0, 4 * std::sqrt(noise) / b + 1e-4);
  EXPECT_LT(4 * std::sqrt(noise) / b, close);  // or the agreement says little
}

TestScene coneOfSmoke(double g, const Rgb& tint = Rgb(1.0f)) {
  transport::MediumVolume smoke = sampledVolume(1.0, 24, {0.9, g, 8.0}, [](const Vec3d& p) {
    return std::max(0.0, 1 - 2 * glm::length(p - Vec3d(0.05, 0.0, -0.1)));
  });
  smoke.tint = tint;
  return plumeScene(std::move(smoke), 32);
}

std::uint64_t photons(double millions) {
  return static_cast<std::uint64_t>(millions * (kSanitized ? 1.5e5 : 1e6));
}
int paths(int count) {
  return std::max(8, kSanitized ? count / 6 : count);
}
constexpr double kClose = kSanitized ? 0.08 : 0.03;

TEST(LightPaths, AreThePictureOfPathsFromTheEye) {
  expectAgreement(coneOfSmoke(0.0), photons(0.15), paths(150), kClose);
  expectAgreement(coneOfSmoke(0.6), photons(0.15), paths(150), kClose);
}

TEST(LightPaths, AgreeWhereChannelsDiffer) {
  const TestScene scene = coneOfSmoke(0.3, Rgb(0.3f, 0.7f, 1.0f));
  for (const int channel : {0, 2})
    expectAgreement(scene, photons(0.15), paths(150), 2 * kClose, {}, channel);
}

TEST(LightPaths, AgreeWithALampInsideAndSeveralOutside) {
  TestScene scene = coneOfSmoke(0.4);
  scene.lights.push_back(
      makeLight("point", {{"position", "[0.05, 0.02, -0.1]"}, {"intensity", "0.5"}}));
  scene.lights.push_back(makeLight("environment", {{"color", "[0.1, 0.2, 0.3]"}}));
  expectAgreement(scene, photons(0.15), paths(500), 2 * kClose);
}

std::unique_ptr<cameras::Camera> cameraOf(const std::string& model, const Mat4d& place,
                                          const Vec2i& resolution,
                                          const std::map<std::string, std::string>& options) {
  const auto& plugin = findPlugin(cameras::cameraModels(), model, "camera", "test");
  ParamValues values(plugin.params);
  for (const auto& [name, value] : options)
    values.setText(name, value, "test");
  return plugin.create(values, place, resolution);
}

TEST(LightPaths, AgreeInParallelRaysThatBeginInTheSmoke) {
  TestScene scene = coneOfSmoke(0.2);
  scene.camera = cameraOf("orthographic", cameras::lookAt({1, -2, 1}, Vec3d(0.0), {0, 0, 1}),
                          {40, 24}, {{"width", "1.3"}, {"near", "2.4"}});
  expectAgreement(scene, photons(0.15), paths(150), kClose);
}

// The smoke lies around the lower pole and across the border behind the eye.
TEST(LightPaths, AgreeInAPanorama) {
  TestScene scene = coneOfSmoke(0.2);
  scene.camera =
      cameraOf("equirectangular", cameras::lookAt({0.1, 0, 0.75}, {0.9, 0.1, 0.75}, {0, 0, 1}),
               {48, 24}, {});
  expectAgreement(scene, photons(0.3), paths(200), 2 * kClose);
}

TEST(LightPaths, CarryTheLightOfGlowingSmoke) {
  transport::MediumVolume smoke = sampledVolume(1.0, 24, {0.9, 0.3, 8.0}, [](const Vec3d& p) {
    return std::max(0.0, 1 - 2 * glm::length(p));
  });
  smoke.emission = sampledEmission(1.0, 24, [](const Vec3d& p) {
    return Rgb(std::max(0.0f, static_cast<float>(1 - 3 * glm::length(p - Vec3d(0.1, 0, 0)))));
  });
  TestScene scene = plumeScene(std::move(smoke), 32);
  scene.lights.clear();
  expectAgreement(scene, photons(0.15), paths(150), kClose);
}

TEST(LightPaths, AgreeThroughALens) {
  expectAgreement(coneOfSmoke(0.2), photons(0.15), paths(150), kClose, {.lens = {0.25, 2.4}});
}

// As much light falls through every filter, on pixels of its own.
TEST(LightPaths, AgreeThroughEveryFilter) {
  for (const auto& [filter, width] :
       {std::pair{render::FilterKind::box, 0.0}, std::pair{render::FilterKind::box, 2.5},
        std::pair{render::FilterKind::triangle, 0.0},
        std::pair{render::FilterKind::blackmanHarris, 5.0}})
    expectAgreement(coneOfSmoke(0.2), photons(0.15), paths(150), kClose,
                    {.filter = filter, .filterWidth = width});
}

// A scene in centimetres, far from its origin.
TEST(LightPaths, AgreeWhereAUnitIsNoMetre) {
  TestScene scene = coneOfSmoke(0.2);
  Picture picture;
  picture.space = {{4000, -2000, 70}, 0.01};
  scene.camera = cameraOf("perspective",
                          cameras::lookAt(picture.space.worldFromLocal({0, -3, 0.4}),
                                          picture.space.worldFromLocal(Vec3d(0.0)), {0, 0, 1}),
                          {32, 32}, {{"fov", "22"}});
  expectAgreement(scene, photons(0.15), paths(150), kClose, picture);
}

TEST(LightPaths, AgreeInVolumesOfDifferentPhase) {
  TestScene scene = coneOfSmoke(0.0);
  std::vector<transport::MediumVolume> volumes;
  for (const double x : {-0.15, 0.15})
    volumes.push_back(sampledVolume(1.0, 24, {0.9, x < 0 ? -0.5 : 0.8, 8.0}, [&](const Vec3d& p) {
      return std::max(0.0, 1 - 3 * glm::length(p - Vec3d(x, 0.0, 0.0)));
    }));
  scene.medium = std::make_unique<transport::Medium>(std::move(volumes));
  expectAgreement(scene, photons(0.15), paths(200), 2 * kClose);
}

TEST(LightPaths, AgreeWhereScatteringsAreCapped) {
  for (const int cap : {2, 4})
    expectAgreement(coneOfSmoke(0.2), photons(0.15), paths(150), kClose, {.maxScatter = cap});
  const TestScene scene = coneOfSmoke(0.2);
  render::LightPathOptions options;
  options.photons = 20'000;
  options.crop = whole(*scene.camera);
  options.maxScatter = 2;
  const render::LightPaths capped =
      render::traceLightPaths(*scene.camera, *scene.medium, scene.lights, options);
  EXPECT_GT(capped.capped, 1000u);
  EXPECT_GT(capped.cappedShare, 0.05 * 20'000);
  EXPECT_LT(capped.cappedShare, 20'000);
}

// Smoke whose middle a wide camera sees all but across its axis, where a pixel covers next to
// nothing.
TEST(LightPaths, AgreeWhereTheMiddleOfTheSmokeIsFarOffTheAxis) {
  TestScene scene = coneOfSmoke(0.2);
  const Vec3d middle = transport::boundingSphere(*scene.medium).center;
  const Vec3d eye = middle - Vec3d(0, 0.75, 0);
  scene.camera = cameraOf("perspective", cameras::lookAt(eye, eye + Vec3d(1, 1e-4, 0), {0, 0, 1}),
                          {32, 32}, {{"fov", "120"}});
  const auto sum = [](const std::vector<Rgb>& frame) {
    double all = 0;
    for (const Rgb& pixel : frame)
      all += static_cast<double>(pixel.y);
    return all;
  };
  const double expected = sum(eyePaths(scene, paths(2000), 1));
  ASSERT_GT(expected, 0.0);
  EXPECT_NEAR(sum(lightPaths(scene, photons(1), 2)) / expected, 1.0, kSanitized ? 0.3 : 0.1);
}

// Of a bright lamp near to, what a photon brings to a small pixel is more than a float can say, and
// the pixel is not.
TEST(LightPaths, ScaleWithTheirLamps) {
  TestScene scene = coneOfSmoke(0.2);
  scene.camera = perspectiveCamera({0, -3, 0.4}, 4, 32);
  const std::vector<Rgb> dim = lightPaths(scene, 20'000, 3);
  scene.lights.clear();
  scene.lights.push_back(makeLight("spot", {{"position", "[2, -1, 2]"},
                                            {"target", "[0, 0, 0.1]"},
                                            {"intensity", "3e36"},
                                            {"cone_angle", "8"},
                                            {"cone_edge", "2"}}));
  const std::vector<Rgb> bright = lightPaths(scene, 20'000, 3);
  double most = 0;
  for (std::size_t i = 0; i < dim.size(); ++i) {
    EXPECT_NEAR(static_cast<double>(bright[i].x) / 1e35, static_cast<double>(dim[i].x),
                1e-4 * static_cast<double>(dim[i].x) + 1e-6);
    most = std::max(most, static_cast<double>(dim[i].x));
  }
  EXPECT_GT(most, 0.01);
}

// A lamp before the eye in smoke that goes on for ten thousand kilometres: next to what a pixel of
// all that would have, a photon is brighter than any sum can hold.
TEST(LightPaths, SayThatAPhotonIsTooBright) {
  TestScene scene = coneOfSmoke(0.2);
  scene.medium =
      std::make_unique<transport::Medium>(makeMedium(boxVolume(Vec3d(1e7), Vec3i(8), {})));
  scene.lights.clear();
  scene.lights.push_back(makeLight("point", {{"position", "[0, 0, 0]"}}));
  try {
    lightPaths(scene, 20'000, 1);
    FAIL();
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("too bright for a pixel's"), std::string::npos)
        << error.what();
    EXPECT_NE(std::string(error.what()).find("path_traced"), std::string::npos) << error.what();
  }
}

// Photons and their sums' quantum are the same whatever the number of photons: what a few have left
// is a part of what more leave.
TEST(LightPaths, GoOnFromACheckpointToTheSameBits) {
  const TestScene scene = coneOfSmoke(0.3);
  const TemporaryFolder folder;
  constexpr std::uint64_t kFew = 1 << 14;
  const auto trace = [&](std::uint64_t photons, Checkpoint* checkpoint) {
    render::LightPathOptions options;
    options.photons = photons;
    options.key = RandomKey::fromSeed(5, 0);
    options.crop = whole(*scene.camera);
    options.maxScatter = 20;
    options.checkpoint = checkpoint;
    return render::traceLightPaths(*scene.camera, *scene.medium, scene.lights, options);
  };
  const auto begin = [&] {
    Checkpoint checkpoint(folder / "work.checkpoint", 0.0, Resume::automatic);
    checkpoint.identify("the same");
    return checkpoint;
  };
  const std::uint64_t many = 3 * kFew + photons(0.1);
  const render::LightPaths expected = trace(many, nullptr);
  Checkpoint first = begin();
  const render::LightPaths few = trace(kFew, &first);
  EXPECT_LT(few.joined, expected.joined / 2);
  Checkpoint second = begin();
  ASSERT_TRUE(second.load("light"));
  const render::LightPaths paths = trace(many, &second);
  EXPECT_EQ(paths.multiple, expected.multiple);
  EXPECT_EQ(paths.joined, expected.joined);
  EXPECT_EQ(paths.capped, expected.capped);
  EXPECT_NEAR(paths.cappedShare, expected.cappedShare, 1e-9 * expected.cappedShare);
  EXPECT_EQ(paths.traced.flights, expected.traced.flights);
}

// Smoke that only scatters looks like the even surroundings that it stands in.
TEST(LightPaths, FillAFurnace) {
  TestScene scene = plumeScene(
      sampledVolume(1.0, 24, {1.0, 0.5, 6.0},
                    [](const Vec3d& p) { return std::max(0.0, 1 - 2 * glm::length(p)); }),
      32);
  scene.lights.clear();
  scene.lights.push_back(makeLight("environment", {{"color", "[1, 1, 1]"}}));
  const auto path = render::makePathIntegrator(*scene.medium, scene.lights, {});
  render::FrameOptions options;
  options.samples = paths(400);
  options.crop = whole(*scene.camera);
  FrameLayers frame = render::renderFrame(*scene.camera, *path, options);
  render::setMultiple(frame, lightPaths(scene, photons(2), 1));
  const BlockDeviation furnace = deviationFromOne(frame.beauty, frame.width(), 8);
  EXPECT_NEAR(furnace.mean, 1.0, kSanitized ? 0.01 : 0.002);
  EXPECT_LT(furnace.worst, kSanitized ? 0.05 : 0.015);
}

TEST(LightPaths, AreTheSameBitsForAnyNumberOfThreadsAndCrop) {
  const TestScene scene = coneOfSmoke(0.3);
  std::vector<Rgb> first;
  for (const int threads : {1, 3}) {
    const ThreadLimit limit(threads);
    const std::vector<Rgb> frame = lightPaths(scene, 20'000, 5);
    if (first.empty())
      first = frame;
    else
      EXPECT_EQ(frame, first);
  }
  render::LightPathOptions options;
  options.photons = 20'000;
  options.key = RandomKey::fromSeed(5, 0);
  options.crop = {{7, 9}, {20, 30}};
  const std::vector<Rgb> part =
      render::traceLightPaths(*scene.camera, *scene.medium, scene.lights, options).multiple;
  for (int y = 9; y < 30; ++y)
    for (int x = 7; x < 20; ++x)
      EXPECT_EQ(part[static_cast<std::size_t>((y - 9) * 13 + x - 7)],
                first[static_cast<std::size_t>(y * 32 + x)]);
}

}  // namespace
}  // namespace photosphere::test
