#pragma once
// Whether what was read is held against the checksum that was written with it.

namespace photosphere {

/// False in builds for libFuzzer alone: what it makes up would get past no checksum.
#ifdef FUZZING_BUILD_MODE_UNSAFE_FOR_PRODUCTION
inline constexpr bool kChecksums = false;
#else
inline constexpr bool kChecksums = true;
#endif

}  // namespace photosphere
