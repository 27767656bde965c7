#include "stability_traces.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <nlohmann/json.hpp>

#include "child.h"
#include "photosphere/core/error.h"
#include "photosphere/core/fixed_point.h"
#include "photosphere/core/sampling.h"
#include "photosphere/estimators/light_sums.h"
#include "photosphere/transport/photon_tracer.h"

namespace photosphere::study {

namespace {

using nlohmann::json;

constexpr double kCpuLimit = 1800, kQuickCpuLimit = 60;  // seconds of processor time

// A slab of extinction 1 in z = -tau/2 .. tau/2, so wide that its sides do not matter.
transport::Medium slab(double tau, double albedo, double g) {
  using Field = volume::BrickField<float>;
  transport::MediumVolume v;
  v.name = "slab";
  v.density = Field(Vec3i(0), Vec3i(1), {Vec3i(0)},
                    [](const Vec3i&, float* n) { std::fill_n(n, Field::kBrickSize, 1.0f); });
  const double width = 2 * (4 * tau + 30);
  const Vec3d size(width, width, tau);
  for (int a = 0; a < 3; ++a) {
    v.localFromNode[a][a] = size[a] / 8;
    v.localFromNode[3][a] = -0.5 * size[a];
  }
  v.densityScale = 1;
  v.albedo = Rgb(static_cast<float>(albedo));
  v.phase = phase::HenyeyGreenstein(g);
  std::vector<transport::MediumVolume> volumes;
  volumes.push_back(std::move(v));
  return transport::Medium(std::move(volumes));
}

// Photons into the middle of the upper face.
class FaceLamp final : public lights::Light {
 public:
  FaceLamp(double top, bool beam, double excess) : m_top(top), m_excess(excess), m_beam(beam) {}
  Rgb power(const lights::BoundingSphere&) const override { return Rgb(1.0f); }
  lights::Emission emit(const lights::BoundingSphere&, const Vec4f& u) const override {
    const Vec3f w = m_beam ? Vec3f(0, 0, 1) : sampleCosineHemisphere({u.x, u.y});
    return {Vec3d(0, 0, m_top) + Vec3d(w) * 1e-6 * (1 + m_top), -w,
            Rgb(static_cast<float>(m_excess))};
  }
  lights::Illumination illuminate(const Vec3f&, const Vec2f&) const override { return {}; }
  bool isDelta() const override { return true; }
  bool isGrey() const override { return true; }

