#pragma once
// What a command reads and writes: nothing that it reads, and nothing twice, is written over.

#include <cstdint>
#include <string>
#include <unordered_map>
#include <vector>

namespace photosphere::cli {

/// The files of a command. They are told apart by what their paths lead to, through links and
/// folders; devices, which hold nothing to lose, do not count. All that is read is told first.
class JobFiles {
 public:
  using Frames = std::vector<std::int64_t>;

  /// @param role  names the file in messages, such as `volume.0.file`
  /// @param path  an empty one is fine
  void reads(const std::string& role, const std::string& path);
  /// @throws ConfigError that names both where the file is read, or written as something else
  void writes(const std::string& role, const std::string& path);

  /// A file a frame where the path is numbered, else one for all.
  void reads(const std::string& role, const std::string& path, const Frames& frames);
  void writes(const std::string& role, const std::string& path, const Frames& frames);

  /// Hash of what is read, by name, size and time of the last change, of all roles but one.
  std::string stamp(const std::string& except) const;

 private:
  struct Use {
    std::string role;
    bool written = false;
  };

  std::string fileBehind(const std::string& path);
  const std::string& folderBehind(const std::string& folder);

  std::unordered_map<std::string, Use> m_uses;             // by file
  std::unordered_map<std::string, std::string> m_folders;  // as written, and what is behind it
};

}  // namespace photosphere::cli
