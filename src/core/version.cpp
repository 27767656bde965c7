#include "photosphere/core/version.h"

namespace photosphere {

std::string versionText() {
  return "photosphere " PHOTOSPHERE_VERSION;
}

}  // namespace photosphere
