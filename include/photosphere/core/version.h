#pragma once

#include <string>

namespace photosphere {

/// "photosphere 0.1.0".
std::string versionText();

}  // namespace photosphere
