#include "photosphere/core/exhaustion.h"

#include <signal.h>
#include <unistd.h>

#include <cstdlib>
#include <cstring>
#include <exception>
#include <new>
#include <string_view>
#include <system_error>
#include <utility>

#include "photosphere/core/error.h"
#include "photosphere/core/output_file.h"

namespace photosphere {

namespace {

std::terminate_handler g_otherwise = nullptr;

// Takes no memory: there may be none.
[[noreturn]] void onTerminate() {
  removeTemporaries();
  if (const Resource lacking = exhausted(); lacking != Resource::none) {
    printRaw("photosphere: error: ");
    printRaw(remedyFor(lacking));
    printRaw("\n");
    _exit(static_cast<int>(ExitCode::memory));
  }
  // An exception is no heap that a file has damaged, which a handler of SIGABRT may stand for.
  signal(SIGABRT, SIG_DFL);
  if (g_otherwise) g_otherwise();
  std::abort();
}

}  // namespace

Resource exhausted() noexcept {
  const std::exception_ptr cause = std::current_exception();
  if (!cause) return Resource::none;
  try {
    std::rethrow_exception(cause);
  } catch (const std::bad_alloc&) {
    return Resource::memory;
  } catch (const std::system_error& error) {
    if (error.code() == std::errc::resource_unavailable_try_again) return Resource::threads;
    if (error.code() == std::errc::not_enough_memory) return Resource::memory;
  } catch (const std::exception& error) {
    // TBB says it in words alone, and others hand on the words of std::bad_alloc. Further on in a
    // message the same words may be those of a file.
    const std::string_view words = error.what();
    if (words.starts_with("pthread_create has failed")) return Resource::threads;
    if (words == "std::bad_alloc") return Resource::memory;
  } catch (...) {
  }
  return Resource::none;
}

const char* remedyFor(Resource resource) noexcept {
  if (resource == Resource::threads)
    return "no more threads can be started; use fewer (-j), or raise the limits of processes "
           "(ulimit -u) and of memory (ulimit -v)";
  return "memory ran out; free some or raise its limit (ulimit -v), or use fewer pixels, photons, "
         "particles or voxels";
}

void printRaw(const char* text) noexcept {
  const ssize_t ignored = write(STDERR_FILENO, text, std::strlen(text));
  static_cast<void>(ignored);
}

void installTerminateHandler() noexcept {
  // Once: a handler set later may end with this one, which must not begin anew with that.
  static bool installed = false;
  if (std::exchange(installed, true)) return;
  g_otherwise = std::set_terminate(onTerminate);
}

}  // namespace photosphere
