#pragma once
// The catalogue of hard cases as its files say it (data/hard/*.toml, described in its README.md).

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace photosphere::study {

/// What a generator of smoke is told.
struct SmokeSpec {
  std::map<std::string, std::vector<double>> numbers;
  std::map<std::string, std::string> texts;

  double number(const std::string& name, double fallback) const;
  std::vector<double> list(const std::string& name, const std::vector<double>& fallback = {}) const;
  std::string text(const std::string& name, const std::string& fallback = {}) const;
  /// Names the smoke: equal specs, equal keys.
  std::string key() const;
};

struct StabilityOracle {
  std::string kind;              ///< finer, path, same, value, zero, error; of traces: see README
  std::string source;            ///< for people: where the value comes from
  double value = 0, scale = 1;   ///< of `value`; of `same`: factor on the other picture
  double least = 0;              ///< of `below`: what the mean must reach
  int code = 0;                  ///< of `error`: exit code
  std::string message;           ///< of `error`: what it must say
  int samples = 0;               ///< paths a pixel: of `path`, 0 = 2048; of `finer`, of a truth
                                 ///< that is told beside, 0 = none
  SmokeSpec smoke;               ///< of `same`
  bool ownSmoke = false;         ///< `smoke` was given
  bool bare = false;             ///< of `same`: without the case's own settings
  std::vector<std::string> set;  ///< settings of the run that is held against
};

struct StabilityCase {
  std::string name, hard;
  std::string kind;   ///< name of its file without the number in front
  std::string trace;  ///< empty = a frame is rendered; else what is done instead
  SmokeSpec slab;     ///< of `trace`: tau, albedo, g, photons
  SmokeSpec smoke;
  std::vector<std::string> set, quickSet;                ///< `quickSet`: more of the small size
  std::vector<std::string> estimators, quickEstimators;  ///< empty = all, as `estimators`
  bool quick = true;                                     ///< in the small size, too
  std::string layer = "beauty";
  std::string metric = "blocks";
  int block = 8;      ///< edge of the blocks [pixels]
  int seeds = 1;      ///< frames whose mean is the result
  int lights = 0;     ///< lamps that share the base's light; 0 = as the scene has
  double spread = 0;  ///< edge of the cube about its place that they stand in [scene units]
  bool allowInvalid = false;
  std::vector<int> crop;
  std::string says;    ///< what a note must say
  std::string writes;  ///< `float` or `half`: what the file must hold
  StabilityOracle oracle;
  double bound = 0.2, quickBound = 0;
  std::map<std::string, double> bounds;  ///< of estimators that have one of their own

  double boundOf(const std::string& estimator, bool small) const {
    const auto own = bounds.find(estimator);
    return own != bounds.end() ? own->second : small ? quickBound : bound;
  }
};

/// A way to render that every case is tried with.
struct StabilityEstimator {
  std::string name;
  std::vector<std::string> set;
  std::vector<std::string> truth;  ///< settings of path tracing that has the same answer
  bool always = true;              ///< false = only in cases that name it
  bool quick = true;  ///< false = in the small size, only where `quick_estimators` name it
};

struct StabilityCatalogue {
  std::filesystem::path folder;
  std::string scene;  ///< text of base.toml
  std::vector<StabilityEstimator> estimators;
  std::vector<StabilityCase> cases;
};

/// @throws ConfigError naming file and line; InputMissingError
StabilityCatalogue readStabilityCatalogue(const std::filesystem::path& folder);

/// data/hard: in $PHOTOSPHERE_DATA, beside the tool, or in the source tree.
/// @throws InputMissingError
std::filesystem::path shippedStabilityCatalogue();

}  // namespace photosphere::study
