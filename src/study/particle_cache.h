#pragma once
// Particles for caches that hold grids alone.

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "scene_source.h"

namespace photosphere::study {

/// Overrides of the first volume that give it `count` particles: none where its .vdb has points
/// already and `always` is off; else a copy of its density with particles seeded in proportion to
/// it, written to `folder`, frame by frame.
/// @return overrides for SceneSource::with; empty for a cache that is no .vdb
/// @throws Error of the child that reads and writes
std::vector<std::string> particleSets(const SceneSource& scene,
                                      const std::vector<std::int64_t>& frames, std::uint64_t count,
                                      bool always, const std::filesystem::path& folder);

}  // namespace photosphere::study
