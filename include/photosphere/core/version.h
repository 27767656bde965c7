#pragma once

#include <string>

namespace photosphere {

/// "photosphere 0.1.0".
std::string versionText();

/// The version, the compiler and the instructions it may use: what the same bits hold for
/// (METHOD.md section 6).
std::string buildText();

}  // namespace photosphere
