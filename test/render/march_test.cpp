// The march against closed forms and path tracing.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <ostream>

#include "photosphere/core/sampling.h"
#include "support/estimate.h"
#include "support/frames.h"
#include "support/support.h"

namespace photosphere::test {

namespace {

using render::IntegratorCounters;
using render::RayRadiance;
using render::ShadowMode;

// A homogeneous cube lit from straight above, seen along x: every point of the ray has the same
// depth below the lit face, so single scattering has a closed form.
double boxSingle(double sigma, double albedo, double depth, double length) {
  return albedo / (4 * kPi) * std::exp(-sigma * depth) * (1 - std::exp(-sigma * length));
}

class BoxSingle : public testing::TestWithParam<ShadowMode> {};

TEST_P(BoxSingle, MatchesTheClosedForm) {
  for (const double sigma : {0.01, 1.0, 4.0}) {
    // Deep in dense smoke a tracked shadow is nearly always black: no mean of a test's length
    // tells.
    if (GetParam() == ShadowMode::track && sigma > 1) continue;
    const transport::Medium medium =
        makeMedium(boxVolume(Vec3d(2.0), Vec3i(32), {0.8, 0.0, sigma}));
    transport::LightList lights;
    lights.push_back(
        makeLight("directional", {{"position", "[0, 0, 1]"}, {"target", "[0, 0, 0]"}}));
    const render::Shadows shadows(medium, lights, GetParam(), 0.0625f, 0);
    const auto march = render::makeMarchIntegrator(medium, lights, shadows, nullptr, {});
    IntegratorCounters counters;
    for (const double z : {0.8, 0.0, -0.7}) {
      double sum = 0;
      const int n = GetParam() == ShadowMode::track ? 400 : 16;
      for (int i = 0; i < n; ++i) {
        Rng rng(RandomKey::fromSeed(1, 0), RandomStream::camera, static_cast<std::uint64_t>(i));
        sum += static_cast<double>(
            march->radiance(Vec3d(-9, 0.1, z), Vec3f(1, 0, 0), {}, rng, counters).single.x);
      }
      const double exact = boxSingle(sigma, 0.8, 1 - z, 2);
      const double bound = GetParam() == ShadowMode::track ? 0.04 : 0.004;
      EXPECT_NEAR(sum / n, exact, bound * exact) << "sigma " << sigma << ", z " << z;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Shadows, BoxSingle,
                         testing::Values(ShadowMode::grid, ShadowMode::march, ShadowMode::track));

struct LampCase {
  const char* name;
  const char* type;
  std::vector<std::pair<std::string, std::string>> options;
};
void PrintTo(const LampCase& c, std::ostream* out) {
  *out << c.name;
}

class TabulatedShadow : public testing::TestWithParam<LampCase> {};

// Smooth smoke, so that the table's interpolation is all that differs from a fine march.
TEST_P(TabulatedShadow, AgreesWithAFineMarch) {
  const transport::Medium medium =
      makeMedium(sampledVolume(2.0, 48, {0.8, 0.0, 6.0}, [](const Vec3d& p) {
        const double r = glm::length(p - Vec3d(0.2, -0.1, 0.1));
        return std::max(0.0, 1 - 1.9 * r * r) + std::max(0.0, 0.4 - 2 * glm::length(p + 0.55));
      }));
  transport::LightList lights;
  lights.push_back(makeLight(GetParam().type, GetParam().options));
  const float voxel = static_cast<float>(medium.voxelEdge());
  const render::Shadows table(medium, lights, ShadowMode::grid, voxel, 0);
  const render::Shadows march(medium, lights, ShadowMode::march, voxel / 8, 0);
  EXPECT_GT(table.memoryBytes(), 0u);
  Rng rng(RandomKey::fromSeed(8, 0), RandomStream::test, 0);
  transport::TrackingCounters counters;
  double squares = 0, difference = 0, sum = 0;
  const int count = 4000;
  for (int i = 0; i < count;) {
    const Vec3f p =
        Vec3f(medium.bounds().min) +
        Vec3f(medium.bounds().extent()) * Vec3f(rng.uniform(), rng.uniform(), rng.uniform());
    if (!(medium.extinction(p) > 0.0f)) continue;
    ++i;
    const lights::Illumination in = lights[0]->illuminate(p, Vec2f(0.5f));
    const auto at = [&](const render::Shadows& shadows) {
      return static_cast<double>(
          shadows.transmittance(0, p, in.direction, in.distance, rng, counters));
    };
    const double t = at(table), exact = at(march);
    ASSERT_NEAR(t, exact, 0.05) << p.x << " " << p.y << " " << p.z;
    squares += (t - exact) * (t - exact);
    difference += t - exact;
    sum += exact;
  }
  EXPECT_LT(std::sqrt(squares / count), 0.005);
  EXPECT_NEAR(difference / sum, 0.0, 0.003);
}

INSTANTIATE_TEST_SUITE_P(
    Lamps, TabulatedShadow,
    testing::Values(LampCase{"sun", "directional", {{"position", "[3, 1, 2]"}}},
                    LampCase{"sun_along_an_axis", "directional", {{"position", "[0, 0, -1]"}}},
                    LampCase{"star", "point", {{"position", "[2e6, -1e6, 3e6]"}}},
                    LampCase{"lamp_beside", "point", {{"position", "[0.3, 1.9, -0.4]"}}},
                    LampCase{"spot", "spot", {{"position", "[-3, 2, 2]"}, {"cone_angle", "60"}}},
                    LampCase{"lamp_inside", "point", {{"position", "[0.2, 0.1, 0.3]"}}}),
    [](const auto& lamp) { return std::string(lamp.param.name); });

// What lies beyond the budget is marched: the same light, no memory.
TEST(Shadows, GridPastTheBudgetIsMarched) {
  const transport::Medium medium = makeMedium(boxVolume(Vec3d(2.0), Vec3i(16), {0.8, 0.0, 1.5}));
  transport::LightList lights;
  lights.push_back(makeLight("directional", {{"position", "[0, 0, 1]"}}));
  const render::Shadows shadows(medium, lights, ShadowMode::grid, 0.1f, 1);
  EXPECT_EQ(shadows.memoryBytes(), 0u);
  Rng rng(RandomKey::fromSeed(1, 0), RandomStream::test, 0);
  transport::TrackingCounters counters;
  EXPECT_NEAR(
      shadows.transmittance(0, Vec3f(0.1f, 0.2f, 0.0f), Vec3f(0, 0, -1), kInfinity, rng, counters),
      std::exp(-1.5f), 1e-4f);
}

// Smoke of several depths a voxel throughout loses its own shadow between nodes, and is tracked; a
// thick knot in thin smoke is not worth it.
TEST(Shadows, GridsAreForSmokeOfFewDepthsAVoxel) {
  const auto bytes = [](const std::function<double(const Vec3d&)>& density) {
    const transport::Medium medium =
        makeMedium(sampledVolume(2.0, 48, {0.8, 0.0, 1 / (2.0 / 48)}, density));  // depths a voxel
    transport::LightList lights;
    lights.push_back(makeLight("directional", {{"position", "[0, 0, 1]"}}));
    return render::Shadows(medium, lights, ShadowMode::grid, 0.04f, 0).memoryBytes();
  };
  EXPECT_EQ(bytes([](const Vec3d&) { return 5.0; }), 0u);
  EXPECT_GT(bytes([](const Vec3d&) { return 0.5; }), 0u);
  EXPECT_GT(bytes([](const Vec3d& p) { return glm::length(p) < 0.15 ? 20.0 : 0.3; }), 0u);
}

// An eye in the knot sees nothing else; a frame of few rays marches theirs sooner than it makes a
// grid.
TEST(Shadows, GridsAreForWhatTheFrameAsks) {
  const transport::Medium medium =
      makeMedium(sampledVolume(2.0, 48, {0.8, 0.0, 1 / (2.0 / 48)},
                               [](const Vec3d& p) { return glm::length(p) < 0.3 ? 20.0 : 0.3; }));
  transport::LightList lights;
  lights.push_back(makeLight("directional", {{"position", "[0, 0, 1]"}}));
  const auto gridOf = [&](const Vec3d& eye, std::uint64_t rays) {
    render::ShadowUse use;
    use.rays = rays;
    for (int i = 0; i < 16; ++i)
      use.seen.push_back(
          {eye, glm::normalize(Vec3d(0.1 * (i % 4 - 1.5), 0.1 * (i / 4 - 1.5), -1))});
    return render::Shadows(medium, lights, ShadowMode::grid, 0.04f, 0, use).memoryBytes() > 0;
  };
  EXPECT_TRUE(gridOf({0, 0, 5}, 100'000)) << "thin smoke hides the knot";
  EXPECT_FALSE(gridOf({0, 0, 0}, 100'000));
  EXPECT_FALSE(gridOf({0, 0, 5}, 10));
  EXPECT_FALSE(gridOf({0, 0, -5}, 100'000)) << "rays that meet nothing ask for nothing";
}

// Between the nodes of so few the slope of the depth at the faces would be lost.
TEST(Shadows, SmokeOfFewVoxelsHasNoGrid) {
  const double sigma = 1.5;
  transport::LightList lights;
  lights.push_back(makeLight("directional", {{"position", "[0, 0, 1]"}, {"target", "[0, 0, 0]"}}));
  const transport::Medium small = makeMedium(boxVolume(Vec3d(1.0), Vec3i(8), {0.8, 0.0, sigma}));
  const render::Shadows shadows(small, lights, ShadowMode::grid, 0.125f, 0);
  EXPECT_EQ(shadows.memoryBytes(), 0u);
  transport::TrackingCounters counters;
  Rng rng(RandomKey::fromSeed(1, 0), RandomStream::camera, 0);
  for (const float z : {0.44f, 0.3f, 0.0f, -0.46f})
    EXPECT_NEAR(static_cast<double>(shadows.transmittance(0, {0.4f, -0.2f, z}, {0, 0, -1.0f},
                                                          kInfinity, rng, counters)),
                std::exp(-sigma * (0.5 - static_cast<double>(z))), 0.004)
        << z;
  const transport::Medium larger = makeMedium(boxVolume(Vec3d(1.0), Vec3i(16), {0.8, 0.0, sigma}));
  EXPECT_GT(render::Shadows(larger, lights, ShadowMode::grid, 0.0625f, 0).memoryBytes(), 0u);
}

TEST(March, TransmittanceDoesNotDependOnTheStep) {
  const transport::Medium medium = makeMedium(boxVolume(Vec3d(2.0), Vec3i(16), {0.8, 0.0, 1.5}));
  const transport::LightList lights;
  const render::Shadows shadows(medium, lights, ShadowMode::march, 0.1f, 0);
  for (const float step : {0.1f, 1.0f, 7.0f}) {
    render::MarchOptions options;
    options.step = step;
    const auto march = render::makeMarchIntegrator(medium, lights, shadows, nullptr, options);
    IntegratorCounters counters;
    Rng rng(RandomKey::fromSeed(1, 0), RandomStream::camera, 0);
    const RayRadiance r = march->radiance(Vec3d(-9, 0.1, 0.2), Vec3f(1, 0, 0), {}, rng, counters);
    EXPECT_NEAR(r.transmittance.x, std::exp(-3.0f), 1e-4f) << step;
    EXPECT_NEAR(r.depth / r.opacity, 8 + (1 - 4 * std::exp(-3.0)) / (1.5 * (1 - std::exp(-3.0))),
                0.05);
  }
}

struct Ray {
  Vec3d eye;
  Vec3f direction;
};

// Opacity that steps of the usual length find, in sum over rays by chance, over that of finer ones.
template <class RayOf>
double opacityOverThatOf(float fineStep, const transport::Medium& medium, int rays,
                         std::uint64_t seed, const RayOf& rayOf) {
  const transport::LightList lights;
  const render::Shadows shadows(medium, lights, ShadowMode::march, 0.1f, 0);
  render::MarchOptions fine;
  fine.step = fineStep;
  const auto usual = render::makeMarchIntegrator(medium, lights, shadows, nullptr, {});
  const auto exact = render::makeMarchIntegrator(medium, lights, shadows, nullptr, fine);
  double found = 0, wanted = 0;
  IntegratorCounters counters;
  for (int i = 0; i < rays; ++i) {
    Rng rng(RandomKey::fromSeed(seed, 0), RandomStream::camera, static_cast<std::uint64_t>(i));
    const Ray ray = rayOf(rng);
    const auto opacity = [&](const render::Integrator& march) {
      const RayRadiance r = march.radiance(ray.eye, ray.direction, {}, rng, counters);
      return 1.0 - static_cast<double>(r.transmittance.x);
    };
    found += opacity(*usual);
    wanted += opacity(*exact);
  }
  return found / wanted;
}

// Smoke of two voxel sizes: steps change where rays pass from one to the other, at any distance.
TEST(March, StepsFollowTheVoxelsOfTheirCell) {
  for (const double ratio : {2.0, 9.0}) {
    std::vector<transport::MediumVolume> volumes;
    volumes.push_back(sampledVolume(2.0, 16, {0.8, 0.0, 0.3}, plumeDensity));
    volumes.push_back(sampledVolume(2.0 / ratio, 16, {0.8, 0.0, 0.3 * ratio}, plumeDensity));
    const transport::Medium medium(std::move(volumes));
    const double found =
        opacityOverThatOf(1.0f / 16, medium, kSanitized ? 2000 : 40000, 3, [](Rng& rng) {
          const Vec3d eye = 4.0 * Vec3d(sampleSphere(rng.uniform2()));
          const Vec3d target =
              0.7 * (Vec3d(rng.uniformDouble(), rng.uniformDouble(), rng.uniformDouble()) - 0.5);
          return Ray{eye, Vec3f(glm::normalize(target - eye))};
        });
    EXPECT_NEAR(found, 1.0, kSanitized ? 0.02 : 0.005) << ratio;
  }
}

// A dense ball in a thin halo, of voxels many times as wide as those of a wisp beside the rays:
// steps as long as the halo takes end where the ball begins. Lit along the ray, of which single
// scattering leaves (1 - T^2) / 2.
TEST(March, CoarseStepsEndWhereSmokeIsDenser) {
  constexpr double kAlbedo = 0.8;
  for (const double depth : {2.0, 20.0}) {  // of a voxel
    std::vector<transport::MediumVolume> volumes;
    volumes.push_back(sampledVolume(2.0, 32, {kAlbedo, 0.0, depth * 16}, [](const Vec3d& p) {
      return glm::length(p) < 0.7 ? 1.0 : glm::length(p) < 0.95 ? 2e-4 : 0.0;
    }));
    volumes.push_back(sampledVolume(0.25, 128, {kAlbedo, 0.0, 1.0}, [](const Vec3d& p) {
      return glm::length(p) < 0.1 ? 1.0 : 0.0;
    }));
    const transport::Medium medium(std::move(volumes));
    transport::LightList lights;
    lights.push_back(
        makeLight("directional", {{"position", "[0, 0, 9]"}, {"target", "[0, 0, 0]"}}));
    const render::Shadows shadows(medium, lights, ShadowMode::track, 0.1f, 0);
    const auto march = render::makeMarchIntegrator(medium, lights, shadows, nullptr, {});
    double found = 0, wanted = 0;
    IntegratorCounters counters;
    for (int i = 0; i < (kSanitized ? 20 : 2000); ++i) {
      Rng rng(RandomKey::fromSeed(4, 0), RandomStream::camera, static_cast<std::uint64_t>(i));
      const double across = 0.3 + 0.3 * rng.uniformDouble(), angle = 2 * kPi * rng.uniformDouble();
      const Vec3d eye(across * std::cos(angle), across * std::sin(angle), 5.0);
      const RayRadiance r = march->radiance(eye, Vec3f(0, 0, -1), {}, rng, counters);
      const auto t = static_cast<double>(r.transmittance.x);
      found += static_cast<double>(r.single.x);
      wanted += kAlbedo / (4 * kPi) * (1 - t * t) / 2;
    }
    EXPECT_NEAR(found / wanted, 1.0, kSanitized ? 0.2 : 0.02) << depth;
  }
}

// A sheet and a ball one voxel thick, along rays that cross nodes anywhere: as much smoke on the
// mean of all offsets of the steps as the finest ones find, whichever way its bounds cut them off.
TEST(March, FeaturesOfOneVoxelKeepTheirDepth) {
  constexpr double kVoxel = 2.0 / 32;
  const auto sheet = [](const Vec3d& p) { return p.z >= 0 && p.z < kVoxel ? 1.0 : 0.0; };
  const auto ball = [](const Vec3d& p) { return glm::length(p) < 0.9 * kVoxel ? 1.0 : 0.0; };
  // Something far behind, so that the bounds end elsewhere.
  const auto beyond = [&](const Vec3d& p) { return glm::length(p + 0.8) < 0.2 ? 1.0 : sheet(p); };
  using Shape = std::function<double(const Vec3d&)>;
  int number = 0;
  for (const Shape& shape : {Shape(sheet), Shape(ball), Shape(beyond)}) {
    const transport::Medium medium = makeMedium(sampledVolume(2.0, 32, {0.8, 0.0, 0.5}, shape));
    const double found = opacityOverThatOf(1.0f / 64, medium, 8000, 1, [](Rng& rng) {
      const Vec3d target(kVoxel * (rng.uniformDouble() - 0.5), kVoxel * (rng.uniformDouble() - 0.5),
                         0.5 * kVoxel);
      const Vec3d eye(0.7, 0.4, 2.5);
      return Ray{eye, Vec3f(glm::normalize(target - eye))};
    });
    EXPECT_NEAR(found, 1.0, 0.01) << "shape " << number;
    ++number;
  }
}

// A lamp in smoke so thin that nothing is lost, nearer to the ray than a step is long: 1/d^2
// integrates to an arc tangent.
TEST(March, LampNearTheRayMatchesTheClosedForm) {
  constexpr double sigma = 1e-4, albedo = 0.8;
  const transport::Medium medium =
      makeMedium(boxVolume(Vec3d(2.0), Vec3i(16), {albedo, 0.0, sigma}));
  for (const double height : {0.3, 0.05, 0.005}) {
    transport::LightList lights;
    lights.push_back(makeLight(
        "point", {{"position", fmt::format("[0.21, {}, 0.2]", 0.1 + height)}, {"intensity", "1"}}));
    const render::Shadows shadows(medium, lights, ShadowMode::march, 0.1f, 0);
    const auto march = render::makeMarchIntegrator(medium, lights, shadows, nullptr, {});
    IntegratorCounters counters;
    Rng rng(RandomKey::fromSeed(1, 0), RandomStream::camera, 0);
    const RayRadiance r = march->radiance(Vec3d(-9, 0.1, 0.2), Vec3f(1, 0, 0), {}, rng, counters);
    const double angle = std::atan((1 - 0.21) / height) + std::atan((1 + 0.21) / height);
    const double exact = sigma * albedo / (4 * kPi) * angle / height;
    EXPECT_NEAR(static_cast<double>(r.single.x), exact, 0.005 * exact) << height;
  }
}

// The same where smoke scatters forward, of points and of lamps of a step's size: how much of the
// light turns to the eye changes within a step as 1/d^2 does.
TEST(March, LampNearTheRayIsThatOfPathsWhereSmokeScattersForward) {
  constexpr double sigma = 1e-3;
  const transport::Medium medium = makeMedium(boxVolume(Vec3d(2.0), Vec3i(16), {0.8, 0.8, sigma}));
  for (const char* type : {"point", "sphere", "disk"})
    for (const double height : {0.3, 0.05}) {
      std::vector<std::pair<std::string, std::string>> row{
          {"position", fmt::format("[0.21, {}, 0.2]", 0.1 + height)}, {"intensity", "1"}};
      if (type != std::string("point")) row.emplace_back("radius", "0.06");
      if (type == std::string("disk")) row.emplace_back("target", "[-0.3, 0, 0.2]");
      transport::LightList lights;
      lights.push_back(makeLight(type, row));
      const render::Shadows shadows(medium, lights, ShadowMode::march, 0.1f, 0);
      const auto march = render::makeMarchIntegrator(medium, lights, shadows, nullptr, {});
      render::PathOptions once;
      once.maxScatter = 1;
      const auto path = render::makePathIntegrator(medium, lights, once);
      const auto single = [](const RayRadiance& r) { return static_cast<double>(r.single.x); };
      const Vec3d eye(-9, 0.1, 0.2);
      const Vec3f along(1, 0, 0);
      const Estimate found = estimate(*march, eye, along, 20'000, single);
      const Estimate wanted = estimate(*path, eye, along, 200'000, single);
      EXPECT_NEAR(found.mean, wanted.mean, 4 * std::hypot(found.error, wanted.error))
          << type << " " << height;
      if (!kSanitized) {
        EXPECT_LT(std::hypot(found.error, wanted.error), 0.01 * wanted.mean)
            << type << " " << height;
      }
    }
}

// Eye and lamp inside the smoke, where 1/d^2 and directions change quickly.
void compareInside(TestScene scene, double bound) {
  const render::FrameLayers truth = renderPath(scene, kSanitized ? 2 : 1600, 1);
  estimators::LightFieldLayout layout;
  layout.channels = 1;
  layout.lightVoxel = 1.0;
  const PhotosphereFrame frame =
      renderPhotosphere(scene, layout, kSanitized ? 2000 : 500'000, 5, 16);
  EXPECT_EQ(frame.layers.nanSamples + frame.layers.negativeSamples + truth.nanSamples, 0u);
  if (kSanitized) return;
  double image = 0, reference = 0;
  for (std::size_t i = 0; i < truth.beauty.size(); ++i) {
    image += static_cast<double>(frame.layers.beauty[i].y);
    reference += static_cast<double>(truth.beauty[i].y);
  }
  std::printf("  mean ratio %.4f\n", image / reference);
  EXPECT_NEAR(image / reference, 1.0, bound);
}

TEST(March, EyeInsideTheSmoke) {
  TestScene scene = sphereScene(4, 0.9, 0.4, 32, 32);
  scene.camera = perspectiveCamera({0.05, -0.2, 0.03}, 60, 32);
  compareInside(std::move(scene), 0.03);
}

TEST(March, LampInsideTheSmoke) {
  TestScene scene = sphereScene(4, 0.9, 0.4, 32, 32);
  scene.lights.clear();
  scene.lights.push_back(
      makeLight("point", {{"position", "[0.1, 0.05, 0.12]"}, {"intensity", "1"}}));
  compareInside(std::move(scene), 0.03);
}

TEST(Frame, CropIsPartOfTheWhole) {
  const TestScene scene = sphereScene(6, 0.9, 0.3, 24, 40);
  const auto path = render::makePathIntegrator(*scene.medium, scene.lights, {});
  render::FrameOptions options;
  options.crop = {Vec2i(0), Vec2i(40)};
  const render::FrameLayers whole = renderFrame(*scene.camera, *path, options);
  options.crop = {Vec2i(11, 7), Vec2i(30, 29)};
  const render::FrameLayers part = renderFrame(*scene.camera, *path, options);
  for (int y = 0; y < part.height(); ++y)
    for (int x = 0; x < part.width(); ++x)
      ASSERT_EQ(part.beauty[static_cast<std::size_t>(y * part.width() + x)],
                whole.beauty[static_cast<std::size_t>((y + 7) * 40 + x + 11)]);
}

TEST(PixelFilter, WeightsFallToZeroAtTheirRadius) {
  for (const auto kind : {render::FilterKind::box, render::FilterKind::triangle,
                          render::FilterKind::blackmanHarris}) {
    const render::PixelFilter filter(kind, 0);
    EXPECT_GT(filter.weight({0, 0}), 0.0f);
    EXPECT_GE(filter.weight({0, 0}), filter.weight({0.4, 0.2}));
    EXPECT_EQ(filter.weight({filter.radius() + 0.01, 0}), 0.0f);
  }
}

}  // namespace

}  // namespace photosphere::test
