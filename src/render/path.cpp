#include <algorithm>
#include <optional>
#include <type_traits>

#include "backgrounds.h"
#include "instances.h"
#include "lamp_choice.h"
#include "near_lamps.h"
#include "photosphere/render/integrator.h"
#include "photosphere/transport/scatter.h"

namespace photosphere::render {

namespace {

using transport::Collision;
using transport::Medium;
using transport::Segment;

// Light is what transmittances are made of: float, or Rgb where extinction differs from channel to
// channel. When is Still, or Moment where the smoke moves.
template <class Light, class When>
class PathIntegrator final : public Integrator {
 public:
  PathIntegrator(const Medium& medium, const transport::LightList& lights,
                 const PathOptions& options)
      : m_medium(medium),
        m_options(options),
        m_emission(options.effects.emission ? medium.emission() : nullptr),
        m_backgrounds(backgroundsOf(medium, lights)) {
    for (const auto& light : lights) {
      const bool sampled =
          !light->isUniform() || options.environment == EnvironmentSampling::nextEvent;
      (sampled ? m_sampled : m_escaped).push_back(light.get());
    }
    const lights::BoundingSphere bounds = transport::boundingSphere(medium);
    double sum = 0;
    for (const lights::Light* light : m_sampled) {
      sum += lights::largestPower(*light, bounds);
      m_cumulative.push_back(sum);
    }
    for (double& c : m_cumulative)
      c = sum > 0 ? c / sum : 0;
    if (!(sum > 0)) m_sampled.clear();
    if (m_sampled.size() > LampChoice::kFew)
      m_choice.emplace(medium, m_sampled);
    else
      m_near.emplace(medium, m_sampled);
  }

  RayRadiance radiance(const Vec3d& origin, const Vec3f& direction, transport::Moment moment,
                       Rng& rng, IntegratorCounters& counters) const override {
    When when;
    if constexpr (std::is_same_v<When, transport::Moment>) when = moment;
    RayRadiance result;
    Segment segment = transport::clipToMedium(m_medium, origin, direction,
                                              std::numeric_limits<double>::infinity());
    if (!(segment.length > 0.0f)) {
      addEscape(result, Rgb(1.0f), direction, 0);
      return result;
    }
    Rgb throughput(1.0f);
    bool begins = true;   // a flight, rather than its rest past what only some channels met
    bool forced = false;  // what leaves the smoke unscattered has been counted
    for (int scatterings = 0;;) {
      if (findsLight(scatterings))
        addNearLamps(result, throughput, segment, scatterings, rng, counters, when);
      Collision hit;
      if (begins) forced = isForced(scatterings, result.transmittance);
      if (begins && forced) {
        const auto all = transport::forceCollision<Light>(throughput, m_medium, segment.origin,
                                                          segment.direction, lengthOf(segment), rng,
                                                          counters.tracking, when);
        if (scatterings == 0) result.transmittance = Rgb(all.transmittance);
        addEscape(result, throughput * all.transmittance, segment.direction, scatterings);
        hit = all.hit;
        throughput *= all.weight;
      } else if (begins && scatterings == 0) {
        Light transmittance(1.0f);
        hit = transport::sampleCollisionAndTransmittance(m_medium, segment.origin,
                                                         segment.direction, segment.length, rng,
                                                         counters.tracking, transmittance, when);
        result.transmittance = Rgb(transmittance);
      } else {
        hit = transport::sampleCollisionOf(throughput, m_medium, segment.origin, segment.direction,
                                           segment.length, rng, counters.tracking, when);
      }
      if (m_emission) addEmission(result, throughput, segment, hit, scatterings, rng, when);
      if (!hit.happened()) {
        if (!forced) addEscape(result, throughput, segment.direction, scatterings);
        return result;
      }
      if (scatterings == 0) {
        const auto begin = static_cast<float>(segment.begin);
        addDepth(result, throughput / hit.share, begin + hit.distance,
                 segment.origin + segment.direction * hit.distance, hit.extinction, when);
      }
      ++counters.scatterings;
      const Vec3f p = segment.origin + segment.direction * hit.distance;
      if (!m_options.effects.singleScattering && !m_options.effects.multipleScattering)
        return result;
      if (scatterings > 0 && !m_options.effects.multipleScattering) return result;
      const bool last = m_options.maxScatter > 0 && scatterings >= m_options.maxScatter;
      // Where channels differ, light may still pass what stands for a collision.
      if (last && std::is_same_v<Light, float>) return capped(result, throughput, counters);
      if (!last)
        addNextEvent(result, throughput / hit.share, p, segment.direction, scatterings, rng,
                     counters, when);
      const transport::ScatterEvent event =
          transport::scatter(m_medium, p, segment.direction, throughput, rng, when);
      if (!event.survived) return result;
      if (last && event.scattered) return capped(result, throughput, counters);
      throughput *= event.weight;
      begins = event.scattered;
      if constexpr (!std::is_same_v<Light, float>)
        if (!event.scattered) {
          segment = {p, segment.direction, kInfinity,
                     segment.begin + static_cast<double>(hit.distance)};
          continue;
        }
      if (transport::isLongPath(static_cast<std::uint32_t>(scatterings) + 1)) {
        if (!(rng.uniform() < 0.5f)) return result;
        throughput *= 2.0f;
      }
      // From inside, the walk over the majorants ends where the medium does.
      segment = {p, event.direction, kInfinity, 0.0};
      ++scatterings;
    }
  }

