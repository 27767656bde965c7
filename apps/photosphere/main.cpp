#include "photosphere/cli/main.h"
#include "photosphere/core/exhaustion.h"

namespace {

void beforeLibraries(int, char**, char**) {
  photosphere::installTerminateHandler();
}

// log4cplus, which OpenVDB brings with it, starts four threads while it is loaded. Where none can
// be started nothing but what the loader calls from this section has run yet.
[[gnu::section(".preinit_array"), gnu::used]] void (*g_beforeLibraries)(int, char**,
                                                                        char**) = beforeLibraries;

}  // namespace

int main(int argc, char** argv) {
  return photosphere::cli::run(argc, argv);
}
