#include "photosphere/core/checkpoint.h"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>
#include <vector>

#include "photosphere/core/checksums.h"
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

// After the magic: size and hash of what follows, which is the work's name and the part itself.
constexpr std::size_t kHead = kMagic.size() + 2 * sizeof(std::uint64_t);
constexpr std::size_t kBlock = 1 << 20;  // that is hashed at once

// Writes block by block: what is kept may be most of the memory.
class FileWriter final : public StateWriter {
 public:
  explicit FileWriter(const fs::path& path) : m_out(path, std::ios::binary | std::ios::trunc) {
    m_out.exceptions(std::ios::badbit | std::ios::failbit);
    m_out << std::string(kHead, '\0');
  }
  void close() {
    flush();
    m_out.seekp(0);
    m_out << kMagic;
    const std::uint64_t hash = m_hasher.value();
    m_out.write(reinterpret_cast<const char*>(&m_size), sizeof m_size);
    m_out.write(reinterpret_cast<const char*>(&hash), sizeof hash);
    m_out.close();
  }

 private:
  void put(const void* data, std::size_t size) override {
    const char* from = static_cast<const char*>(data);
    while (size > 0) {
      const std::size_t n = std::min(size, kBlock - m_block.size());
      m_block.append(from, n);
      from += n;
      size -= n;
      if (m_block.size() == kBlock) flush();
    }
  }
  void flush() {
    m_hasher.bytes(m_block.data(), m_block.size());
    m_out.write(m_block.data(), static_cast<std::streamsize>(m_block.size()));
    m_size += m_block.size();
    m_block.clear();
  }

  std::ofstream m_out;
  std::string m_block;
  Hasher m_hasher;
  std::uint64_t m_size = 0;
};

void writeSealed(const fs::path& path, std::string_view work, const WriteState& write) {
  OutputFile file(path);
  errno = 0;
  try {
    FileWriter out(file.temporaryPath());
    out.text(work);
    write(out);
    out.close();
  } catch (const std::ios_base::failure&) {
    throw OutputError(path.string(), "cannot be written: " + describeWriteError(errno));
  }
  file.commit();
}

// What `writeSealed` wrote, after its head, or nothing where it is hurt.
std::optional<StateReader> openSealed(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::string head(kHead, '\0');
  if (!in || !in.read(head.data(), static_cast<std::streamsize>(kHead)) ||
      !head.starts_with(kMagic))
    return std::nullopt;
  std::uint64_t size = 0, hash = 0;
  std::memcpy(&size, head.data() + kMagic.size(), sizeof size);
  std::memcpy(&hash, head.data() + kMagic.size() + sizeof size, sizeof hash);
  std::error_code error;
  if (fs::file_size(path, error) != size + kHead || error) return std::nullopt;
  Hasher hasher;
  std::string block;
  for (std::uint64_t left = size; left > 0; left -= block.size()) {
    block.resize(static_cast<std::size_t>(std::min<std::uint64_t>(left, kBlock)));
    if (!in.read(block.data(), static_cast<std::streamsize>(block.size()))) return std::nullopt;
    hasher.bytes(block.data(), block.size());
  }
  if (kChecksums && hasher.value() != hash) return std::nullopt;
  in.seekg(static_cast<std::streamoff>(kHead));
  return StateReader(path, std::move(in), size);
}

// Not through a link, which is somebody's.
bool isFolder(const fs::path& path) {
  std::error_code error;
  return fs::is_directory(fs::symlink_status(path, error));
}

// Parts have no dot in their names, temporaries of them a mark.
bool mayBeOurs(const fs::path& path) {
  std::error_code error;
  if (!fs::is_regular_file(fs::symlink_status(path, error))) return false;
  const std::string name = path.filename().string();
  return name.find('.') == std::string::npos ||
         (name.starts_with('.') && name.find(".tmp-photosphere-") != std::string::npos);
}

// Whether one that may be is a file that `writeSealed` wrote, or began to.
bool isOurs(const fs::path& path) {
  if (path.filename().string().starts_with('.')) return true;
  std::ifstream in(path, std::ios::binary);
  std::string magic(kMagic.size(), '\0');
  in.read(magic.data(), static_cast<std::streamsize>(magic.size()));
  // One that was cut off within its magic, or that the disk lost, is empty or zeros.
  const std::string_view read(magic.data(), static_cast<std::size_t>(in.gcount()));
  return kMagic.starts_with(read) || read.find_first_not_of('\0') == std::string_view::npos;
}

