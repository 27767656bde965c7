#pragma once
// Small frames of media with known structure, by path tracing and by the photosphere.

#include <memory>

#include "photosphere/estimators/light_field.h"
#include "photosphere/estimators/photon_map.h"
#include "photosphere/image/metrics.h"
#include "photosphere/render/frame.h"
#include "support/media.h"

namespace photosphere::test {

/// Smoke, lamps and a camera in metres about the origin.
struct TestScene {
  std::unique_ptr<transport::Medium> medium;
  transport::LightList lights;
  std::unique_ptr<cameras::Camera> camera;
  std::vector<Vec3f> particles;  ///< carriers, where a test asks for them

  estimators::View view() const;
};

/// Camera at `eye` that looks at the origin, z up, horizontal field of view in degrees.
std::unique_ptr<cameras::Camera> perspectiveCamera(const Vec3d& eye, double fov, int pixels);

/// Homogeneous sphere of optical depth `tau` across, radius 0.5, lit by a spot from the side.
TestScene sphereScene(double tau, double albedo, double g, int cells, int pixels);
/// Fractal plume in a unit cube, lit by a spot from above and the side.
TestScene plumeScene(double g, int cells, int pixels);
/// The same lamp and camera over other smoke in a unit cube.
TestScene plumeScene(transport::MediumVolume smoke, int pixels);

/// Particles spread over the smoke in proportion to its extinction, as `convert` seeds them.
std::vector<Vec3f> seedParticles(const transport::Medium& medium, std::size_t count);

/// A frame rendered by path tracing.
render::FrameLayers renderPath(const TestScene& scene, int samples, std::uint64_t seed);

/// Error of one layer against the mean of two independent references, noise subtracted.
struct LayerError {
  double relMse = 0, relMseSmoke = 0, meanRatio = 0, referenceNoise = 0;
};

/// What path tracing gives, in two independent halves.
struct Truth {
  using Layer = std::vector<Rgb> render::FrameLayers::*;
  LayerError errorOf(const render::FrameLayers& frame, Layer layer) const;

  render::FrameLayers a, b;
};
/// @param samples  paths a pixel of each half
Truth pathTruth(const TestScene& scene, int samples, std::uint64_t firstSeed = 1);

struct PhotosphereFrame {
  render::FrameLayers layers;
  transport::TraceStatistics statistics;
  double traceSeconds = 0, resolveSeconds = 0, marchSeconds = 0;
  double negativeShare = 0;
};
/// A frame rendered by the photosphere; layout.radius 0 = automatic.
/// @param gatherRays  final gathering, rays of each camera sample
PhotosphereFrame renderPhotosphere(const TestScene& scene, estimators::LightFieldLayout layout,
                                   std::uint64_t photons, std::uint64_t seed, int samples = 4,
                                   int gatherRays = 0);

/// A frame rendered by a photon map of one pass; layout.radius 0 = automatic. Tracing and building
/// the map count as `traceSeconds`.
PhotosphereFrame renderPhotonMap(const TestScene& scene, estimators::PhotonMapLayout layout,
                                 std::uint64_t photons, std::uint64_t seed, int samples = 4);

/// Mean of an image, and how far the worst square block's mean is from 1: what a furnace is judged
/// by.
struct BlockDeviation {
  double mean = 0, worst = 0;
};
BlockDeviation deviationFromOne(const std::vector<Rgb>& image, int width, int block);

}  // namespace photosphere::test