 private:
  double m_top, m_excess;
  bool m_beam;
};

transport::LightList lampAt(double top, bool beam, double excess = 1) {
  transport::LightList list;
  list.push_back(std::make_unique<FaceLamp>(top, beam, excess));
  return list;
}

// Power that leaves upward and downward, in photons; what is not finite, counted.
struct LeaveSums final : transport::FlightSink {
  void consume(std::span<const transport::Flight> flights) override {
    double upward = 0, downward = 0;
    std::uint64_t bad = 0;
    for (const transport::Flight& flight : flights) {
      const auto power = static_cast<double>(flight.power.x);
      if (!(power >= 0 && std::isfinite(power) && std::isfinite(flight.length))) ++bad;
      if (!flight.collided()) (flight.direction.z > 0 ? upward : downward) += power;
    }
    add(up, upward);
    add(down, downward);
    notFinite += bad;
  }
  static void add(std::atomic<double>& sum, double value) {
    double before = sum.load();
    while (!sum.compare_exchange_weak(before, before + value)) {
    }
  }
  std::atomic<double> up{0}, down{0};
  std::atomic<std::uint64_t> notFinite{0};
};

std::string fluxWork(const StabilityCase& c, std::uint64_t photons) {
  const double tau = c.slab.number("tau", 1);
  const transport::Medium medium = slab(tau, c.slab.number("albedo", 1), c.slab.number("g", 0));
  LeaveSums sums;
  transport::TraceOptions options;
  options.photons = photons;
  options.key = RandomKey::fromSeed(11, 0);
  const transport::TraceStatistics s =
      tracePhotons(medium, lampAt(tau / 2, c.slab.number("beam", 0) > 0), options, sums);
  const double n = static_cast<double>(photons);
  return json{{"R", sums.up / n},
              {"T", sums.down / n},
              {"absorbed", s.absorbed.x},
              {"capped", s.cappedPower.x},
              {"missed", s.missed.x},
              {"violations", s.majorantViolations},
              {"bad", sums.notFinite.load()}}
      .dump();
}

void judge(double expected, double result, StabilityRow& row) {
  row.expected = fmt::format("{:.6g}", expected);
  row.result = fmt::format("{:.6g}", result);
  row.error = std::abs(result / expected - 1);
  row.passed = row.error <= row.bound;
}

void runFlux(const StabilityCase& c, bool quick, StabilityRow& row) {
  const double tau = c.slab.number("tau", 1), albedo = c.slab.number("albedo", 1);
  const double g = c.slab.number("g", 0);
  const bool beam = c.slab.number("beam", 0) > 0;
  const double photons = c.slab.number(quick ? "quick_photons" : "photons", 1e5);
  const ChildResult child =
      runInChild([&] { return fluxWork(c, static_cast<std::uint64_t>(photons)); },
                 quick ? kQuickCpuLimit : kCpuLimit);
  row.seconds = child.seconds;
  if (child.failed) {
    row.message = child.message;
    return;
  }
  const json v = json::parse(child.text);
  const double reflected = v.at("R"), through = v.at("T"), absorbed = v.at("absorbed");
  row.cappedPower = v.at("capped");
  row.nanSamples = v.at("bad");
  const std::string& kind = c.oracle.kind;
  if (kind == "diffusion")
    judge((4.0 / 3.0) / ((1 - g) * tau + 1.42), through, row);
  else if (kind == "semi_infinite")
    judge(semiInfiniteReflectance(albedo, beam), reflected, row);
  else if (kind == "conserved")
    judge(1, reflected + through + row.cappedPower, row);  // albedo 1: nothing is absorbed
  else
    throw ConfigError(fmt::format("{}: slab_flux has no oracle '{}'", c.name, kind));
  row.message = fmt::format("R {:.6g}, T {:.6g}, absorbed {:.6g}, capped {:.3g}, {:.0f} photons",
                            reflected, through, absorbed, row.cappedPower, photons);
  const std::uint64_t violations = v.at("violations");
  row.passed = row.passed && row.nanSamples == 0 && violations == 0;
  if (violations > 0) row.message += fmt::format(", {} majorants exceeded", violations);
}

// Sums of photons' bins in a slab. @param excess  power of each, over one photon's share
estimators::LightSums storedSums(double excess, std::uint64_t photons) {
  const transport::Medium medium = slab(2, 1, 0);
  estimators::LightFieldLayout layout;
  layout.basis = estimators::Basis::histogram;
  layout.channels = 1;
  layout.lightVoxel = 8;
  layout.radius = layout.depositRadius = 1;
  transport::TraceOptions options;
  options.photons = photons;
  options.key = RandomKey::fromSeed(3, 0);
  transport::TraceStatistics statistics;
  return traceLightSums(medium, lampAt(1, false, excess), layout, estimators::View{}, {}, options,
                        statistics);
}

// All the light that a field stores.
double lightOf(estimators::LightSums sums) {
  double light = 0;
  for (const float value : toField(std::move(sums)).values)
    light += static_cast<double>(value);
  return light;
}

// Sums that hold so many times what some photons leave must go on to count these, to the last unit:
// added as a shard, and one by one as deposits.
std::string countWork(std::int64_t times, std::uint64_t photons) {
  const estimators::LightSums few = storedSums(1, photons);
  estimators::LightSums many = few;
  for (std::int64_t& sum : many.sums)
    sum *= times;
  FixedSums deposits;
  deposits.sums = many.sums;
  addSums(many, few);
  std::uint64_t wrong = 0, counted = 0;
  for (std::size_t i = 0; i < few.sums.size(); ++i) {
    counted += few.sums[i] > 0;
    for (int k = 0; k < 3; ++k)
      deposits.add(i, deposits.quantum, 0x80000000u);
    wrong += many.sums[i] != few.sums[i] * (times + 1);
    wrong += deposits.sums[i] != few.sums[i] * times + 3;
  }
  wrong += deposits.overflows.load();
  const auto fullest = std::max_element(many.sums.begin(), many.sums.end());
  return json{{"wrong", wrong},
              {"counted", counted},
              {"fullest", fullest == many.sums.end() ? 0.0 : static_cast<double>(*fullest)},
              {"few", lightOf(few)},
              {"many", lightOf(std::move(many))}}
      .dump();
}

void runSums(const StabilityCase& c, StabilityRow& row) {
  constexpr std::uint64_t photons = 1000;
  if (const double times = c.slab.number("times", 0); times > 0) {
    const ChildResult child =
        runInChild([&] { return countWork(static_cast<std::int64_t>(times), photons); });
    row.seconds = child.seconds;
    row.message = child.message;
    if (child.failed) return;
    const json v = json::parse(child.text);
    judge(v.at("few").get<double>() * (times + 1), v.at("many"), row);
    const std::uint64_t wrong = v.at("wrong"), counted = v.at("counted");
    row.message = fmt::format("{} bins counted, {} sums wrong, the fullest at 2^{:.1f} of 2^63",
                              counted, wrong, std::log2(v.at("fullest").get<double>()));
    row.passed = row.passed && wrong == 0 && counted > 0;
    return;
  }
  const double excess = std::exp2(c.slab.number("excess", 0));
  const auto light = [](double by) { return fmt::format("{}", lightOf(storedSums(by, photons))); };
  const ChildResult plain = runInChild([&] { return light(1); });
  const ChildResult child = runInChild([&] { return light(excess); });
  row.seconds = child.seconds;
  if (c.oracle.kind == "error")
    return judgeRefusal(c, child.failed, child.code, child.message, row);
  row.message = child.failed ? child.message : plain.message;
  if (child.failed || plain.failed) return;
  judge(std::stod(plain.text) * excess, std::stod(child.text), row);
}

}  // namespace

void judgeRefusal(const StabilityCase& c, bool failed, ExitCode code, const std::string& message,
                  StabilityRow& row) {
  row.expected = fmt::format("exit {}", c.oracle.code);
  row.result = fmt::format("exit {}", static_cast<int>(code));
  row.message = message;
  row.passed = failed && static_cast<int>(code) == c.oracle.code &&
               message.find(c.oracle.message) != std::string::npos;
  row.error = row.passed ? 0 : 1;
  if (!row.passed && failed) row.message += fmt::format(" (wanted: {})", c.oracle.message);
}

double semiInfiniteReflectance(double albedo, bool beam) {
  // Gauss-Legendre over [0, 1] in 64 points, by Newton's method on the Legendre polynomial.
  constexpr int n = 64;
  std::array<double, n> mu{}, weight{}, h{};
  for (int i = 0; i < n; ++i) {
    double x = std::cos(kPi * (i + 0.75) / (n + 0.5)), slope = 1;
    for (int pass = 0; pass < 50; ++pass) {
      double before = 1, value = x;
      for (int k = 2; k <= n; ++k)
        before = std::exchange(value, ((2 * k - 1) * x * value - (k - 1) * before) / k);
      slope = n * (x * value - before) / (x * x - 1);
      x -= value / slope;
    }
    const auto at = static_cast<std::size_t>(i);
    mu[at] = 0.5 * (x + 1);
    weight[at] = 1 / ((1 - x * x) * slope * slope);
  }
  h.fill(1);
  const double root = std::sqrt(1 - albedo);
  // 1/H(m) = sqrt(1 - w) + w/2 int mu' H(mu') / (m + mu') dmu'.
  const auto next = [&](double m) {
    double sum = 0;
    for (std::size_t j = 0; j < mu.size(); ++j)
      sum += weight[j] * mu[j] * h[j] / (m + mu[j]);
    return 1 / (root + 0.5 * albedo * sum);
  };
  for (int pass = 0; pass < 2000; ++pass) {
    std::array<double, n> better{};
    for (std::size_t i = 0; i < mu.size(); ++i)
      better[i] = next(mu[i]);
    h = better;
  }
  if (beam) return 1 - next(1) * root;
  double flux = 0;
  for (std::size_t i = 0; i < mu.size(); ++i)
    flux += weight[i] * 2 * mu[i] * h[i];
  return 1 - flux * root;
}

void runStabilityTrace(const StabilityCase& c, bool quick, StabilityRow& row) {
  if (c.trace == "slab_flux") return runFlux(c, quick, row);
  if (c.trace == "sums") return runSums(c, row);
  throw ConfigError(fmt::format("{}: '{}' is nothing that can be traced (known: slab_flux, sums)",
                                c.name, c.trace));
}

}  // namespace photosphere::study