std::vector<fs::path> oursIn(const fs::path& folder) {
  std::error_code error;
  std::vector<fs::path> ours;
  for (const auto& entry : fs::directory_iterator(folder, error))
    if (mayBeOurs(entry.path()) && isOurs(entry.path())) ours.push_back(entry.path());
  return ours;
}

}  // namespace

void StateReader::fail() const {
  throw InputError(m_file.string(),
                   "is no checkpoint of this version; remove it, or use --resume never");
}

void StateReader::get(void* to, std::uint64_t count, std::size_t size) {
  if (count > m_left / size) fail();
  const std::uint64_t bytes = count * size;
  m_left -= bytes;
  if (!m_in.read(static_cast<char*>(to), static_cast<std::streamsize>(bytes))) fail();
}

std::string StateReader::text() {
  const auto count = value<std::uint64_t>();
  if (count > m_left) fail();
  std::string s(static_cast<std::size_t>(count), '\0');
  get(s.data(), count, 1);
  return s;
}

fs::path Checkpoint::folderOf(const fs::path& output) {
  fs::path folder = output;
  folder += ".checkpoint";
  return folder;
}

Checkpoint::Checkpoint(fs::path folder, double interval, Resume resume)
    : m_folder(std::move(folder)), m_interval(interval), m_resume(resume) {
  if (m_resume == Resume::never) discard();
}

fs::path Checkpoint::fileOf(const std::string& part) const {
  return m_folder / part;
}

void Checkpoint::identify(const std::string& work) {
  m_work = work;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(m_folder, error)) {
    if (entry.path().filename() == kNoteFile || !mayBeOurs(entry.path())) continue;
    const bool ours = isOurs(entry.path());
    // Left by a run that was killed while it wrote.
    if (entry.path().filename().string().starts_with('.')) {
      fs::remove(entry.path(), error);
      continue;
    }
    std::optional<StateReader> kept = openSealed(entry.path());
    std::string why;
    if (!kept)
      why = "is damaged";
    else if (kept->text() != m_work)
      why = "belongs to other work (scene, smoke, lights, options or version differ)";
    else
      continue;
    if (m_resume == Resume::require)
      throw InputError(entry.path().string(), why + "; use --resume never to start anew");
    log::warning("{} {}: not gone on from", entry.path().string(), why);
    if (ours) fs::remove(entry.path(), error);
  }
}

std::optional<StateReader> Checkpoint::load(const std::string& part) {
  std::optional<StateReader> kept = openSealed(fileOf(part));
  if (!kept || kept->text() != m_work) return std::nullopt;
  return kept;
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
    writeSealed(fileOf(part), m_work, write);
  } catch (const OutputError& error) {
    if (!std::exchange(m_warned, true)) log::warning("no checkpoint: {}", error.what());
    std::error_code ignored;
    if (isFolder(m_folder)) fs::remove(m_folder, ignored);  // an empty one is no checkpoint
  }
  m_last = Clock::now();
  m_saveSeconds = std::chrono::duration<double>(m_last - start).count();
}

void Checkpoint::saveNote() {
  if (m_note.empty() || m_noteKept) return;
  writeSealed(fileOf(kNoteFile), "", [&](StateWriter& w) { w.text(m_note); });
  m_noteKept = true;
}

std::optional<std::string> Checkpoint::note(const fs::path& folder) {
  std::optional<StateReader> kept = openSealed(folder / kNoteFile);
  if (!kept) return std::nullopt;
  kept->text();  // the name of no work
  return kept->text();
}

bool Checkpoint::isIn(const fs::path& folder) {
  const std::vector<fs::path> ours = oursIn(folder);
  return std::any_of(ours.begin(), ours.end(), [](const fs::path& path) {
    return !path.filename().string().starts_with('.');
  });
}

void Checkpoint::discard() {
  std::error_code error;
  for (const fs::path& path : oursIn(m_folder))
    fs::remove(path, error);
  // What somebody else keeps there stays.
  if (isFolder(m_folder)) fs::remove(m_folder, error);
}

}  // namespace photosphere
