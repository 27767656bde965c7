#pragma once
// Everything that reads bytes from outside, one row each: what libFuzzer, the tests of damage and
// the replay of old findings run over. A cache format is a row as soon as it is in its table.

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "photosphere/caches/cache_format.h"

namespace photosphere::fuzz {

struct Target {
  std::string name;
  /// Reads the bytes, by way of a file in `folder` where the reader takes a path. Returns where
  /// they are read, throws photosphere::Error where they are refused; anything else is a finding.
  std::function<void(const std::string& bytes, const std::filesystem::path& folder)> read;
  /// A .vdb, read by a library that damage can bring down: for processes of their own.
  bool isolated = false;
  /// Words of the format, which chance would be long to find.
  std::vector<std::string> words = {};
  /// Memory in one piece that is taken for the smallest input [bytes]: blocks of files.
  std::size_t room = std::size_t{16} << 20;
};

const std::vector<Target>& targets();
/// nullptr when there is none of that name.
const Target* findTarget(std::string_view name);

/// A small sound input of a target. Made when it is asked for: a writer waits for the disk.
struct Specimen {
  std::string target, name;
  std::function<std::string()> content;
};

/// The target that reads a format's files of this extension; extensions that a reader treats alike
/// share one.
std::string targetOf(const caches::CacheFormat& format, std::string_view extension);

/// At least one for each target: by the writers where there are any, else made here.
std::vector<Specimen> specimens();

}  // namespace photosphere::fuzz
