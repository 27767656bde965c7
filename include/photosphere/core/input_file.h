#pragma once
// Files that are read: what is said of one that cannot be.

#include <cstdint>
#include <filesystem>
#include <string_view>

namespace photosphere {

/// Opens and closes a file, before anything is made of it.
/// @param kind  what it should be, for the message: `a scene file`
/// @throws InputMissingError when it is not there, is a folder, or may not be read
void checkReadable(const std::filesystem::path& path, std::string_view kind);

/// The same for a file whose size must be known [bytes].
/// @throws InputMissingError for a pipe or device, too
std::uint64_t readableSize(const std::filesystem::path& path, std::string_view kind);

}  // namespace photosphere
