#pragma once
// Formats that this version knows and does not read.

#include <string_view>

namespace photosphere::caches {

/// What to say about a format that is not read.
struct ForeignFormat {
  std::string_view name;    ///< "Field3D"
  std::string_view advice;  ///< what to export instead
};

/// By the first bytes, or nullptr.
const ForeignFormat* foreignByContent(std::string_view head);

/// By the end of a lower-case file name, or nullptr.
const ForeignFormat* foreignByName(std::string_view name);

}  // namespace photosphere::caches
