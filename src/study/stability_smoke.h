#pragma once
// Smoke for the table of hard cases, made and not shipped.

#include <filesystem>

#include "stability_catalogue.h"

namespace photosphere::study {

/// Writes the smoke of a spec as .vdb. Its keys (data/hard/README.md):
///
/// - `kind`: blob (two smooth lobes within a cube, alike in no direction), box, tile, empty, zeros,
///   points (no grid)
/// - `size`, `center`, `voxels`: edge of the cube [scene units], its centre, voxels along it;
///   `dims` and `extent` of a box by axis
/// - `value`: factor on every density; `bad`: values of voxels in the middle
/// - `matrix`: nine numbers, row-major, over the voxels' placement; `scene_matrix`: sixteen, what
///   the scene's `transform` does afterwards. The smoke stays where it is in the world
/// - `type`: of the grid; `frustum` = 1
/// - `flame`: factor of a grid `flame` of the same shape; `velocity`: of a grid `v`, everywhere
/// - `points`, `at`, `pscale`, `bad_pscale`, `mass`: how many, all at one place, radii, those of
/// the
///   first ones, mass of all together
///
/// @throws ConfigError for an unknown kind; OutputError
void writeStabilitySmoke(const SmokeSpec& spec, const std::filesystem::path& path);

}  // namespace photosphere::study
