#include "photosphere/cli/main.h"

#include <cstdio>

#include "photosphere/core/version.h"

namespace photosphere::cli {

int run(int, char**) {
  std::puts(versionText().c_str());
  return 0;
}

}  // namespace photosphere::cli
