#include "particle_cache.h"

#include <fmt/format.h>

#include "child.h"
#include "photosphere/core/error.h"
#include "photosphere/core/frames.h"
#include "photosphere/core/hash.h"
#include "photosphere/volume/rasterize.h"
#include "photosphere/volume/vdb_file.h"
#include "reference.h"

namespace photosphere::study {

namespace fs = std::filesystem;

namespace {

constexpr std::uint64_t kSeed = 1;

// The density where `origin` and `cell_centered` put it, with particles in it.
// @return "points" where the file needs none
std::string seedFrame(const scene::VolumeEntry& entry, const std::string& from, const fs::path& to,
                      std::uint64_t count, bool always) {
  const volume::VdbFile file = volume::readVdb(from);
  if (file.points() && !always) return "points";
  const volume::Grid& density = file.find(entry.values.text("density"));
  Mat4d offset(1.0);
  offset[3] = glm::dvec4(entry.values.vec3("origin"), 1.0);
  if (entry.values.flag("cell_centered")) {
    const Mat4d m = density.worldFromIndex();
    offset[3] += 0.5 * (m[0] + m[1] + m[2]);
  }
  const volume::Grid placed = volume::transformed(density, offset);
  const volume::ParticleSet particles = volume::seedParticles(placed, count, kSeed);
  volume::writeVdb(to, {placed, volume::pointsToGrid(particles, "points", 0)});
  return "seeded";
}

}  // namespace

std::vector<std::string> particleSets(const SceneSource& source,
                                      const std::vector<std::int64_t>& frames, std::uint64_t count,
                                      bool always, const fs::path& folder) {
  const scene::SceneFile scene = source.open();
  if (scene.volumes.empty()) return {};
  const scene::VolumeEntry& entry = scene.volumes.front();
  const std::string pattern = scene.resolvePath(entry.values.text("file"));
  if (fs::path(pattern).extension() != ".vdb") return {};
  Hasher hasher;
  hasher.text(pattern);
  hasher.text(entry.values.format("origin") + entry.values.format("cell_centered"));
  const fs::path target = folder / fmt::format("particles-{}-{}.####.vdb", count, hasher.hex());
  for (const std::int64_t frame : frames) {
    const ChildResult child = runInChild([&] {
      return seedFrame(entry, framePath(pattern, frame), framePath(target.string(), frame), count,
                       always);
    });
    if (child.failed) throw Error(child.code, child.message);
    if (child.text == "points") return {};
  }
  return {fmt::format("volume.0.file={}", fs::absolute(target).string()),
          "volume.0.origin=[0, 0, 0]", "volume.0.cell_centered=false"};
}

}  // namespace photosphere::study
