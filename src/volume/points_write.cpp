// Particle set to OpenVDB points. One of the two sources that include openvdb/points.

#include <fmt/format.h>
#include <openvdb/points/PointAttribute.h>
#include <openvdb/points/PointDataGrid.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstring>
#include <set>

#include "openvdb_grid.h"
#include "photosphere/core/error.h"
#include "photosphere/core/log.h"
#include "photosphere/core/parallel.h"
#include "photosphere/volume/vdb_file.h"
#include "point_bins.h"

namespace photosphere::volume {

namespace {

namespace pts = openvdb::points;
using PointGrid = pts::PointDataGrid;
using PointTree = pts::PointDataTree;
using PointLeaf = PointTree::LeafNodeType;
using Positions = pts::TypedAttributeArray<openvdb::Vec3f, pts::NullCodec>;

// A leaf and the binned particles that it holds.
struct WrittenLeaf {
  PointLeaf* leaf;
  std::size_t begin, end;
};

PointLeaf* makeLeaf(const std::vector<PointBin>& bins, std::size_t begin, std::size_t end,
                    const pts::AttributeSet::Descriptor::Ptr& descriptor) {
  const Vec3i block = bins[begin].block;
  auto* leaf = new PointLeaf(openvdb::Coord(block.x * 8, block.y * 8, block.z * 8), 0u, false);
  leaf->initializeAttributes(descriptor, static_cast<openvdb::Index>(end - begin));
  std::vector<PointLeaf::ValueType> offsets(PointLeaf::SIZE);
  std::size_t next = begin;
  for (openvdb::Index voxel = 0; voxel < PointLeaf::SIZE; ++voxel) {
    while (next < end && bins[next].voxel == voxel)
      ++next;
    offsets[voxel] = static_cast<openvdb::PointDataIndex32>(next - begin);
  }
  leaf->setOffsets(offsets);
  return leaf;
}

std::vector<WrittenLeaf> makeLeaves(PointTree& tree, const std::vector<PointBin>& bins) {
  const auto descriptor = pts::AttributeSet::Descriptor::create(Positions::attributeType());
  std::vector<WrittenLeaf> leaves;
  for (std::size_t begin = 0; begin < bins.size();) {
    std::size_t end = begin + 1;
    while (end < bins.size() && bins[end].block == bins[begin].block)
      ++end;
    PointLeaf* leaf = makeLeaf(bins, begin, end, descriptor);
    tree.addLeaf(leaf);
    leaves.push_back({leaf, begin, end});
    begin = end;
  }
  return leaves;
}

// Calls fill(array, range) for the attribute `name` of every leaf.
template <class Fill>
void forEachLeaf(const std::vector<WrittenLeaf>& leaves, const std::string& name,
                 const Fill& fill) {
  parallelFor(leaves.size(), 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      fill(leaves[i].leaf->attributeArray(name), leaves[i]);
  });
}

void writePositions(const std::vector<WrittenLeaf>& leaves, const std::vector<PointBin>& bins,
                    const ParticleSet& particles, const openvdb::math::Transform& transform) {
  forEachLeaf(leaves, "P", [&](pts::AttributeArray& array, const WrittenLeaf& range) {
    pts::AttributeWriteHandle<openvdb::Vec3f, pts::NullCodec> handle(array);
    for (std::size_t i = range.begin; i < range.end; ++i) {
      const openvdb::Vec3d index =
          transform.worldToIndex(toOpenVdb(particles.positions[bins[i].particle]));
      handle.set(static_cast<openvdb::Index>(i - range.begin),
                 openvdb::Vec3f(index - bins[i].center()));
    }
  });
}

// `Value` is what OpenVDB stores, one of them per `Stride` slots of the attribute.
template <class Value, class Element>
void writeValues(PointTree& tree, const std::vector<WrittenLeaf>& leaves,
                 const std::vector<PointBin>& bins, const Attribute& attribute,
                 const std::string& name, const std::vector<Element>& column) {
  constexpr bool isVector = !std::is_same_v<Value, Element>;
  const std::size_t arity = static_cast<std::size_t>(attribute.arity);
  const auto stride = static_cast<openvdb::Index>(isVector ? 1 : arity);
  pts::appendAttribute<Value>(tree, name, openvdb::zeroVal<Value>(), stride);
  forEachLeaf(leaves, name, [&](pts::AttributeArray& array, const WrittenLeaf& range) {
    pts::AttributeWriteHandle<Value, pts::NullCodec> handle(array);
    for (std::size_t i = range.begin; i < range.end; ++i) {
      const Element* source = column.data() + arity * bins[i].particle;
      const auto n = static_cast<openvdb::Index>(i - range.begin);
      if constexpr (isVector)
        handle.set(n, Value(source[0], source[1], source[2]));
      else
        for (openvdb::Index c = 0; c < stride; ++c)
          handle.set(n, c, source[c]);
    }
  });
}

void writeStrings(PointTree& tree, const std::vector<WrittenLeaf>& leaves,
                  const std::vector<PointBin>& bins, const Attribute& attribute,
                  const std::string& name, const std::vector<std::string>& column) {
  const std::size_t arity = static_cast<std::size_t>(attribute.arity);
  pts::appendAttribute(tree, name, pts::StringAttributeArray::attributeType(),
                       static_cast<openvdb::Index>(arity));
  if (leaves.empty()) return;
  openvdb::MetaMap& strings =
      pts::makeDescriptorUnique(tree)->getMetadata();  // shared by all leaves
  pts::StringMetaInserter inserter(strings);
  for (const PointBin& bin : bins)
    for (std::size_t c = 0; c < arity; ++c) {
      const std::string& text = column[arity * bin.particle + c];
      if (!text.empty()) inserter.insert(text);
    }
  forEachLeaf(leaves, name, [&](pts::AttributeArray& array, const WrittenLeaf& range) {
    pts::StringAttributeWriteHandle handle(array, strings);
    for (std::size_t i = range.begin; i < range.end; ++i)
      for (std::size_t c = 0; c < arity; ++c)
        handle.set(static_cast<openvdb::Index>(i - range.begin), static_cast<openvdb::Index>(c),
                   column[arity * bins[i].particle + c]);
  });
}

template <class Element>
struct VectorOf;
template <>
struct VectorOf<float> {
  using Type = openvdb::Vec3f;
};
template <>
struct VectorOf<double> {
  using Type = openvdb::Vec3d;
};
template <>
struct VectorOf<std::int32_t> {
  using Type = openvdb::Vec3i;
};

void writeAttribute(PointTree& tree, const std::vector<WrittenLeaf>& leaves,
                    const std::vector<PointBin>& bins, const Attribute& attribute,
                    const std::string& name) {
  std::visit(
      [&]<class Element>(const std::vector<Element>& column) {
        if constexpr (std::is_same_v<Element, std::string>) {
          writeStrings(tree, leaves, bins, attribute, name, column);
        } else {
          // OpenVDB has no vector of three 64-bit integers.
          if constexpr (!std::is_same_v<Element, std::int64_t>)
            if (attribute.arity == 3) {
              using Vector = typename VectorOf<Element>::Type;
              writeValues<Vector>(tree, leaves, bins, attribute, name, column);
              return;
            }
          writeValues<Element>(tree, leaves, bins, attribute, name, column);
        }
      },
      attribute.data);
}

// Letters, digits and `_|:` are what OpenVDB accepts.
bool isStorable(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) || (c != 0 && std::strchr("_|:", c));
}

