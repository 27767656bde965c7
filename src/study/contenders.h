#pragma once
// The table of contenders: families of settings, each at several amounts of work.

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "photosphere/study/result.h"
#include "scene_source.h"

namespace photosphere::study {

/// What makes one contender of a family better and slower.
enum class Work { photons, samples, gatherRays, errorTarget, none };

/// Settings that are swept together. An estimator or option that this version does not serve drops
/// out by itself: the scene refuses it.
struct Family {
  std::string_view name;   ///< in CSV and JSON
  std::string_view title;  ///< for people
  std::vector<std::string> sets;
  Work work = Work::photons;
  bool needsParticles = false;
  bool byNameAlone = false;  ///< no part of a sweep over all families
};

const std::vector<Family>& families();
/// The title of a family, or its name. @param name  of CSV and JSON
std::string familyTitle(const std::string& name);

/// One setting to run.
struct Contender {
  const Family* family = nullptr;
  int level = 0;
  std::int64_t work = 0;  ///< photons, samples or rays a pixel, or 1 over the error asked for
  std::vector<std::string> sets;
  std::string label;  ///< "photosphere, 32 bins, 256k photons"
};

/// How far a sweep goes.
struct SweepSize {
  std::vector<std::int64_t> photons, samples, targets;  ///< of the levels
  std::vector<std::string> families;                    ///< names; empty = all

  static SweepSize full();
  static SweepSize quick();
  /// For the hard cases: fewer families and levels.
  static SweepSize hardCase(bool quick);
  /// For the comparison of bases: one amount of work for each.
  static SweepSize bases(bool quick);
};

/// Every contender that the scene accepts, level by level.
/// @param particleSets  overrides that give carriers of `particles` something to stand on
/// @param leftOut       receives families that the scene refuses, and why
/// @throws ConfigError for a family name that is not in the table
std::vector<Contender> contenders(const SceneSource& scene, const SweepSize& size,
                                  const std::vector<std::string>& particleSets,
                                  std::vector<LeftOut>& leftOut);

/// Overrides that take every key of [estimator] that the scene gives back to its default, and its
/// target error and time limit away, so that contenders differ by their own settings alone and
/// nothing ends a reference early.
std::vector<std::string> neutralSettings(const scene::SceneFile& scene);

/// "16k", "1.0M".
std::string formatCount(std::int64_t count);

}  // namespace photosphere::study
