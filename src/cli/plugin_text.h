#pragma once
// Plug-ins and their options as text, for `list` and for --help.

#include <string>

namespace photosphere::cli {

std::string describeFormats();
std::string describePhases();
std::string describeLights();
std::string describeCameras();
std::string describeEstimators();
/// The tables of a scene file that belong to no plug-in.
std::string describeScene();

}  // namespace photosphere::cli
