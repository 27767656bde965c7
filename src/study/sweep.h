#pragma once
// One scene swept: contenders timed in turns, a reference good enough for the best of them, errors.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "child.h"
#include "contenders.h"
#include "photosphere/core/resources.h"
#include "reference.h"

namespace photosphere::study {

struct SweepPlan {
  SceneSource scene;
  std::int64_t frame = 1;
  std::string name, description;
  SweepSize size;
  int seeds = 5;  ///< at least 3
  std::vector<std::string> particleSets;
  std::filesystem::path cacheFolder;  ///< references stay here
  std::filesystem::path runFolder;    ///< frames of the contenders, until they are evaluated
  std::string referenceName;          ///< begins the reference's file name
  int chunk = 64;                     ///< paths a pixel of each half of a pair
  double measureSeconds = 0;          ///< budget for the contenders
  double referenceSeconds = 0;        ///< budget for the reference; two pairs come in any case
};

/// Runs a plan in order: measure, refine, evaluate.
class Sweep {
 public:
  explicit Sweep(SweepPlan plan);

  /// Every contender once per seed, order alternating, until the budget ends.
  void measure();
  /// Grows the reference until its noise is a tenth of the best contender's error in both layers,
  /// or its budget ends.
  void refine();
  /// Errors against the reference.
  SweepResult evaluate() const;

 private:
  struct Entry {
    Contender contender;
    scene::SceneFile scene;
    std::vector<RenderOutcome> runs;
    std::vector<std::filesystem::path> images;
    bool dropped = false;
  };

  void measureFirst(const Stopwatch& watch);
  void tryOut(Entry& entry);
  bool affordable(const Entry& entry, double elapsed, double& predicted) const;
  double secondsOfRound() const;
  void run(Entry& entry, int seed);
  void leaveOut(Entry& entry, const std::string& why);
  /// Least relMSE of a contender's first frame, [layer], over all pixels.
  std::array<double, 2> bestErrors() const;

  /// Times its paths that the reference needs. @param best  of bestErrors
  double stillNeeded(const std::array<double, 2>& best) const;
  /// relMSE of the reference's noise as the spread of path traced frames foretells it, [layer].
  std::array<double, 2> pathNoise() const;
  bool strongest(const Entry& entry) const;
  PointResult evaluate(const Entry& entry,
                       const std::optional<std::vector<unsigned char>>& smoke) const;

  SweepPlan m_plan;
  scene::SceneFile m_base;
  SceneFacts m_facts;
  std::vector<Entry> m_entries;
  std::vector<LeftOut> m_leftOut;
  std::optional<ReferenceMaker> m_reference;
  bool m_quiet = false, m_settled = false;
  std::uint64_t m_startMemory = 0;
};

}  // namespace photosphere::study
