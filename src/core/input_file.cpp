#include "photosphere/core/input_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>

#include "photosphere/core/error.h"

namespace photosphere {

void checkReadable(const std::filesystem::path& path, std::string_view kind) {
  struct stat info {};
  const bool found = stat(path.c_str(), &info) == 0;
  if (found && S_ISDIR(info.st_mode))
    throw InputMissingError(path.string(), fmt::format("is a folder, not {}; name a file", kind));
  // A pipe would wait for its writer, and then be opened a second time.
  const int file = found && !S_ISREG(info.st_mode) ? 0 : open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (file > 0) close(file);
  if (file >= 0) return;
  const int reason = errno;
  if (reason == ENOENT || reason == ENOTDIR)
    throw InputMissingError(path.string(), "no such file; check its path");
  throw InputMissingError(path.string(), fmt::format("cannot be opened ({}); check its permissions",
                                                     std::generic_category().message(reason)));
}

std::uint64_t readableSize(const std::filesystem::path& path, std::string_view kind) {
  checkReadable(path, kind);
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  if (error) throw InputMissingError(path.string(), "is not a regular file; copy it to one");
  return size;
}

}  // namespace photosphere
