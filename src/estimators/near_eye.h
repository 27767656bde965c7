#pragma once
// Light around an eye in smoke. A carrier is seen from one direction only where it is far from the
// eye: those next to it are seen from many, so that one colour for each is the mean over them, and
// light that a lobe sends to the eye is too dim by up to 0.6. Within a few light voxels of the eye
// directions are kept, therefore, and read toward every ray.

#include <memory>
#include <optional>

#include "photosphere/estimators/light_field.h"

namespace photosphere::estimators {

/// Whether directions around the eye are gathered besides, on voxels (LightField::near).
bool gathersNearEye(const transport::Medium& medium, const LightFieldLayout& layout,
                    const View& view);

/// Numbers of the voxels of `lattice` that readings near the eye ask for, in their order.
std::vector<std::size_t> voxelsNearEye(const transport::SupportLattice& lattice,
                                       const LightFieldLayout& layout, const View& view);

/// Those voxels, one or more, of a lattice as one of their own, no wider than they need.
transport::SupportLattice partOf(const transport::SupportLattice& lattice,
                                 const std::vector<std::size_t>& voxels);

/// The light to read near the eye: LightField::near, or the part of the field around the eye where
/// that keeps directions. Nothing where `readsNearEye` is false.
/// @param field  LightField::near is moved from where no other field has it
std::optional<LightField> nearField(const transport::Medium& medium, LightField& field,
                                    const View& view);

/// Reads `near` up to `radius` [m] from the eye, `far` beyond.
std::unique_ptr<InscatterSource> joinAtEye(std::unique_ptr<InscatterSource> far,
                                           std::unique_ptr<InscatterSource> near, const Vec3f& eye,
                                           double radius);

/// Hands on all flights, and to a second sink those that pass near the eye.
class NearEyeSink final : public transport::FlightSink {
 public:
  /// @param lattice  where the second sink has voxels
  NearEyeSink(transport::FlightSink& all, transport::FlightSink& near,
              const transport::SupportLattice& lattice, const Vec3d& eye);
  void consume(std::span<const transport::Flight> flights) override;

 private:
  transport::FlightSink& m_all;
  transport::FlightSink& m_near;
  Vec3f m_eye;
  float m_reach;  // [m]
};

}  // namespace photosphere::estimators
