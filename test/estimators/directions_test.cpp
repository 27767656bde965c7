// How directions are stored and read: what each option changes, and what it must not.

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "photosphere/core/error.h"
#include "photosphere/core/parallel.h"
#include "photosphere/core/sampling.h"
#include "photosphere/estimators/light_cache.h"
#include "photosphere/estimators/light_field.h"
#include "photosphere/volume/vdb_file.h"
#include "support/frames.h"
#include "support/support.h"

namespace photosphere::test {

namespace {

using namespace estimators;
using sphere::AngularKernel;
using sphere::DirectionDeposit;

constexpr std::uint64_t kPhotons = kSanitized ? 2'000 : 60'000;

struct Option {
  const char* name;
  std::function<void(LightFieldLayout&)> set;
};

// Every way of storing and reading directions, on top of a histogram.
const Option kOptions[] = {
    {"nearest", [](LightFieldLayout&) {}},
    {"barycentric", [](LightFieldLayout& l) { l.direction = DirectionDeposit::barycentric; }},
    {"kernel_deposit",
     [](LightFieldLayout& l) {
       l.direction = DirectionDeposit::kernel;
       l.angularKernel = AngularKernel::epanechnikov;
       l.bandwidth = 0.7;
     }},
    {"mean", [](LightFieldLayout& l) { l.representative = Representative::mean; }},
    {"gaussian", [](LightFieldLayout& l) { l.angularKernel = AngularKernel::gaussian; }},
    {"gaussian_cut",
     [](LightFieldLayout& l) {
       l.angularKernel = AngularKernel::gaussian;
       l.truncation = 1.0;
     }},
    {"epanechnikov", [](LightFieldLayout& l) { l.angularKernel = AngularKernel::epanechnikov; }},
    {"barycentric_mean_gaussian",
     [](LightFieldLayout& l) {
       l.direction = DirectionDeposit::barycentric;
       l.representative = Representative::mean;
       l.angularKernel = AngularKernel::gaussian;
     }},
};

// What GoogleTest prints of a case.
std::ostream& operator<<(std::ostream& out, const Option& option) {
  return out << option.name;
}

LightFieldLayout histogram() {
  LightFieldLayout layout;
  layout.basis = Basis::histogram;
  layout.channels = 1;
  layout.radius = layout.depositRadius = 0.08;
  return layout;
}

// Particles at random in the sphere of sphereScene.
std::vector<Vec3f> particlesIn(const TestScene& scene, int count) {
  std::vector<Vec3f> particles;
  Rng rng(RandomKey::fromSeed(8, 0), RandomStream::particles, 0);
  while (static_cast<int>(particles.size()) < count) {
    const Vec3f p = Vec3f(rng.uniform(), rng.uniform(), rng.uniform()) - 0.5f;
    if (scene.medium->extinction(p) > 0.0f) particles.push_back(p);
  }
  return particles;
}

LightField trace(const TestScene& scene, const LightFieldLayout& layout,
                 std::uint64_t photons = kPhotons) {
  transport::TraceOptions options;
  options.photons = photons;
  options.key = RandomKey::fromSeed(5, 0);
  transport::TraceStatistics statistics;
  LightFieldLayout whole = layout;
  whole.phases = static_cast<int>(scene.medium->phases().size());
  return traceLightField(*scene.medium, scene.lights, whole, scene.view(), scene.particles, options,
                         statistics);
}

transport::Coefficients coefficientsAt(const TestScene& scene, const Vec3f& p) {
  transport::Coefficients c;
  scene.medium->coefficients(p, c);
  return c;
}

const Vec3f kPlaces[] = {
    {0, 0, 0}, {0.2f, -0.1f, 0.15f}, {-0.1f, 0.25f, -0.2f}, {0.3f, 0.1f, 0.2f}};

// In-scattered light into all directions together, at the places [W m^-3].
std::vector<double> scatteredPower(const TestScene& scene, const InscatterSource& source) {
  const sphere::Partition directions(6);
  std::vector<double> power;
  for (const Vec3f& p : kPlaces) {
    const auto c = coefficientsAt(scene, p);
    double sum = 0;
    for (int i = 0; i < directions.size(); ++i)
      sum += static_cast<double>(source.at(p, directions.center(i), c).multiple.y);
    power.push_back(sum * static_cast<double>(directions.cellArea()));
  }
  return power;
}

class Directions : public testing::TestWithParam<Option> {};

// The histogram's sum is the same photons' light whatever bins they fall in, and what is scattered
// into all directions together does not depend on how directions are read.
TEST_P(Directions, KeepTheEnergy) {
  TestScene scene = sphereScene(6, 0.9, 0.6, 16, 16);
  scene.particles = particlesIn(scene, 3000);
  for (const bool particles : {false, true}) {
    LightFieldLayout plain = histogram();
    if (particles) {
      plain.carrier = Carrier::particles;
      plain.deposit = Deposit::collision;
    }
    plain.evaluate = Evaluate::perStep;
    LightFieldLayout layout = plain;
    GetParam().set(layout);
    const LightField reference = trace(scene, plain), field = trace(scene, layout);
    const auto total = [](const LightField& f) {
      const LightFieldLayout& l = f.layout;
      double sum = 0;
      for (std::size_t i = 0; i < f.carriers(); ++i)
        for (int j = 0; j < l.bins(); ++j)
          sum += static_cast<double>(f.values[i * static_cast<std::size_t>(l.valuesPerCarrier()) +
                                              static_cast<std::size_t>(j)]);
      return sum;
    };
    EXPECT_NEAR(total(field) / total(reference), 1.0, 1e-4);
    if (kSanitized) continue;
    const auto expected = scatteredPower(scene, *resolve(*scene.medium, reference, scene.view()));
    const auto actual = scatteredPower(scene, *resolve(*scene.medium, field, scene.view()));
    for (std::size_t i = 0; i < actual.size(); ++i)
      EXPECT_NEAR(actual[i] / expected[i], 1.0, 0.01) << "place " << i;
  }
}

double largestDifference(const std::vector<Rgb>& a, const std::vector<Rgb>& b) {
  double most = 0, mean = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    most = std::max(most, static_cast<double>(std::abs(a[i].y - b[i].y)));
    mean += static_cast<double>(b[i].y) / static_cast<double>(b.size());
  }
  return most / mean;
}

// Where scattering is isotropic directions do not matter: one picture, whatever the option.
TEST_P(Directions, DoNotMatterWhereScatteringIsIsotropic) {
  TestScene scene = sphereScene(6, 0.9, 0.0, 16, 16);
  scene.particles = particlesIn(scene, 3000);
  for (const Evaluate evaluate : {Evaluate::perView, Evaluate::perStep})
    for (const bool particles : {false, true}) {
      LightFieldLayout plain = histogram();
      plain.evaluate = evaluate;
      if (particles) {
        plain.carrier = Carrier::particles;
        plain.deposit = Deposit::collision;
      }
      LightFieldLayout layout = plain;
      GetParam().set(layout);
      const auto a = renderPhotosphere(scene, layout, kPhotons / 4, 5, 1).layers.multiple;
      const auto b = renderPhotosphere(scene, plain, kPhotons / 4, 5, 1).layers.multiple;
      EXPECT_LT(largestDifference(a, b), 2e-3);
      if (!particles) continue;
      layout.merge = Merge::sampled;  // draws weigh the same for every bin
      const auto c = renderPhotosphere(scene, layout, kPhotons / 4, 5, 1).layers.multiple;
      EXPECT_LT(largestDifference(c, b), 2e-3) << "sampled";
    }
}

// Every option is another answer where scattering is not isotropic (else it would not be one).
TEST_P(Directions, MatterWhereScatteringIsPeaked) {
  const TestScene scene = sphereScene(6, 0.9, 0.7, 16, 16);
  LightFieldLayout layout = histogram();
  LightFieldLayout other = layout;
  GetParam().set(layout);
  if (std::string(GetParam().name) == "nearest") other.basis = Basis::view;
  const auto image = renderPhotosphere(scene, layout, kPhotons / 4, 5, 1).layers.multiple;
  const auto plain = renderPhotosphere(scene, other, kPhotons / 4, 5, 1).layers.multiple;
  EXPECT_GT(largestDifference(image, plain), 0.02);
}

// Far away the direction toward the eye is one for all: per step is per view. Sharpening and
// clamping act on bins or on colours, which rounding and a few voxels of little light tell apart.
TEST_P(Directions, PerStepIsPerViewFarAway) {
  TestScene scene = sphereScene(6, 0.9, 0.6, 16, 24);
  scene.camera = perspectiveCamera({0, -4000, 800}, 0.018, 24);
  LightFieldLayout layout = histogram();
  GetParam().set(layout);
  // Mean directions are sharpened with their bins, colours with what they became.
  const bool means = layout.representative == Representative::mean;
  const auto view = renderPhotosphere(scene, layout, kPhotons, 5, 1).layers.multiple;
  layout.evaluate = Evaluate::perStep;
  const auto step = renderPhotosphere(scene, layout, kPhotons, 5, 1).layers.multiple;
  const double difference = largestDifference(step, view);
  std::printf("  largest difference over the mean: %.5f\n", difference);
  if (kSanitized) return;  // too few photons to judge by
  EXPECT_LT(difference, means ? 0.07 : 0.03);
}

INSTANTIATE_TEST_SUITE_P(Options, Directions, testing::ValuesIn(kOptions),
                         [](const auto& row) { return std::string(row.param.name); });

// Near the smoke the ray's direction is not that of the voxel's centre.
TEST(PerStep, DiffersFromPerViewInsideTheSmoke) {
  TestScene scene = sphereScene(6, 0.9, 0.8, 16, 24);
  scene.camera = perspectiveCamera({0, -0.3, 0.1}, 60, 24);
  LightFieldLayout layout = histogram();
  const auto view = renderPhotosphere(scene, layout, kPhotons, 5, 1).layers.multiple;
  layout.evaluate = Evaluate::perStep;
  const auto step = renderPhotosphere(scene, layout, kPhotons, 5, 1).layers.multiple;
  EXPECT_GT(largestDifference(step, view), 0.02);
}

// Fluence from particles per step: one smoothing less than per view reads it with, and no lattice.
TEST(PerStep, FluenceOnParticlesAgreesWithPerView) {
  const RunOnly runOnly;
  TestScene scene = sphereScene(6, 0.9, 0.5, 24, 24);
  scene.particles = particlesIn(scene, 12000);
  LightFieldLayout layout = histogram();
  layout.carrier = Carrier::particles;
  const auto mean = [&](Evaluate evaluate, Merge merge) {
    layout.evaluate = evaluate;
    layout.merge = merge;
    double sum = 0;
    for (const Rgb& c : renderPhotosphere(scene, layout, 100'000, 5, 1).layers.multiple)
      sum += static_cast<double>(c.y);
    return sum;
  };
  const double view = mean(Evaluate::perView, Merge::full);
  EXPECT_NEAR(mean(Evaluate::perStep, Merge::full) / view, 1.0, 0.02);
  EXPECT_NEAR(mean(Evaluate::perView, Merge::sampled) / view, 1.0, 0.02);
  EXPECT_NEAR(mean(Evaluate::perStep, Merge::sampled) / view, 1.0, 0.05);
}

// Signed sums, shares and draws are as indifferent to threads as the rest.
TEST(PerStep, ThreadsDoNotChangeOneBit) {
  TestScene scene = sphereScene(6, 0.9, 0.6, 16, 16);
  scene.particles = particlesIn(scene, 1000);
  for (const bool means : {false, true}) {
    LightFieldLayout layout = histogram();
    layout.carrier = Carrier::particles;
    layout.deposit = Deposit::collision;
    layout.evaluate = Evaluate::perStep;
    layout.direction = DirectionDeposit::barycentric;
    layout.representative = means ? Representative::mean : Representative::bin;
    layout.merge = means ? Merge::full : Merge::sampled;
    std::vector<Rgb> first;
    for (const unsigned threads : {1u, 3u}) {
      const ThreadLimit limit(threads);
      const auto image = renderPhotosphere(scene, layout, 5'000, 5, 1).layers.multiple;
      if (threads == 1) first = image;
      EXPECT_EQ(image, first);
    }
  }
}

// One bin in place of all is right in the mean: over many draws, within five standard errors.
TEST(Merge, SampledIsFullInTheMean) {
  const RunOnly runOnly;
  TestScene scene = sphereScene(6, 0.9, 0.4, 16, 16);
  scene.particles = particlesIn(scene, 1000);
  LightFieldLayout layout = histogram();
  layout.rows = 1;
  layout.radius = layout.depositRadius = 0.1;
  layout.carrier = Carrier::particles;
  layout.deposit = Deposit::collision;
  const LightField full = trace(scene, layout);
  LightField sampled = full;
  sampled.layout.merge = Merge::sampled;
  const auto exact = resolve(*scene.medium, full, scene.view());
  const int draws = static_cast<int>(fewer(100));
  for (const Vec3f& p : kPlaces) {
    const auto c = coefficientsAt(scene, p);
    double sum = 0, squares = 0;
    for (int i = 0; i < draws; ++i) {
      const auto source = resolve(*scene.medium, sampled, scene.view(),
                                  RandomKey::fromSeed(static_cast<std::uint64_t>(i), 0));
      const auto value = static_cast<double>(source->at(p, {0, -1, 0}, c).multiple.y);
      sum += value;
      squares += value * value;
    }
    const double mean = sum / draws;
    const double deviation = std::sqrt(std::max(0.0, squares / draws - mean * mean));
    const auto expected = static_cast<double>(exact->at(p, {0, -1, 0}, c).multiple.y);
    EXPECT_GT(deviation, 0.01 * mean) << "draws must differ";
    EXPECT_NEAR(mean, expected, 5 * deviation / std::sqrt(draws));
  }
}

// A field made by hand: light of fluence 1 about one direction, in every voxel.
LightField beam(const TestScene& scene, const LightFieldLayout& layout, const Vec3f& direction) {
  LightField field;
  field.layout = layout;
  field.layout.phases = 1;
  field.lattice = transport::SupportLattice(*scene.medium, 2 * scene.medium->voxelEdge(), 2);
  const auto stride = static_cast<std::size_t>(layout.valuesPerCarrier());
  field.values.assign(field.lattice.size() * stride, 0.0f);
  const sphere::BinShares shares = layout.binShares();
  std::vector<sphere::BinShare> list(static_cast<std::size_t>(shares.maxShares()));
  const int count = shares.shares(direction, list.data());
  for (std::size_t i = 0; i < field.lattice.size(); ++i)
    for (int k = 0; k < count; ++k) {
      const auto& share = list[static_cast<std::size_t>(k)];
      field.values[i * stride + static_cast<std::size_t>(share.bin)] = share.weight;
      for (int axis = 0; layout.keepsMeans() && axis < 3; ++axis)
        field.values[i * stride + static_cast<std::size_t>(layout.bins() + 3 * share.bin + axis)] =
            share.weight * direction[axis];
    }
  return field;
}

// Largest error of the light that a beam scatters, over its value straight on.
double beamError(const TestScene& scene, const LightFieldLayout& layout) {
  const Vec3f direction = glm::normalize(Vec3f(0.9f, 0.2f, 0.1f));  // far from its bin's centre
  const auto source = resolve(*scene.medium, beam(scene, layout, direction), scene.view());
  const auto c = coefficientsAt(scene, Vec3f(0.0f));
  const auto& phase = scene.medium->phases()[0];
  const sphere::Partition directions(6);
  float worst = 0.0f;
  for (int i = 0; i < directions.size(); ++i) {
    const Vec3f wo = directions.center(i);
    const float light = source->at(Vec3f(0.0f), wo, c).multiple.y / c.scattering[0].y;
    worst = std::max(worst, std::abs(light - phase.evaluate(direction, wo)));
  }
  return static_cast<double>(worst / phase.evaluate(direction, direction));
}

TEST(Representative, MeanKeepsTheDirectionOfABeam) {
  const TestScene scene = sphereScene(4, 0.9, 0.7, 16, 16);
  LightFieldLayout layout = histogram();
  layout.radius = 0;
  layout.evaluate = Evaluate::perStep;
  EXPECT_GT(beamError(scene, layout), 0.2) << "a bin knows its own direction alone";
  layout.representative = Representative::mean;
  EXPECT_LT(beamError(scene, layout), 0.01);
}

// What is kept beside a bin is the sum of power times direction: no longer than the power, along
// the bin, and in sum over the bins the same vector whatever bins the light fell in.
TEST(Representative, MeanIsTheSumOfPowerTimesDirection) {
  const TestScene scene = sphereScene(6, 0.9, 0.6, 8, 16);
  LightFieldLayout layout = histogram();
  layout.representative = Representative::mean;
  const LightField nearest = trace(scene, layout);
  layout.direction = DirectionDeposit::barycentric;
  const LightField shared = trace(scene, layout);
  const sphere::Partition bins(layout.rows);
  const auto stride = static_cast<std::size_t>(layout.valuesPerCarrier());
  double total = 0, difference = 0, length = 0;
  for (std::size_t i = 0; i < nearest.carriers(); ++i) {
    const float* a = nearest.values.data() + i * stride;
    const float* b = shared.values.data() + i * stride;
    Vec3d sumA(0.0), sumB(0.0);
    for (int j = 0; j < bins.size(); ++j) {
      const float* mean = a + bins.size() + 3 * j;
      const Vec3d m(mean[0], mean[1], mean[2]);
      ASSERT_LE(glm::length(m), 1.001 * static_cast<double>(a[j]) + 1e-3);
      if (glm::length(m) > 0.01) {
        ASSERT_LT(sphere::angleBetween(Vec3f(glm::normalize(m)), bins.center(j)), 0.8f);
      }
      sumA += m;
      sumB += Vec3d(b[bins.size() + 3 * j], b[bins.size() + 3 * j + 1], b[bins.size() + 3 * j + 2]);
      total += static_cast<double>(a[j]);
      length += glm::length(m);
    }
    difference += glm::length(sumA - sumB);
  }
  EXPECT_GT(length, 0.8 * total) << "light within a bin is nearly of one direction";
  EXPECT_LT(difference, 1e-3 * total);
}

TEST(Layout, RefusesWhatHasNoMeaning) {
  const auto message = [](const std::function<void(LightFieldLayout&)>& set) -> std::string {
    LightFieldLayout layout = histogram();
    set(layout);
    try {
      checkLayout(layout);
    } catch (const ConfigError& error) {
      return error.what();
    }
    return "";
  };
  const auto names = [&](const std::string& key,
                         const std::function<void(LightFieldLayout&)>& set) {
    EXPECT_NE(message(set).find(key), std::string::npos) << key << ": " << message(set);
  };
  EXPECT_EQ(message([](LightFieldLayout&) {}), "");
  names("energy", [](LightFieldLayout& l) { l.energy = EnergyRule::scatter; });
  names("energy", [](LightFieldLayout& l) {
    l.energy = EnergyRule::scatter;
    l.carrier = Carrier::particles;
  });
  names("merge", [](LightFieldLayout& l) { l.merge = Merge::sampled; });
  names("direction", [](LightFieldLayout& l) { l.direction = DirectionDeposit::kernel; });
  names("bandwidth", [](LightFieldLayout& l) {
    l.angularKernel = AngularKernel::gaussian;
    l.bandwidth = 0;
  });
  names("72 and 128", [](LightFieldLayout& l) {
    l.carrier = Carrier::particles;
    l.merge = Merge::sampled;
    l.evaluate = Evaluate::perStep;
    l.directions = 100;
  });
  for (const Option& option : kOptions)
    EXPECT_EQ(message(option.set), "") << option.name;
  const std::pair<const char*, std::function<void(LightFieldLayout&)>> ofBins[] = {
      {"direction", [](LightFieldLayout& l) { l.direction = DirectionDeposit::barycentric; }},
      {"representative", [](LightFieldLayout& l) { l.representative = Representative::mean; }},
      {"per_step", [](LightFieldLayout& l) { l.evaluate = Evaluate::perStep; }},
      {"merge", [](LightFieldLayout& l) {
         l.merge = Merge::sampled;
         l.carrier = Carrier::particles;
       }}};
  for (const auto& [key, set] : ofBins)
    names(key, [&set = set](LightFieldLayout& l) {
      l.basis = Basis::view;
      set(l);
    });
}

TEST(LightCache, HoldsEveryWayOfStoringDirections) {
  const TestScene scene = sphereScene(8, 0.95, 0.5, 8, 16);
  const TemporaryFolder folder;
  for (const Option& option : kOptions)
    for (const int channels : {1, 3}) {
      LightFieldLayout layout = histogram();
      layout.rows = channels == 1 ? 2 : 1;
      layout.channels = channels;
      layout.unscattered = channels == 3;
      option.set(layout);
      const LightField field = trace(scene, layout, 500);
      const LightCacheKey key{"m", "l", {}};
      const auto path = folder / "light.vdb";
      writeLightCache(path, field, key);
      const LightField back = readLightCache(path, key, false);
      EXPECT_EQ(back.values, field.values) << option.name;
      EXPECT_EQ(back.layout.direction, layout.direction);
      EXPECT_EQ(back.layout.representative, layout.representative);
      EXPECT_EQ(back.layout.setSize(), layout.setSize());
      if (layout.direction == DirectionDeposit::kernel) {
        EXPECT_EQ(back.layout.bandwidth, layout.bandwidth);
      }
    }
}

// A light cache that is changed as points, whose checksum stays what it was.
class ChangedLightCache : public testing::Test {
 protected:
  LightField readChanged(const std::function<void(volume::ParticleSet&)>& change) const {
    const auto path = m_folder / "light.vdb";
    writeLightCache(path, m_field, m_key);
    const volume::VdbFile file = volume::readVdb(path.string());
    volume::ParticleSet points = volume::gridToPoints(file.find("light"));
    change(points);
    volume::writeVdb(path, {volume::pointsToGrid(points, "light", 0.0)});
    return readLightCache(path, m_key, false);
  }
  const LightField& field() const { return m_field; }

 private:
  const LightField m_field = trace(sphereScene(8, 0.95, 0.5, 8, 16), histogram(), 500);
  const LightCacheKey m_key{"m", "l", {}};
  const TemporaryFolder m_folder;
};

// Caches from before directions had a choice say nothing of it, nor have they a checksum: nearest
// bins that keep no mean.
TEST_F(ChangedLightCache, OlderOnesStillRead) {
  const LightField back = readChanged([](volume::ParticleSet& points) {
    EXPECT_EQ(points.metadata.erase("direction"), 1u);
    EXPECT_EQ(points.metadata.erase("representative"), 1u);
    points.metadata["photosphere_format"] = "photosphere light cache 1";
  });
  EXPECT_EQ(back.values, field().values);
  EXPECT_EQ(back.layout.direction, DirectionDeposit::nearest);
  EXPECT_EQ(back.layout.representative, Representative::bin);
}

// One value, one word of the metadata or one voxel that is not what it was.
TEST_F(ChangedLightCache, DamageIsSeen) {
  EXPECT_EQ(readChanged([](volume::ParticleSet&) {}).values, field().values);
  const auto expectSeen = [&](const std::function<void(volume::ParticleSet&)>& damage) {
    try {
      readChanged(damage);
      ADD_FAILURE() << "was read";
    } catch (const InputError& error) {
      const std::string what = error.what();
      EXPECT_NE(what.find("is damaged"), std::string::npos) << what;
      EXPECT_NE(what.find("trace it again"), std::string::npos) << what;
    }
  };
  expectSeen([](volume::ParticleSet& points) {
    auto& values = std::get<std::vector<float>>(points.find("photon_histogram")->data);
    values.back() = std::nextafter(values.back(), 1e9f);
  });
  expectSeen([](volume::ParticleSet& points) { points.metadata["photons"] = "501"; });
  expectSeen([](volume::ParticleSet& points) { points.metadata["radius_m"] = "0.25"; });
  // Two voxels change places.
  expectSeen([](volume::ParticleSet& points) {
    std::swap(points.positions.front(), points.positions.back());
  });
}

}  // namespace

}  // namespace photosphere::test
