#include "merge_content.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <type_traits>

#include "photosphere/core/error.h"

namespace photosphere::cli {

using volume::Attribute;
using volume::AttributeData;
using volume::ParticleSet;

namespace {

bool isText(const Attribute& attribute) {
  return std::holds_alternative<std::vector<std::string>>(attribute.data);
}

std::vector<double> asDoubles(const Attribute& attribute, std::size_t count, int arity) {
  std::vector<double> values(count * static_cast<std::size_t>(arity), 0.0);
  for (std::size_t i = 0; i < count; ++i)
    for (int c = 0; c < std::min(arity, attribute.arity); ++c)
      values[i * static_cast<std::size_t>(arity) + static_cast<std::size_t>(c)] =
          attribute.number(i, c);
  return values;
}

/// Brings two columns of one name to one type and arity.
void unify(Attribute& a, std::size_t countA, Attribute& b, std::size_t countB) {
  if (a.data.index() == b.data.index() && a.arity == b.arity) return;
  if (isText(a) || isText(b))
    throw ConfigError(fmt::format(
        "attribute '{}' is text in one particle set and something else in another; rename one",
        a.name));
  const int arity = std::max(a.arity, b.arity);
  a.data = asDoubles(a, countA, arity);
  b.data = asDoubles(b, countB, arity);
  a.arity = b.arity = arity;
}

/// Lengthens a column with zeros or empty text.
void resize(Attribute& attribute, std::size_t count) {
  std::visit(
      [&](auto& column) { column.resize(count * static_cast<std::size_t>(attribute.arity)); },
      attribute.data);
}

void append(AttributeData& to, AttributeData&& from) {
  std::visit(
      [&](auto& column) {
        auto& source = std::get<std::decay_t<decltype(column)>>(from);
        column.insert(column.end(), std::make_move_iterator(source.begin()),
                      std::make_move_iterator(source.end()));
      },
      to);
}

void appendSet(ParticleSet& all, ParticleSet&& set) {
  const std::size_t before = all.size(), added = set.size();
  for (Attribute& attribute : set.attributes) {
    Attribute* known = all.find(attribute.name);
    if (!known) {
      Attribute empty = attribute;
      std::visit([](auto& column) { column.clear(); }, empty.data);
      resize(empty, before);
      known = &all.add(std::move(empty));
    }
    unify(*known, before, attribute, added);
    append(known->data, std::move(attribute.data));
  }
  all.positions.insert(all.positions.end(), set.positions.begin(), set.positions.end());
  for (Attribute& attribute : all.attributes)
    resize(attribute, all.size());
  all.metadata.merge(set.metadata);
}

}  // namespace

ParticleSet mergeParticles(std::vector<ParticleSet>& sets) {
  ParticleSet all;
  for (ParticleSet& set : sets) {
    if (all.size() == 0 && all.attributes.empty())
      all = std::move(set);
    else
      appendSet(all, std::move(set));
  }
  sets.clear();
  return all;
}

void mergeContent(caches::CacheContent& content, caches::CacheContent&& other,
                  const std::string& otherPath) {
  for (volume::Grid& grid : other.grids) {
    const std::string name = grid.name();
    for (const volume::Grid& known : content.grids)
      if (known.name() == name)
        throw ConfigError(fmt::format(
            "{}: another input of this frame also has a grid '{}'; convert them to separate files",
            otherPath, name));
  }
  std::move(other.grids.begin(), other.grids.end(), std::back_inserter(content.grids));
  std::move(other.particles.begin(), other.particles.end(), std::back_inserter(content.particles));
  std::move(other.particleNames.begin(), other.particleNames.end(),
            std::back_inserter(content.particleNames));
  std::move(other.notes.begin(), other.notes.end(), std::back_inserter(content.notes));
  content.metadata.merge(other.metadata);
}

}  // namespace photosphere::cli
