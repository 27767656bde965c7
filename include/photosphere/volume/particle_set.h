#pragma once
// Particles as every reader delivers and every writer takes them.

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "photosphere/core/types.h"

namespace photosphere::volume {

/// Columns that an attribute may hold. Narrower types are widened on reading, unsigned 32 bit to
/// 64 bit signed.
using AttributeData =
    std::variant<std::vector<float>, std::vector<double>, std::vector<std::int32_t>,
                 std::vector<std::int64_t>, std::vector<std::string>>;

/// One named column: `arity` values a particle, particle by particle.
struct Attribute {
  std::string name;
  int arity = 1;
  AttributeData data;

  /// Number of particles it covers.
  std::size_t size() const;
  /// Component `c` of particle `i` as double; 0 for text.
  double number(std::size_t i, int c = 0) const;
};

/// Whether a position is one: finite, as the floats are that smoke is made of. Garbage that is
/// farther away would make voxels so large that all other particles are at one place of one.
bool isPlace(const Vec3d& position);

/// Particles of one frame: positions in world space [scene units] and attributes under Houdini
/// names
/// (`v pscale id Cd density temperature age mass`).
class ParticleSet {
 public:
  std::vector<Vec3d> positions;
  std::vector<Attribute> attributes;
  std::map<std::string, std::string> metadata;

  std::size_t size() const { return positions.size(); }
  const Attribute* find(std::string_view name) const;
  Attribute* find(std::string_view name);
  /// Adds a column; replaces one of the same name.
  Attribute& add(Attribute attribute);
  Box3d bounds() const;
  /// Takes out the particles whose position is not finite, as they lie nowhere.
  /// @return their numbers, from 0
  std::vector<std::size_t> removeUnplaced();
};

/// The Houdini name for what other software calls an attribute (`Position`, `velocity`, `radius`,
/// `Color`, ...), or the name itself.
std::string houdiniName(std::string_view name);

}  // namespace photosphere::volume
