#include "resume.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>

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

// Frames that a job of that identity had finished, from what its checkpoint says.
std::vector<std::int64_t> finishedFrames(const std::string& note, const std::string& identity) {
  const std::size_t line = note.find('\n');
  if (line == std::string::npos || note.substr(0, line) != identity) return {};
  try {
    return parseFrames(note.substr(line + 1));
  } catch (const ConfigError&) {
    return {};
  }
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
      ->check(CLI::Range(0.1, 1e9).description(""))
      ->type_name("S")
      ->group(group);
}

ResumableJob::ResumableJob(const ResumeOptions& options, std::string identity,
                           const std::vector<std::int64_t>& frames, OutputOf outputOf)
    : m_options(options),
      m_when(parseWhen(options.when)),
      m_identity(std::move(identity)),
      m_frames(frames),
      m_outputOf(std::move(outputOf)) {
  if (m_when == Resume::never) return;
  bool any = false;
  for (const std::int64_t frame : frames) {
    const auto folder = Checkpoint::folderOf(m_outputOf(frame));
    std::error_code error;
    if (!std::filesystem::is_directory(folder, error)) continue;
    any = true;
    if (const auto note = Checkpoint::note(folder))
      for (const std::int64_t done : finishedFrames(*note, m_identity))
        m_earlier.insert(done);
  }
  if (m_when == Resume::require && !any)
    throw InputMissingError(
        Checkpoint::folderOf(m_outputOf(frames.empty() ? 1 : frames.front())).string(),
        "there is no checkpoint to go on from; leave --resume require out to start anew");
  m_finished = m_earlier;
}

Checkpoint& ResumableJob::begin(std::int64_t frame) {
  m_current.emplace(Checkpoint::folderOf(m_outputOf(frame)), m_options.interval, m_when);
  if (!m_finished.empty())
    m_current->noteAlong(
        m_identity + '\n' +
        formatFrames(std::vector<std::int64_t>(m_finished.begin(), m_finished.end())));
  return *m_current;
}

void ResumableJob::finished(std::int64_t frame) {
  m_finished.insert(frame);
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
