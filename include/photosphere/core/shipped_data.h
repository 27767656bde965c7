#pragma once
// Data that comes with the tool: colour config, studies, hard cases, reference values.

#include <filesystem>
#include <optional>
#include <vector>

namespace photosphere {

/// Where a path of the data folder may lie, best place first: in `$PHOTOSPHERE_DATA`, in
/// `share/photosphere` beside an installed tool (the source tree that built it may be gone, or
/// changed), in the source tree.
std::vector<std::filesystem::path> shippedPlaces(const std::filesystem::path& relative);

/// The first of these places where there is a file or folder.
std::optional<std::filesystem::path> findShipped(const std::filesystem::path& relative);

}  // namespace photosphere
