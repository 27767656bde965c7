#include "photosphere/core/output_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
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
std::atomic<bool> g_ending{false};                      // no temporary may come into being any more
static_assert(std::atomic<bool>::is_always_lock_free);  // for handlers

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

// Bytes that a file's name may have in a folder.
std::size_t longestName(const fs::path& folder) {
  const long most = pathconf(folder.c_str(), _PC_NAME_MAX);
  return most > 0 ? static_cast<std::size_t>(most) : 255;
}

// Whether a path leads to an open file of the process, such as /dev/stdout.
bool isOfProcess(fs::path path) {
  std::error_code error;
  for (int links = 0; links < 8; ++links) {
    const std::string name = path.string();
    if (name.starts_with("/dev/fd/") || name.starts_with("/dev/std") || name.starts_with("/proc/"))
      return true;
    const fs::path next = fs::read_symlink(path, error);
    if (error) return false;
    path = next.is_absolute() ? next : path.parent_path() / next;
  }
  return false;
}

// Name of the temporary of a target. Keeps the extension, by which some libraries choose the
// format; of the rest what there is room for. Those of two long names that begin alike differ.
std::string temporaryName(const fs::path& target, std::size_t longest) {
  static std::atomic<unsigned> shortened{0};
  std::string stem = target.stem().string();
  const std::string extension = target.extension().string();
  std::string mark = fmt::format(".tmp-photosphere-{}", getpid());
  if (1 + stem.size() + mark.size() + extension.size() > longest) {
    mark += fmt::format("-{}", ++shortened);
    const std::size_t rest = 1 + mark.size() + extension.size();
    stem.resize(std::min(stem.size(), longest > rest ? longest - rest : 0));
  }
  return "." + stem + mark + extension;
}

}  // namespace

OutputFile::OutputFile(const fs::path& target) : m_target(target) {
  while (g_ending)
    usleep(1000);
  std::error_code error;
  const fs::file_status status = fs::status(target, error);
  if (fs::is_directory(status))
    throw OutputError(target.string(), "is a folder; name a file in it");
  if (error && status.type() == fs::file_type::none)
    throw OutputError(target.string(), "cannot be written: " + describeWriteError(error.value()));
  if (fs::exists(status) && !fs::is_regular_file(status)) {
    // Opening one would wait for a reader, after all the work. Those of the process itself, such as
    // /dev/stdout, have theirs.
    if ((fs::is_fifo(status) || fs::is_socket(status)) && !isOfProcess(target))
      throw OutputError(target.string(), "is a pipe or a socket; name a file");
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
  m_temporary = folder / temporaryName(m_target, longestName(folder));
  m_slot = claimSlot(fs::absolute(m_temporary).string());
  // Some file systems tell only now that they take no file.
  const int fd = open(m_temporary.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  if (fd < 0) {
    const int reason = errno;
    if (m_slot >= 0) g_slots[static_cast<std::size_t>(m_slot)].state = 0;
    throw OutputError(target.string(), "cannot create: " + describeWriteError(reason));
  }
  close(fd);
  // Whoever writes makes it anew: a umask may keep even its owner from opening it again.
  unlink(m_temporary.c_str());
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
    case ENAMETOOLONG:
      return what + "; name it shorter";
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

void endOutputs() noexcept {
  g_ending = true;
  removeTemporaries();
  // Another thread may have named a temporary, and be about to create it.
  const timespec moment = {0, 50'000'000};
  nanosleep(&moment, nullptr);
  removeTemporaries();
}

}  // namespace photosphere
