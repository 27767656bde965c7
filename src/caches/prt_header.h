#pragma once
// The header of a Krakatoa PRT file, versions 1 and 1.1. Source: Thinkbox Software, "PRT File
// Format", Krakatoa documentation. All numbers are little endian.

#include <cstdint>
#include <string_view>

#include "photosphere/caches/cache_format.h"
#include "records.h"

namespace photosphere::caches {

inline constexpr std::string_view kPrtMagic{"\xC0PRT\r\n\x1A\n", 8};
inline constexpr std::size_t kPrtFixedHeader = 56;
inline constexpr std::size_t kPrtChannelRecord = 44;
inline constexpr std::size_t kPrtChannelName = 32;
inline constexpr std::size_t kMaxPrtChannels = 1024;
inline constexpr std::int64_t kPrtUnfinished = -1;

struct PrtHeader {
  std::int64_t count = 0;  ///< kPrtUnfinished: the writer did not come to the end
  RecordLayout layout;
};

/// PRT's number of a scalar type.
int prtTypeNumber(Scalar type);

/// Reads up to the compressed particles; metadata and notes go to `content`.
/// @throws InputError
PrtHeader readPrtHeader(FileReader& file, CacheContent& content);

}  // namespace photosphere::caches
