// OpenVDB points to particle set. One of the two sources that include openvdb/points.

#include <fmt/format.h>
#include <openvdb/points/AttributeArrayString.h>
#include <openvdb/points/PointDataGrid.h>

#include <limits>
#include <new>
#include <stdexcept>
#include <type_traits>

#include "crash_guard.h"
#include "openvdb_grid.h"
#include "photosphere/core/error.h"
#include "photosphere/core/exhaustion.h"
#include "photosphere/core/log.h"
#include "photosphere/core/parallel.h"
#include "photosphere/core/resources.h"
#include "photosphere/volume/vdb_file.h"
#include "point_bins.h"

namespace photosphere::volume {

namespace {

namespace pts = openvdb::points;
using PointLeaf = pts::PointDataTree::LeafNodeType;

struct ReadLeaf {
  const PointLeaf* leaf;
  std::size_t begin;  ///< its first particle's place in the set
};

class PointReader {
 public:
  explicit PointReader(const Grid& grid)
      : m_name(describe(grid)), m_grid(openvdb::gridPtrCast<pts::PointDataGrid>(grid.base())) {
    if (!m_grid) throw InputError(m_name, "is not a point grid");
    for (auto leaf = m_grid->tree().cbeginLeaf(); leaf; ++leaf) {
      const std::size_t points = countPoints(*leaf);
      if (points > 0) m_leaves.push_back({&*leaf, m_size});
      m_size += points;
    }
  }

  ParticleSet read() {
    ParticleSet result;
    m_room = availableMemoryBytes();
    readPositions(result);
    if (!m_leaves.empty()) {
      const pts::AttributeSet& set = m_leaves.front().leaf->attributeSet();
      std::vector<std::string> names(set.size());  // in the order of the file
      for (const auto& [name, place] : set.descriptor().map())
        if (place < names.size()) names[place] = name;
      for (std::size_t i = 0; i < set.size(); ++i)
        if (!names[i].empty() && names[i] != "P") readAttribute(names[i], *set.getConst(i), result);
    }
    for (auto it = m_grid->beginMeta(); it != m_grid->endMeta(); ++it)
      if (it->second && !isGridBookkeeping(it->first))
        result.metadata[it->first] = it->second->str();
    return result;
  }

 private:
  // The offsets come from the file: they must rise and end where the attribute arrays end.
  std::size_t countPoints(const PointLeaf& leaf) const {
    try {
      leaf.validateOffsets();
    } catch (const openvdb::Exception& error) {
      throw InputError(m_name, fmt::format("is damaged: {}", error.what()));
    }
    // OpenVDB asserts, which ends the process, where a name stands for a column that is not there.
    const pts::AttributeSet& set = leaf.attributeSet();
    for (const auto& [name, place] : set.descriptor().map())
      if (place >= set.size())
        throw InputError(m_name, fmt::format("is damaged: attribute \"{}\" has no values", name));
    return leaf.pointCount();
  }

  const pts::AttributeArray& array(const PointLeaf& leaf, const std::string& name,
                                   const openvdb::Name& type, openvdb::Index stride) const {
    const pts::AttributeArray* found =
        leaf.hasAttribute(name) ? &leaf.constAttributeArray(name) : nullptr;
    if (!found || found->valueType() != type || found->stride() != stride ||
        found->size() < leaf.pointCount())
      throw InputError(m_name,
                       fmt::format("is damaged: attribute \"{}\" differs between the leaf "
                                   "at {}, {}, {} and the first one",
                                   name, leaf.origin().x(), leaf.origin().y(), leaf.origin().z()));
    return *found;
  }

  /// Before memory is taken: a column of one value for all points takes none in the file.
  void take(std::uint64_t bytesPerPoint) {
    if (bytesPerPoint > 0 && m_size > m_room / bytesPerPoint)
      throw MemoryError(
          fmt::format("{}: its {} points need {} bytes each and more, but {} of memory "
                      "are free; thin them out, or use a machine with more memory",
                      m_name, m_size, bytesPerPoint, formatBytes(m_room)));
    m_room -= bytesPerPoint * m_size;
  }

  template <class Body>
  void forEachLeaf(const Body& body) const {
    parallelFor(m_leaves.size(), 16, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i)
        body(*m_leaves[i].leaf, m_leaves[i].begin);
    });
  }

  void readPositions(ParticleSet& result) {
    take(sizeof(Vec3d));
    result.positions.resize(m_size);
    const openvdb::math::Transform& transform = m_grid->transform();
    forEachLeaf([&](const PointLeaf& leaf, std::size_t begin) {
      const pts::AttributeHandle<openvdb::Vec3f> handle(array(leaf, "P", "vec3s", 1));
      openvdb::Index next = 0;
      for (openvdb::Index voxel = 0; voxel < PointLeaf::SIZE; ++voxel) {
        const openvdb::Vec3d center = leaf.offsetToGlobalCoord(voxel).asVec3d();
        const openvdb::Index end = leaf.getValue(voxel);
        for (; next < end; ++next)
          result.positions[begin + next] =
              fromOpenVdb(transform.indexToWorld(center + openvdb::Vec3d(handle.get(next))));
      }
    });
  }