 private:
  // Whether lamps are asked for light that scatters here toward the eye, after so many scatterings.
  bool findsLight(int scatterings) const {
    if (m_options.maxScatter > 0 && scatterings >= m_options.maxScatter) return false;
    return m_options.effects.multipleScattering ||
           (scatterings == 0 && m_options.effects.singleScattering);
  }

  // Flights whose collision stands for all that they have: the first and, where that passes thin
  // smoke, the second, without which little light would ever be found that scatters twice. Not
  // where the smoke shines: the light of a flight is what lies before a real collision.
  bool isForced(int scatterings, const Rgb& transmittance) const {
    constexpr float kThin = 0.5f;
    if (m_emission) return false;
    return scatterings == 0 || (scatterings == 1 && maxComponent(transmittance) > kThin);
  }

  float lengthOf(const Segment& segment) const {
    return segment.length < kInfinity
               ? segment.length
               : transport::exitDistance(m_medium, segment.origin, segment.direction);
  }

  static RayRadiance capped(const RayRadiance& result, const Rgb& throughput,
                            IntegratorCounters& counters) {
    ++counters.capped;
    counters.cappedRadiance += static_cast<double>(meanComponent(throughput));
    return result;
  }

  // Distance of what the eye meets first, weighted by what a channel meets there on the mean.
  // `throughput` is as of collisions at the rate of `extinction`.
  void addDepth(RayRadiance& result, const Rgb& throughput, float distance, const Vec3f& p,
                float extinction, When when) const {
    float met = meanComponent(throughput);
    if constexpr (!std::is_same_v<Light, float>)
      met = meanComponent(throughput * m_medium.channels(p, extinction, when)) / extinction;
    result.depth += met * distance;
    result.opacity += met;
  }

  static void add(RayRadiance& result, const Rgb& value, int scatterings) {
    (scatterings == 1 ? result.single : result.multiple) += value;
  }

  // Light that the smoke gives off along the flight: the `emission` layer where the eye sees it,
  // else scattered at least once, which is `multiple` (`single` is the lamps').
  void addEmission(RayRadiance& result, const Rgb& throughput, const Segment& flight,
                   const Collision& hit, int scatterings, Rng& rng, When when) const {
    const float length = hit.happened() ? hit.distance : flight.length;
    (scatterings == 0 ? result.emission : result.multiple) +=
        throughput * transport::sampleEmission(m_medium, *m_emission, flight.origin,
                                               flight.direction, length, rng, when);
  }

  // Light that the path meets by leaving the smoke after this many scatterings.
  void addEscape(RayRadiance& result, const Rgb& throughput, const Vec3f& d,
                 int scatterings) const {
    for (const lights::Light* light : scatterings == 0 ? m_backgrounds : m_escaped) {
      const Rgb value = throughput * light->background(d);
      if (scatterings == 0)
        result.background += value;
      else
        add(result, value, scatterings);
    }
  }

