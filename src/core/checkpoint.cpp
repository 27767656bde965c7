#include "photosphere/core/checkpoint.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <utility>

#include "photosphere/core/error.h"
#include "photosphere/core/hash.h"
#include "photosphere/core/interrupt.h"
#include "photosphere/core/log.h"
#include "photosphere/core/output_file.h"

namespace photosphere {

namespace fs = std::filesystem;

namespace {

constexpr std::string_view kMagic = "photosphere checkpoint 1\n";
constexpr const char* kNoteFile = "job";
// Saving takes at most this part of the time.
constexpr double kSavingShare = 0.05;

std::uint64_t hashOf(std::string_view bytes) {
  Hasher hasher;
  hasher.bytes(bytes.data(), bytes.size());
  return hasher.value();
}

// Magic, size and hash of what follows; then the work's name and the part itself.
constexpr std::size_t kHead = kMagic.size() + 2 * sizeof(std::uint64_t);

std::string sealed(std::string_view work, const WriteState& write) {
  StateWriter state{std::string(kHead, '\0')};
  state.text(work);
  write(state);
  std::string bytes = state.take();
  const std::uint64_t size = bytes.size() - kHead;
  const std::uint64_t hash = hashOf(std::string_view(bytes).substr(kHead));
  std::memcpy(bytes.data(), kMagic.data(), kMagic.size());
  std::memcpy(bytes.data() + kMagic.size(), &size, sizeof size);
  std::memcpy(bytes.data() + kMagic.size() + sizeof size, &hash, sizeof hash);
  return bytes;
}

// What `sealed` holds, or nothing where it is hurt.
std::optional<std::string> unsealed(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) return std::nullopt;
  std::string head(kHead, '\0');
  if (!in.read(head.data(), static_cast<std::streamsize>(kHead)) || !head.starts_with(kMagic))
    return std::nullopt;
  std::uint64_t size = 0, hash = 0;
  std::memcpy(&size, head.data() + kMagic.size(), 8);
  std::memcpy(&hash, head.data() + kMagic.size() + 8, 8);
  std::error_code error;
  if (fs::file_size(path, error) != size + kHead || error) return std::nullopt;
  std::string content(static_cast<std::size_t>(size), '\0');
  if (!in.read(content.data(), static_cast<std::streamsize>(size)) || hashOf(content) != hash)
    return std::nullopt;
  return content;
}

}  // namespace

void StateReader::fail() const {
  throw InputError(m_file, "is no checkpoint of this version; remove it, or use --resume never");
}

const char* StateReader::take(std::uint64_t count, std::size_t size) {
  const std::size_t left = m_bytes.size() - m_at;
  if (count > left / size) fail();
  const char* at = m_bytes.data() + m_at;
  m_at += static_cast<std::size_t>(count) * size;
  return at;
}

fs::path Checkpoint::folderOf(const fs::path& output) {
  fs::path folder = output;
  folder += ".checkpoint";
  return folder;
}

Checkpoint::Checkpoint(fs::path folder, double interval, Resume resume)
    : m_folder(std::move(folder)), m_interval(interval), m_resume(resume) {
  if (m_resume == Resume::never) drop();
}

fs::path Checkpoint::fileOf(const std::string& part) const {
  return m_folder / part;
}

void Checkpoint::drop() {
  std::error_code ignored;
  fs::remove_all(m_folder, ignored);
}

void Checkpoint::identify(const std::string& work) {
  m_work = work;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(m_folder, error)) {
    if (entry.path().filename() == kNoteFile) continue;
    // Left by a run that was killed while it wrote.
    if (entry.path().filename().string().starts_with('.')) {
      fs::remove(entry.path(), error);
      continue;
    }
    const std::optional<std::string> content = unsealed(entry.path());
    std::string why;
    if (!content)
      why = "is damaged";
    else if (StateReader(entry.path().string(), *content).text() != m_work)
      why = "belongs to other work (scene, smoke, lights, options or version differ)";
    else
      continue;
    if (m_resume == Resume::require)
      throw InputError(entry.path().string(), why + "; use --resume never to start anew");
    log::warning("{} {}: not gone on from", entry.path().string(), why);
    fs::remove(entry.path(), error);
  }
}

std::optional<StateReader> Checkpoint::load(const std::string& part) {
  const fs::path path = fileOf(part);
  std::optional<std::string> content = unsealed(path);
  if (!content) return std::nullopt;
  StateReader reader(path.string(), std::move(*content));
  if (reader.text() != m_work) return std::nullopt;
  return reader;
}

void Checkpoint::offer(const std::string& part, const WriteState& write) {
  const double waited = std::chrono::duration<double>(Clock::now() - m_last).count();
  if (pendingSignal() != 0 || waited >= std::max(m_interval, m_saveSeconds / kSavingShare))
    save(part, write);
  if (pendingSignal() != 0) throw InterruptedError(pendingSignal());
}

void Checkpoint::save(const std::string& part, const WriteState& write) {
  const Clock::time_point start = Clock::now();
  try {
    saveNote();
    writeFile(fileOf(part), sealed(m_work, write));
  } catch (const OutputError& error) {
    if (!std::exchange(m_warned, true)) log::warning("no checkpoint: {}", error.what());
  }
  m_last = Clock::now();
  m_saveSeconds = std::chrono::duration<double>(m_last - start).count();
}

void Checkpoint::saveNote() {
  if (m_note.empty() || m_noteKept) return;
  writeFile(fileOf(kNoteFile), sealed("", [&](StateWriter& w) { w.text(m_note); }));
  m_noteKept = true;
}

std::optional<std::string> Checkpoint::note(const fs::path& folder) {
  const fs::path path = folder / kNoteFile;
  std::optional<std::string> content = unsealed(path);
  if (!content) return std::nullopt;
  StateReader reader(path.string(), std::move(*content));
  reader.text();  // the name of no work
  return reader.text();
}

bool Checkpoint::exists() const {
  std::error_code error;
  return fs::is_directory(m_folder, error);
}

void Checkpoint::discard() {
  drop();
}

}  // namespace photosphere