  // `Value` as OpenVDB stores it, in `Components` elements of the column.
  template <class Value, class Element, int Components>
  void readValues(const std::string& name, const pts::AttributeArray& first, ParticleSet& result) {
    const openvdb::Name type = first.valueType();
    const openvdb::Index stride = first.stride();
    const std::size_t arity = static_cast<std::size_t>(stride) * Components;
    take(arity * sizeof(Element));
    std::vector<Element> column(arity * m_size);
    forEachLeaf([&](const PointLeaf& leaf, std::size_t begin) {
      const pts::AttributeHandle<Value> handle(array(leaf, name, type, stride));
      Element* target = column.data() + arity * begin;
      const auto count = static_cast<openvdb::Index>(leaf.pointCount());
      for (openvdb::Index n = 0; n < count; ++n)
        for (openvdb::Index m = 0; m < stride; ++m) {
          const Value value = handle.get(n, m);
          if constexpr (Components == 1)
            *target++ = static_cast<Element>(value);
          else if constexpr (Components == 4)  // a quaternion, which has no asPointer()
            for (int c = 0; c < Components; ++c)
              *target++ = value(c);
          else
            for (int c = 0; c < Components; ++c)
              *target++ = value.asPointer()[c];
        }
    });
    result.attributes.push_back({name, static_cast<int>(arity), std::move(column)});
  }

  void readStrings(const std::string& name, const pts::AttributeArray& first, ParticleSet& result) {
    const openvdb::Index stride = first.stride();
    take(stride * sizeof(std::string));
    std::vector<std::string> column(stride * m_size);
    forEachLeaf([&](const PointLeaf& leaf, std::size_t begin) {
      const pts::StringAttributeHandle handle(array(leaf, name, first.valueType(), stride),
                                              leaf.attributeSet().descriptor().getMetadata());
      const auto count = static_cast<openvdb::Index>(leaf.pointCount());
      for (openvdb::Index n = 0; n < count; ++n)
        for (openvdb::Index m = 0; m < stride; ++m)
          column[(begin + n) * stride + m] = handle.get(n, m);
    });
    result.attributes.push_back({name, static_cast<int>(stride), std::move(column)});
  }

  void readAttribute(const std::string& name, const pts::AttributeArray& first,
                     ParticleSet& result) {
    const std::string type = first.valueType();
    if (pts::isGroup(first)) return;  // membership flags of an editor, nothing to render
    if (!first.hasConstantStride() || first.stride() == 0) {
      log::warning("{}: attribute \"{}\" has a varying number of values a point; left out", m_name,
                   name);
      return;
    }
    if (pts::isString(first)) return readStrings(name, first, result);
    if (type == "bool") return readValues<bool, std::int32_t, 1>(name, first, result);
    if (type == "int8") return readValues<std::int8_t, std::int32_t, 1>(name, first, result);
    if (type == "int16") return readValues<std::int16_t, std::int32_t, 1>(name, first, result);
    if (type == "int32") return readValues<std::int32_t, std::int32_t, 1>(name, first, result);
    if (type == "int64") return readValues<std::int64_t, std::int64_t, 1>(name, first, result);
    if (type == "float") return readValues<float, float, 1>(name, first, result);
    if (type == "double") return readValues<double, double, 1>(name, first, result);
    if (type == "vec3s") return readValues<openvdb::Vec3f, float, 3>(name, first, result);
    if (type == "vec3d") return readValues<openvdb::Vec3d, double, 3>(name, first, result);
    if (type == "vec3i") return readValues<openvdb::Vec3i, std::int32_t, 3>(name, first, result);
    if (type == "quats") return readValues<openvdb::Quats, float, 4>(name, first, result);
    if (type == "quatd") return readValues<openvdb::Quatd, double, 4>(name, first, result);
    if (type == "mat3s") return readValues<openvdb::Mat3s, float, 9>(name, first, result);
    if (type == "mat3d") return readValues<openvdb::Mat3d, double, 9>(name, first, result);
    if (type == "mat4s") return readValues<openvdb::Mat4s, float, 16>(name, first, result);
    if (type == "mat4d") return readValues<openvdb::Mat4d, double, 16>(name, first, result);
    log::warning("{}: attribute \"{}\" has type {}, which is not supported; left out", m_name, name,
                 type);
  }

  std::string m_name;
  std::shared_ptr<const pts::PointDataGrid> m_grid;
  std::vector<ReadLeaf> m_leaves;
  std::size_t m_size = 0;
  std::uint64_t m_room = 0;  ///< memory that is not spoken for [bytes]
};

}  // namespace

ParticleSet gridToPoints(const Grid& grid) {
  if (!grid) throw InputError("point grid", "is missing");
  initializeOpenVdb();
  const CrashGuard guard(describe(grid));  // what a damaged file holds may pass reading it
  try {
    return PointReader(grid).read();
  } catch (const openvdb::Exception& error) {
    throw InputError(describe(grid), std::string("is damaged: ") + error.what());
  } catch (const std::bad_alloc&) {
    if (freeAddresses() < std::numeric_limits<std::uint64_t>::max())
      throw MemoryError(describe(grid) + ": " + kRanOutReading);
    throw InputError(describe(grid), "claims more points than there is memory for");
  } catch (const std::length_error&) {
    throw InputError(describe(grid), "claims more points than there is memory for");
  }
}

}  // namespace photosphere::volume