  // Light of one lamp, chosen by power (of many, by what they send here), that scatters here toward
  // the eye.
  void addNextEvent(RayRadiance& result, const Rgb& throughput, const Vec3f& p, const Vec3f& d,
                    int scatterings, Rng& rng, IntegratorCounters& counters, When when) const {
    if (m_sampled.empty()) return;
    std::size_t i = 0;
    double probability = 1.0;
    if (m_choice) {
      const LampChoice::Drawn drawn = m_choice->at(p, rng.uniformDouble());
      if (!(drawn.probability > 0.0f)) return;
      i = drawn.lamp;
      probability = static_cast<double>(drawn.probability);
    } else if (m_sampled.size() > 1) {
      const double u = rng.uniformDouble();
      i = static_cast<std::size_t>(std::upper_bound(m_cumulative.begin(), m_cumulative.end(), u) -
                                   m_cumulative.begin());
      i = std::min(i, m_sampled.size() - 1);
      probability = m_cumulative[i] - (i ? m_cumulative[i - 1] : 0.0);
    }
    const lights::Light& light = *m_sampled[i];
    float share = 1.0f / static_cast<float>(probability);
    if (m_near) share *= m_near->lamps()[i].shareOfCollisions(p);
    if (share > 0.0f)
      addLamp(result, throughput * share, light, p, d, scatterings, rng, counters, when);
  }

  // Light of one lamp that scatters at `p` toward the eye.
  void addLamp(RayRadiance& result, const Rgb& throughput, const lights::Light& light,
               const Vec3f& p, const Vec3f& d, int scatterings, Rng& rng,
               IntegratorCounters& counters, When when) const {
    const Vec2f u = light.isDelta() ? Vec2f(0.5f) : rng.uniform2();
    const lights::Illumination in = light.illuminate(p, u);
    if (!(maxComponent(in.irradiance) > 0.0f)) return;
    const Rgb scattered = transport::phaseAlbedo(m_medium, p, in.direction, -d, when);
    // The switch is of single scattering alone.
    const Light transmittance =
        m_options.effects.shadows || scatterings > 0
            ? transport::trackTransmittance<Light>(m_medium, p, -in.direction, in.distance, rng,
                                                   counters.tracking, when)
            : Light(1.0f);
    add(result, throughput * scattered * in.irradiance * transmittance, scatterings + 1);
  }

  // Light of lamps near by that scatters along a flight toward the eye, where it is drawn for them.
  void addNearLamps(RayRadiance& result, const Rgb& throughput, const Segment& flight,
                    int scatterings, Rng& rng, IntegratorCounters& counters, When when) const {
    if (!m_near || m_near->none()) return;
    const float length = lengthOf(flight);
    for (std::size_t i = 0; i < m_sampled.size(); ++i) {
      const NearLamps::Lamp& lamp = m_near->lamps()[i];
      if (!(lamp.radius > 0.0f)) continue;
      const auto drawn =
          NearLamps::draw(lamp, flight.origin, flight.direction, length, rng.uniform());
      if (!drawn || !(drawn->weight > 0.0f)) continue;
      const Vec3f p = flight.origin + flight.direction * drawn->distance;
      const float extinction = m_medium.extinction(p, when);
      if (!(extinction > 0.0f)) continue;
      const float reached =
          transport::trackSurvivalOf(throughput, m_medium, flight.origin, flight.direction,
                                     drawn->distance, rng, counters.tracking, when);
      if (!(reached > 0.0f)) continue;
      addLamp(result, throughput * (reached * extinction * drawn->weight), *m_sampled[i], p,
              flight.direction, scatterings, rng, counters, when);
    }
  }

  const Medium& m_medium;
  PathOptions m_options;
  const transport::Emission* m_emission;            // nullptr where there is none
  std::vector<const lights::Light*> m_backgrounds;  // what unscattered rays meet
  std::vector<const lights::Light*> m_sampled;      // lamps of next-event estimation
  std::vector<const lights::Light*> m_escaped;      // what scattered rays meet by leaving
  std::vector<double> m_cumulative;
  std::optional<LampChoice> m_choice;  // of many lamps
  std::optional<NearLamps> m_near;     // unless there are many
};

}  // namespace

std::unique_ptr<Integrator> makePathIntegrator(const Medium& medium,
                                               const transport::LightList& lights,
                                               const PathOptions& options) {
  return makeFor(medium, [&]<class Light, class When>(Light, When) -> std::unique_ptr<Integrator> {
    return std::make_unique<PathIntegrator<Light, When>>(medium, lights, options);
  });
}

}  // namespace photosphere::render
