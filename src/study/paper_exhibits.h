#pragma once
// The table of the paper's exhibits: what is rendered for each, and what the paper gives.

#include <string>
#include <vector>

namespace photosphere::study {

/// How the bytes of stored light are found, where they are what is compared.
enum class StoredLight {
  none,
  forecast,  ///< as the scene foretells it
  photons,   ///< of a photon map that stores `photonsStored`
};

/// One frame of an exhibit.
struct PaperFrame {
  std::string label;
  std::string smoke;  ///< file stem in data/studies
  int frame = 0;
  double g = 0;                   ///< of its phase function
  std::vector<std::string> sets;  ///< of the estimator
  double paperValue = 0;          ///< [s], or [bytes] for the memory comparison; 0 = none
  std::uint64_t particles = 60'000;
  StoredLight stored = StoredLight::none;
  std::uint64_t photonsStored = 0;
};

struct ExhibitPlan {
  std::string name, title, said, differs, unit;
  bool pictures = false;
  std::vector<PaperFrame> frames;
};

/// Tables 1 and 2, figures 11 to 16 and the memory comparison of section 4.1.3.
/// @param photons  of every frame that does not vary them; the paper does not say
std::vector<ExhibitPlan> paperExhibits(std::int64_t photons);

}  // namespace photosphere::study
