#include "photosphere/phase/phase.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "photosphere/core/error.h"

namespace photosphere::phase {

HenyeyGreenstein::HenyeyGreenstein(double g) : m_g(g) {
  const double absG = std::abs(g);
  if (!(absG < 1.0))  // also true for NaN
    throw ConfigError(fmt::format("phase: g = {} is not a mean cosine; use -1 < g < 1", g));
  m_absG = static_cast<float>(absG);
  m_sign = g < 0 ? -1.0f : 1.0f;
  m_oneMinusAbsG = static_cast<float>(1.0 - absG);
  m_oneMinusAbsGSquared = static_cast<float>((1.0 - absG) * (1.0 - absG));
  m_numerator = static_cast<float>((1.0 - absG) * (1.0 + absG) / (4.0 * kPi));
}

namespace {

constexpr double kSmallestG = 1e-3;  // below, sample() would lose digits

// The root of a function that rises from below 0 at `low` to above at `high`: Newton's method, and
// halving where it would leave the bracket or is slow.
template <class Function>
double risingRoot(double low, double high, double x, const Function& f) {
  for (int i = 0; i < 64 && high - low > 1e-15; ++i) {
    const auto [value, slope] = f(x);
    (value > 0 ? high : low) = x;
    const double next = slope > 0 ? x - value / slope : low;
    const bool inside = next > low && next < high;
    if (inside && std::abs(next - x) <= 1e-15 + 1e-13 * std::abs(x)) return next;
    x = inside ? next : 0.5 * (low + high);
  }
  return x;
}

struct Value {
  double value, slope;
};

}  // namespace

Draine::Draine(double g, double alpha)
    : m_lobe(alpha != 0.0 && std::abs(g) < kSmallestG ? 0.0 : g), m_alpha(alpha) {
  if (!(alpha >= 0.0) || !(alpha <= 1e6))  // also true for NaN
    throw ConfigError(fmt::format("phase: alpha = {} is no weight; use 0 to 1e6", alpha));
  const double g2 = m_lobe.g() * m_lobe.g();
  m_alphaF = static_cast<float>(alpha);
  m_norm = static_cast<float>(1.0 / (1.0 + alpha * (1.0 + 2.0 * g2) / 3.0));
}

double Draine::meanCosine() const {
  const double g2 = g() * g();
  return g() * (1.0 + m_alpha * (3.0 + 2.0 * g2) / 5.0) / (1.0 + m_alpha * (1.0 + 2.0 * g2) / 3.0);
}

Vec3f Draine::sample(const Vec3f& wi, const Vec2f& u) const {
  if (m_alpha == 0.0) return m_lobe.sample(wi, u);
  // Of probability 1 - u to be nearer the peak, as in Henyey-Greenstein's.
  const double part = 1.0 - static_cast<double>(u.x), a = std::abs(g());
  if (a == 0.0) {
    // The integral of 1 + alpha c^2 from -1.
    const double total = 2.0 * (1.0 + m_alpha / 3.0);
    const double c = risingRoot(-1.0, 1.0 + 1e-15, 1.0 - 2.0 * part, [&](double x) {
      return Value{x + 1.0 + m_alpha / 3.0 * (x * x * x + 1.0) - (1.0 - part) * total,
                   1.0 + m_alpha * x * x};
    });
    return m_lobe.around(wi, static_cast<float>(1.0 - c), u.y);
  }
  // With q^2 = (1-a)^2 + 2 a t and t = 1 - s cos, the density of q is (1 + alpha (1-t)^2) / q^2,
  // and 1 - t = (1 + a^2 - q^2) / (2 a).
  const double sum = 1.0 + a * a, k = m_alpha / (4.0 * a * a);
  const auto integral = [&](double q) {
    return -1.0 / q + k * (q * (q * q / 3.0 - 2.0 * sum) - sum * sum / q);
  };
  const double low = 1.0 - a, high = 1.0 + a, from = integral(low);
  const double wanted = part * (integral(high) - from);
  const double start = low * high / (high - 2.0 * a * part);  // Henyey-Greenstein's own
  const double q = risingRoot(low, high, start, [&](double x) {
    const double c = (sum - x * x) / (2.0 * a);
    return Value{integral(x) - from - wanted, (1.0 + m_alpha * c * c) / (x * x)};
  });
  return m_lobe.around(wi, static_cast<float>((q - low) * (q + low) / (2.0 * a)), u.y);
}

PhaseFunction::PhaseFunction(const Draine& first, const Draine& second, double weight)
    : m_first(first), m_second(second), m_weight(weight) {
  if (!(weight >= 0.0 && weight <= 1.0))
    throw ConfigError(fmt::format("phase: weight = {} is no share; use 0 to 1", weight));
  if (weight == 1.0) {
    m_first = second;
    m_weight = 0.0;
  }
  m_isPlain = m_weight == 0.0 && m_first.alpha() == 0.0;
  if (m_isPlain) m_plain = HenyeyGreenstein(m_first.g());
}

float PhaseFunction::evaluateMixture(const Vec3f& wi, const Vec3f& wo) const {
  const auto second = static_cast<float>(m_weight);
  const float first = m_first.evaluate(wi, wo);
  return second > 0.0f ? first + second * (m_second.evaluate(wi, wo) - first) : first;
}

Vec3f PhaseFunction::sampleMixture(const Vec3f& wi, const Vec2f& u) const {
  const auto second = static_cast<float>(m_weight);
  if (u.x < second) return m_second.sample(wi, {u.x / second, u.y});
  // Stays below 1: the largest u.x is 1 - 2^-24, and rounding may bring the quotient to 1.
  const float rest = (u.x - second) / (1.0f - second);
  return m_first.sample(wi, {glm::min(rest, 1.0f - 0x1p-24f), u.y});
}

float PhaseFunction::maximum() const {
  if (m_isPlain) return m_plain.maximum();
  const auto second = static_cast<float>(m_weight);
  const float sum = (1.0f - second) * m_first.maximum() + second * m_second.maximum();
  return sum * (1.0f + 4e-7f);  // the sums of evaluate() round another way
}

double PhaseFunction::meanCosine() const {
  return weight(0) * m_first.meanCosine() + weight(1) * m_second.meanCosine();
}

bool PhaseFunction::operator==(const PhaseFunction& other) const {
  if (m_weight != other.m_weight) return false;
  for (int i = 0; i < lobes(); ++i)
    if (lobe(i).g() != other.lobe(i).g() || lobe(i).alpha() != other.lobe(i).alpha()) return false;
  return true;
}

namespace {

// Degrees beyond which moments are nothing, and how many are kept at the most.
constexpr double kNothing = 1e-7;
constexpr std::size_t kMostMoments = 4096;

// Of x f, from those of f: x P_l = ((l + 1) P_{l+1} + l P_{l-1}) / (2 l + 1). One fewer.
std::vector<double> timesCosine(const std::vector<double>& of) {
  std::vector<double> out(of.size() - 1);
  for (std::size_t l = 0; l < out.size(); ++l) {
    const auto n = static_cast<double>(l);
    out[l] = ((n + 1) * of[l + 1] + (l > 0 ? n * of[l - 1] : 0.0)) / (2 * n + 1);
  }
  return out;
}

std::vector<double> lobeMoments(const Draine& lobe, std::size_t count) {
  std::vector<double> moments(count + 2);
  double power = 1.0;
  for (double& m : moments) {
    m = power;
    power *= lobe.g();
  }
  if (lobe.alpha() > 0) {
    const std::vector<double> squared = timesCosine(timesCosine(moments));
    const double norm = 1.0 + lobe.alpha() * squared[0];
    for (std::size_t l = 0; l < count; ++l)
      moments[l] = (moments[l] + lobe.alpha() * squared[l]) / norm;
  }
  moments.resize(count);
  return moments;
}

}  // namespace

std::vector<double> legendreMoments(const PhaseFunction& phase) {
  double sharpest = 0;
  for (int i = 0; i < phase.lobes(); ++i)
    sharpest = std::max(sharpest, std::abs(phase.lobe(i).g()));
  // cos^2 moves what is left of a power of g by two degrees.
  const double degrees = sharpest > 0 ? 4 + std::log(kNothing) / std::log(sharpest) : 4;
  const bool cut = !(degrees < static_cast<double>(kMostMoments));
  const std::size_t count = cut ? kMostMoments : static_cast<std::size_t>(degrees);
  std::vector<double> sum(count, 0.0);
  for (int i = 0; i < phase.lobes(); ++i) {
    const std::vector<double> part = lobeMoments(phase.lobe(i), count);
    for (std::size_t l = 0; l < count; ++l)
      sum[l] += phase.weight(i) * part[l];
  }
  if (cut)  // what is cut off would ring
    for (std::size_t l = 0; l < count; ++l) {
      const double x = 4.0 * static_cast<double>(l) / static_cast<double>(count);
      sum[l] *= std::exp(-0.5 * x * x);
    }
  while (sum.size() > 1 && std::abs(sum.back()) < kNothing)
    sum.pop_back();
  return sum;
}

}  // namespace photosphere::phase
