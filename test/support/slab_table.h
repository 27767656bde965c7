#pragma once
// Reference values of plane-parallel slabs (data/reference/slab.csv).

#include <string>
#include <vector>

#include "photosphere/transport/medium.h"

namespace photosphere::test {

struct SlabRow {
  std::string illumination;  ///< beam or diffuse
  double tau = 0, albedo = 0, g = 0;
  std::string quantity;  ///< R, T_total, L_top ...
  double at = 0;         ///< mu or depth fraction
  double value = 0;
};

const std::vector<SlabRow>& slabTable();
/// The value of a row. Fails the test when there is none.
double slabValue(const std::string& illumination, double tau, double albedo, double g,
                 const std::string& quantity);

/// A slab of extinction 1 in the plane z = -tau/2 .. tau/2, wide enough that its sides do not
/// matter.
transport::Medium slabMedium(double tau, double albedo, double g);

}  // namespace photosphere::test
