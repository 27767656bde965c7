#include "photosphere/core/output_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <fstream>

#include "photosphere/core/error.h"

namespace photosphere {

namespace fs = std::filesystem;

namespace {

// Paths of living temporaries, where a signal handler can reach them without allocating.
struct Slot {
  std::atomic<int> state{0};  // 0 free, 1 being filled, 2 live
  std::array<char, 4096> path{};
};
std::array<Slot, 64> g_slots;

int claimSlot(const std::string& path) {
  for (std::size_t i = 0; i < g_slots.size(); ++i) {
    int expected = 0;
    if (path.size() + 1 > g_slots[i].path.size()) return -1;
    if (!g_slots[i].state.compare_exchange_strong(expected, 1)) continue;
    std::memcpy(g_slots[i].path.data(), path.c_str(), path.size() + 1);
    g_slots[i].state = 2;
    return static_cast<int>(i);
  }
  return -1;
}

void syncPath(const fs::path& path, int flags) {
  const int fd = open(path.c_str(), flags);
  if (fd < 0)
    throw OutputError(path.string(), "cannot reopen to flush it: " + describeWriteError(errno));
  const int failed = fsync(fd) != 0 ? errno : 0;
  close(fd);
  // Some file systems cannot flush a folder; the rename itself is still atomic there.
  if (failed && failed != EINVAL && failed != ENOTSUP)
    throw OutputError(path.string(), "cannot flush to disk: " + describeWriteError(failed));
}

}  // namespace

OutputFile::OutputFile(const fs::path& target) : m_target(target) {
  std::error_code error;
  const fs::file_status status = fs::status(target, error);
  if (fs::is_directory(status))
    throw OutputError(target.string(), "is a folder; name a file in it");
  if (fs::exists(status) && !fs::is_regular_file(status)) {
    m_temporary = target;
    return;
  }
  // A link keeps pointing at what it pointed at: the file behind it is replaced.
  if (fs::is_symlink(fs::symlink_status(target, error))) m_target = fs::canonical(target, error);
  if (error) m_target = target;
  const fs::path folder = m_target.has_parent_path() ? m_target.parent_path() : fs::path(".");
  fs::create_directories(folder, error);
  if (error && !fs::is_directory(folder))
    throw OutputError(target.string(), "cannot create folder " + folder.string() + ": " +
                                           describeWriteError(error.value()));
  if (access(folder.c_str(), W_OK) != 0)
    throw OutputError(target.string(), "cannot write in its folder: " + describeWriteError(errno));
  // Keeps the extension, by which some libraries choose the format.
  m_temporary = folder / fmt::format(".{}.tmp-photosphere-{}{}", m_target.stem().string(), getpid(),
                                     m_target.extension().string());
  m_slot = claimSlot(fs::absolute(m_temporary).string());
}

OutputFile::~OutputFile() {
  if (!m_committed && !inPlace()) {
    std::error_code ignored;
    fs::remove(m_temporary, ignored);
  }
  if (m_slot >= 0) g_slots[static_cast<std::size_t>(m_slot)].state = 0;
}

void OutputFile::commit() {
  if (!inPlace()) {
    syncPath(m_temporary, O_RDONLY);
    if (rename(m_temporary.c_str(), m_target.c_str()) != 0)
      throw OutputError(m_target.string(),
                        "cannot rename into place: " + describeWriteError(errno));
    const fs::path folder = m_target.has_parent_path() ? m_target.parent_path() : fs::path(".");
    syncPath(folder, O_RDONLY | O_DIRECTORY);
  }
  m_committed = true;
}

void writeFile(const fs::path& target, const std::string& content) {
  OutputFile file(target);
  const int flags = O_WRONLY | O_CREAT | (file.inPlace() ? 0 : O_TRUNC);
  const int fd = open(file.temporaryPath().c_str(), flags, 0666);
  if (fd < 0) throw OutputError(target.string(), "cannot create: " + describeWriteError(errno));
  std::size_t written = 0;
  int failed = 0;
  while (written < content.size() && !failed) {
    const ssize_t n = write(fd, content.data() + written, content.size() - written);
    if (n < 0 && errno != EINTR) failed = errno;
    if (n > 0) written += static_cast<std::size_t>(n);
  }
  if (close(fd) != 0 && !failed) failed = errno;
  if (failed) throw OutputError(target.string(), "cannot write: " + describeWriteError(failed));
  file.commit();
}

std::string describeWriteError(int error) {
  const std::string what = error ? std::strerror(error) : "the device refused the data";
  switch (error) {
    case ENOSPC:
    case EDQUOT:
      return what + "; free some, or write elsewhere";
    case EFBIG:
      return what + "; raise the limit of file sizes (ulimit -f), or write elsewhere";
    case EACCES:
    case EPERM:
    case EROFS:
      return what + "; change the permissions, or write elsewhere";
    default:
      return what + "; check the disk, or write elsewhere";
  }
}

void removeTemporaries() noexcept {
  for (Slot& slot : g_slots)
    if (slot.state == 2) unlink(slot.path.data());
}

}  // namespace photosphere
