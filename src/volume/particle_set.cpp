#include "photosphere/volume/particle_set.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <limits>
#include <type_traits>
#include <utility>

namespace photosphere::volume {

std::size_t Attribute::size() const {
  const std::size_t values = std::visit([](const auto& column) { return column.size(); }, data);
  return arity > 0 ? values / static_cast<std::size_t>(arity) : 0;
}

double Attribute::number(std::size_t i, int c) const {
  const std::size_t at = i * static_cast<std::size_t>(arity) + static_cast<std::size_t>(c);
  return std::visit(
      [at](const auto& column) -> double {
        if constexpr (std::is_same_v<std::decay_t<decltype(column)>, std::vector<std::string>>)
          return 0.0;
        else
          return static_cast<double>(column[at]);
      },
      data);
}

const Attribute* ParticleSet::find(std::string_view name) const {
  for (const Attribute& attribute : attributes)
    if (attribute.name == name) return &attribute;
  return nullptr;
}

Attribute* ParticleSet::find(std::string_view name) {
  return const_cast<Attribute*>(std::as_const(*this).find(name));
}

Attribute& ParticleSet::add(Attribute attribute) {
  if (Attribute* old = find(attribute.name)) {
    *old = std::move(attribute);
    return *old;
  }
  return attributes.emplace_back(std::move(attribute));
}

bool isPlace(const Vec3d& position) {
  constexpr auto most = static_cast<double>(std::numeric_limits<float>::max());
  for (int axis = 0; axis < 3; ++axis)
    if (!(std::abs(position[axis]) <= most)) return false;
  return true;
}

Box3d ParticleSet::bounds() const {
  Box3d box;
  for (const Vec3d& p : positions)
    if (!glm::any(glm::isnan(p)))
      box.grow(p);  // a NaN would spoil the box, or not, depending on the order
  return box;
}

std::vector<std::size_t> ParticleSet::removeUnplaced() {
  std::vector<std::size_t> unplaced;
  for (std::size_t i = 0; i < positions.size(); ++i)
    if (!isPlace(positions[i])) unplaced.push_back(i);
  // Elements of those particles, `arity` each; what is behind moves up.
  const auto removeFrom = [&](auto& column, std::size_t arity) {
    std::size_t to = 0;
    auto next = unplaced.begin();
    for (std::size_t i = 0; (i + 1) * arity <= column.size(); ++i) {
      if (next != unplaced.end() && *next == i) {
        ++next;
        continue;
      }
      for (std::size_t c = 0; c < arity; ++c, ++to)
        if (to != i * arity + c) column[to] = std::move(column[i * arity + c]);
    }
    column.resize(to);
  };
  if (unplaced.empty()) return unplaced;
  removeFrom(positions, 1);
  for (Attribute& attribute : attributes)
    std::visit(
        [&](auto& column) {
          removeFrom(column, static_cast<std::size_t>(std::max(attribute.arity, 1)));
        },
        attribute.data);
  return unplaced;
}

std::string houdiniName(std::string_view name) {
  // Lower case, without underscores. The names are those found in Krakatoa PRT, Maya, RealFlow,
  // SPlisHSPlasH, Mantaflow and Alembic files.
  static constexpr std::pair<std::string_view, std::string_view> names[] = {
      {"p", "P"},
      {"position", "P"},
      {"pos", "P"},
      {"worldposition", "P"},
      {"v", "v"},
      {"velocity", "v"},
      {"velocities", "v"},
      {"vel", "v"},
      {"pvel", "v"},
      {"pscale", "pscale"},
      {"radius", "pscale"},
      {"radiuspp", "pscale"},
      {"pradius", "pscale"},
      {"color", "Cd"},
      {"colour", "Cd"},
      {"cd", "Cd"},
      {"rgb", "Cd"},
      {"rgbpp", "Cd"},
      {"id", "id"},
      {"particleid", "id"},
      {"pointid", "id"},
      {"pointids", "id"},
      {"density", "density"},
      {"temperature", "temperature"},
      {"temp", "temperature"},
      {"age", "age"},
      {"mass", "mass"},
      {"masspp", "mass"},
      {"lifespan", "life"},
      {"lifespanpp", "life"},
      {"life", "life"},
  };
  std::string key;
  for (const char c : name)
    if (c != '_' && c != ' ') key += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  for (const auto& [known, houdini] : names)
    if (key == known) return std::string(houdini);
  return std::string(name);
}

}  // namespace photosphere::volume
