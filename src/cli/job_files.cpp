#include "job_files.h"

#include <fmt/format.h>

#include <sys/stat.h>

#include <algorithm>
#include <filesystem>

#include "photosphere/core/error.h"
#include "photosphere/core/frames.h"
#include "photosphere/core/hash.h"

namespace photosphere::cli {

namespace fs = std::filesystem;

// Frames share their folders, which are followed once.
const std::string& JobFiles::folderBehind(const std::string& folder) {
  const auto [known, fresh] = m_folders.try_emplace(folder);
  if (!fresh) return known->second;
  std::error_code error;
  const fs::path whole = fs::absolute(folder.empty() ? "." : folder, error);
  const fs::path real = fs::weakly_canonical(whole, error);
  known->second = (error ? whole.lexically_normal() : real).string();
  if (known->second.ends_with('/')) known->second.pop_back();
  return known->second;
}

// Links are followed as OutputFile does; one that leads nowhere is replaced itself. Empty for a
// device.
std::string JobFiles::fileBehind(const std::string& path) {
  std::error_code error;
  fs::file_status status = fs::symlink_status(path, error);
  std::string behind;
  if (fs::is_symlink(status)) {
    behind = fs::canonical(path, error).string();
    status = fs::status(path, error);
  }
  if (fs::exists(status) && !fs::is_regular_file(status)) return {};
  if (!behind.empty()) return behind;
  const std::size_t name = path.rfind('/') + 1;  // 0 without a folder
  return folderBehind(path.substr(0, name)) + '/' + path.substr(name);
}

void JobFiles::reads(const std::string& role, const std::string& path) {
  if (path.empty()) return;
  const std::string file = fileBehind(path);
  if (!file.empty()) m_uses.try_emplace(file, Use{role, false});
}

void JobFiles::writes(const std::string& role, const std::string& path) {
  if (path.empty()) return;
  const std::string file = fileBehind(path);
  if (file.empty()) return;
  const auto [use, fresh] = m_uses.try_emplace(file, Use{role, true});
  if (fresh) return;
  const Use& other = use->second;
  if (other.written)
    throw ConfigError(
        fmt::format("{} {} and {} are the same file, {}: one would overwrite the other; give one "
                    "of them another name",
                    role, path, other.role, file));
  throw ConfigError(
      fmt::format("{} {} would overwrite what is read as {}, {}; write to another name", role, path,
                  other.role, file));
}

void JobFiles::reads(const std::string& role, const std::string& path, const Frames& frames) {
  if (!hasFrameToken(path)) return reads(role, path);
  for (const std::int64_t frame : frames)
    reads(role, framePath(path, frame));
}

void JobFiles::writes(const std::string& role, const std::string& path, const Frames& frames) {
  if (!hasFrameToken(path)) return writes(role, path);
  for (const std::int64_t frame : frames)
    writes(role, framePath(path, frame));
}

std::string JobFiles::stamp(const std::string& except) const {
  std::vector<std::string> files;
  for (const auto& [file, use] : m_uses)
    if (!use.written && use.role != except) files.push_back(file);
  std::sort(files.begin(), files.end());
  Hasher hasher;
  for (const std::string& file : files) {
    struct stat found = {};
    const bool exists = stat(file.c_str(), &found) == 0;
    hasher.text(fmt::format("{} {} {} {} {}\n", file, exists, found.st_size, found.st_mtim.tv_sec,
                            found.st_mtim.tv_nsec));
  }
  return hasher.hex();
}

}  // namespace photosphere::cli
