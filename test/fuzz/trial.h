#pragma once
// One input given to one target, and how that ended.

#include <string>

#include "support/support.h"
#include "targets.h"

namespace photosphere::fuzz {

enum class Outcome {
  read,
  refused,  ///< an Error of the user's file, with its name
  guarded,  ///< the library crashed and the guard ended the process with its message and exit 4
  failed,   ///< anything else; the test has failed by then
};

/// Gives the bytes to the target: here, or in a process of its own under limits of memory and time
/// where a library reads them.
/// @param what  of the input, for messages
Outcome attempt(const Target& target, const std::string& bytes, const std::string& what,
                const test::TemporaryFolder& folder);

}  // namespace photosphere::fuzz
