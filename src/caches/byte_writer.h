#pragma once
// The output of every writer of this module: a file that appears whole or not at all.

#include <cstddef>
#include <filesystem>
#include <fstream>
#include <string_view>

#include "photosphere/core/output_file.h"

namespace photosphere::caches {

class ByteWriter {
 public:
  /// @throws OutputError
  explicit ByteWriter(const std::filesystem::path& path);

  /// @throws OutputError when the device does not take the bytes
  void write(const void* data, std::size_t size);
  void write(std::string_view text) { write(text.data(), text.size()); }
  /// Overwrites bytes that were written before, such as a count in a header.
  void patch(std::uint64_t offset, const void* data, std::size_t size);
  /// Closes the file and puts it in place. @throws OutputError
  void commit();

 private:
  void check(bool good);

  OutputFile m_output;
  std::ofstream m_file;
};

}  // namespace photosphere::caches
