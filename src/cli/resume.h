#pragma once
// Jobs over frames that can be interrupted and go on: --resume, --checkpoint-interval, exit 75.

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "photosphere/core/checkpoint.h"

namespace CLI {
class App;
}

namespace photosphere::cli {

struct ResumeOptions {
  std::string when = "auto";
  double interval = 60;  ///< between periodic checkpoints [s]
};

void addResumeOptions(CLI::App& app, ResumeOptions& options);

/// The checkpoints of a job, one beside the output of the frame under way. It also holds which
/// frames the job had finished, so that the same command goes on where it was stopped.
class ResumableJob {
 public:
  using OfFrame = std::function<std::string(std::int64_t)>;

  /// @param identity  of the job: scene and options, on one line; finished frames of another job
  ///                  are made again
  /// @param inputsOf  says what a frame is made from, in one word, and
  /// @param madeOf    what it has left: where either is no longer the same, a finished frame is
  ///                  made again
  /// @throws InputMissingError (require) when no output of these frames has a checkpoint
  ResumableJob(const ResumeOptions& options, std::string identity,
               const std::vector<std::int64_t>& frames, OfFrame outputOf, OfFrame inputsOf,
               OfFrame madeOf);

  /// True when the interrupted run had finished this frame, from what it would be made from now,
  /// and what it left is still there; asked before the frame begins.
  bool hadFinished(std::int64_t frame) const { return m_finished.count(frame) != 0; }
  /// Begins a frame. The checkpoint is the job's.
  Checkpoint& begin(std::int64_t frame);
  /// The frame is on disk: its checkpoint is removed. @param missed  it has not reached its target
  void finished(std::int64_t frame, bool missed = false);
  /// Whether a frame missed its target, before the interruption or since.
  bool missed() const { return !m_missed.empty(); }

  /// Runs the job. @return its exit code, or 75 after an interruption, of which the user is told
  int run(const std::function<int()>& body);

 private:
  void keepFinished();
  std::string note() const;
  void readNote(const std::string& note);

  ResumeOptions m_options;
  Resume m_when;
  std::string m_identity;
  std::vector<std::int64_t> m_frames;
  OfFrame m_outputOf, m_inputsOf, m_madeOf;
  std::set<std::int64_t> m_missed;
  std::map<std::int64_t, std::string> m_finished;  // what they were made from, what they left
  std::string m_inputs;                            // of the frame under way
  std::optional<Checkpoint> m_current;
};

}  // namespace photosphere::cli