// @param taken  names of others, and of those that stay as they are
std::string storedName(const std::string& name, std::set<std::string>& taken) {
  if (taken.count(name) != 0 && name != "P") return name;
  std::string result = name;
  for (char& c : result)
    if (!isStorable(c)) c = '_';
  if (result.empty() || result == "P")
    throw ConfigError(fmt::format("a point attribute cannot be named \"{}\"", name));
  while (!taken.insert(result).second)
    result += '_';
  if (result != name)
    log::warning("attribute \"{}\" is stored as \"{}\": OpenVDB takes letters, digits, _, | and :",
                 name, result);
  return result;
}

void checkColumn(const Attribute& attribute, std::size_t particles) {
  const std::size_t values =
      std::visit([](const auto& column) { return column.size(); }, attribute.data);
  if (attribute.arity < 1 || values != particles * static_cast<std::size_t>(attribute.arity))
    throw ConfigError(fmt::format("attribute \"{}\" has {} values of arity {} for {} particles",
                                  attribute.name, values, attribute.arity, particles));
}

}  // namespace

Grid pointsToGrid(const ParticleSet& particles, std::string_view name, double voxelSize) {
  for (const Attribute& attribute : particles.attributes)
    checkColumn(attribute, particles.size());
  initializeOpenVdb();
  if (voxelSize < 0 || !std::isfinite(voxelSize))
    throw ConfigError(fmt::format("the point voxel size must be positive, not {}", voxelSize));
  if (voxelSize == 0) voxelSize = pointVoxelSize(particles.positions);
  const auto transform = makeTransform(worldFromPointIndex(particles.positions, voxelSize));
  const std::vector<PointBin> bins = binPoints(particles.positions, *transform);
  if (bins.size() < particles.size())
    log::warning("{} particles with a position that is not finite are left out of \"{}\"",
                 particles.size() - bins.size(), name);

  auto tree = std::make_shared<PointTree>();
  const std::vector<WrittenLeaf> leaves = makeLeaves(*tree, bins);
  writePositions(leaves, bins, particles, *transform);
  std::set<std::string> names;
  for (const Attribute& attribute : particles.attributes)
    if (std::all_of(attribute.name.begin(), attribute.name.end(), isStorable))
      names.insert(attribute.name);
  for (const Attribute& attribute : particles.attributes)
    writeAttribute(*tree, leaves, bins, attribute, storedName(attribute.name, names));

  auto grid = PointGrid::create(tree);
  grid->setTransform(transform);
  grid->setName(std::string(name));
  for (const auto& [key, value] : particles.metadata)
    if (!isGridBookkeeping(key)) grid->insertMeta(key, openvdb::StringMetadata(value));
  return Grid(grid);
}

}  // namespace photosphere::volume
