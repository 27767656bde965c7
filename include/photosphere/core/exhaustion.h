#pragma once
// Memory and threads that run out, told from other errors and said where no command can catch them.

namespace photosphere {

/// What a machine, or a limit that it sets the process, may have no more of.
enum class Resource { none, memory, threads };

/// What ran out, by the exception that is being handled, or that ends the process; `none` where it
/// is another error, or there is no exception.
Resource exhausted() noexcept;

/// What ran out and what to do about it, such as "memory ran out; free some ...".
/// @param resource  not `none`
const char* remedyFor(Resource resource) noexcept;

/// What to say, after its name, of a file over whose reading memory ran out.
inline constexpr char kRanOutReading[] =
    "memory ran out while reading it; raise its limit (ulimit -v)";

/// To standard error, for handlers of signals and where there is no memory.
void printRaw(const char* text) noexcept;

/// From then on an exception that nothing can catch (a library starts threads where it may not
/// throw) removes temporaries, and where it says that memory or threads ran out, the process says
/// so and ends with exit code 5. Others are printed and abort, as they do without. May be called
/// before anything is initialised.
void installTerminateHandler() noexcept;

}  // namespace photosphere
