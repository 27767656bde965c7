#include "resume.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <sstream>

#include "number_check.h"
#include "photosphere/core/error.h"
#include "photosphere/core/frames.h"
#include "photosphere/core/log.h"
#include "photosphere/core/output_file.h"

namespace photosphere::cli {

namespace {

Resume parseWhen(const std::string& when) {
  if (when == "never") return Resume::never;
  return when == "require" ? Resume::require : Resume::automatic;
}

}  // namespace

void addResumeOptions(CLI::App& app, ResumeOptions& options) {
  const char* group = "Interruption";
  app.add_option("--resume", options.when,
                 "Go on from the checkpoint OUTPUT.checkpoint that an interrupted run left: auto "
                 "(where there is one), never, require [auto]")
      ->check(CLI::IsMember(std::vector<std::string>{"auto", "never", "require"}).description(""))
      ->type_name("WHEN")
      ->group(group);
  app.add_option("--checkpoint-interval", options.interval,
                 "Seconds between checkpoints of a frame under way [60]")
      ->check(finiteNumber({.least = 0.1, .most = 1e9}))
      ->type_name("S")
      ->group(group);
}

ResumableJob::ResumableJob(const ResumeOptions& options, std::string identity,
                           const std::vector<std::int64_t>& frames, OfFrame outputOf,
                           OfFrame inputsOf, OfFrame madeOf)
    : m_options(options),
      m_when(parseWhen(options.when)),
      m_identity(std::move(identity)),
      m_frames(frames),
      m_outputOf(std::move(outputOf)),
      m_inputsOf(std::move(inputsOf)),
      m_madeOf(std::move(madeOf)) {
  if (m_when == Resume::never) return;
  bool any = false;
  for (const std::int64_t frame : frames) {
    const auto folder = Checkpoint::folderOf(m_outputOf(frame));
    if (!Checkpoint::isIn(folder)) continue;
    any = true;
    if (const auto note = Checkpoint::note(folder)) readNote(*note);
  }
  if (m_when == Resume::require && !any)
    throw InputMissingError(
        Checkpoint::folderOf(m_outputOf(frames.empty() ? 1 : frames.front())).string(),
        "there is no checkpoint to go on from; leave --resume require out to start anew");
}

// The job, then a line for each finished frame: what it was made from, what it left, and whether it
// missed its target.
std::string ResumableJob::note() const {
  std::string text = m_identity + '\n';
  for (const auto& [frame, files] : m_finished)
    text += fmt::format("{} {} {}\n", frame, files, m_missed.count(frame));
  return text;
}

void ResumableJob::readNote(const std::string& note) {
  std::istringstream lines(note);
  std::string identity, inputs, made;
  std::getline(lines, identity);
  if (identity != m_identity) return;
  const std::set<std::int64_t> ours(m_frames.begin(), m_frames.end());
  std::int64_t frame = 0;
  int missed = 0;
  while (lines >> frame >> inputs >> made >> missed) {
    if (ours.count(frame) == 0) continue;
    const bool same = inputs == m_inputsOf(frame);
    if (!same || made != m_madeOf(frame)) {
      log::info("frame {}: {} has changed since the interruption", frame,
                same ? "a file that it had left" : "what it is made from");
      continue;
    }
    m_finished[frame] = inputs + ' ' + made;
    if (missed) m_missed.insert(frame);
  }
}

Checkpoint& ResumableJob::begin(std::int64_t frame) {
  m_inputs = m_inputsOf(frame);
  m_current.emplace(Checkpoint::folderOf(m_outputOf(frame)), m_options.interval, m_when);
  if (!m_finished.empty()) m_current->noteAlong(note());
  return *m_current;
}

void ResumableJob::finished(std::int64_t frame, bool missed) {
  m_finished[frame] = m_inputs + ' ' + m_madeOf(frame);
  if (missed) m_missed.insert(frame);
  if (m_current) m_current->discard();
  m_current.reset();
}

void ResumableJob::keepFinished() {
  if (m_finished.empty()) return;
  if (!m_current) {
    const auto next = std::find_if(m_frames.begin(), m_frames.end(), [&](std::int64_t frame) {
      return m_finished.count(frame) == 0;
    });
    if (next == m_frames.end()) return;
    begin(*next);
  }
  m_current->saveNote();
}

int ResumableJob::run(const std::function<int()>& body) {
  try {
    return body();
  } catch (const InterruptedError& stopped) {
    removeTemporaries();
    try {
      keepFinished();
    } catch (const OutputError& error) {
      log::warning("no checkpoint: {}", error.what());
    }
    if (m_current && m_current->exists())
      log::error("{}; run the same command again to go on from {}", stopped.what(),
                 m_current->folder().string());
    else
      log::error("{} before there was anything to keep; run the same command again",
                 stopped.what());
    return static_cast<int>(ExitCode::interruptedResumable);
  }
}

}  // namespace photosphere::cli
