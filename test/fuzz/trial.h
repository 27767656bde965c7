#pragma once
// Inputs given to a target, and how that ended.

#include <functional>
#include <string>

#include "support/support.h"
#include "targets.h"

namespace photosphere::fuzz {

/// How often which end was met. Anything else has failed the test by then.
struct Outcomes {
  int read = 0;
  int refused = 0;  ///< by an Error of a kind that is the input's
  int guarded =
      0;  ///< the library crashed and the guard ended the process with its message, exit 4
};

/// Gives `count` inputs to a target: here, or in processes of their own under limits of memory and
/// time where a library reads them. Fails the test for every other exception, for a crash, and for
/// memory that an input does not justify.
/// @param input  the bytes of one
/// @param what   names it, for messages
Outcomes attempt(const Target& target, std::size_t count,
                 const std::function<std::string(std::size_t)>& input,
                 const std::function<std::string(std::size_t)>& what);

}  // namespace photosphere::fuzz
