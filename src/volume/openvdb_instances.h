#pragma once
// The library of OpenVDB holds its own grids compiled, and exports them. They are not compiled
// again in every source that uses one, which takes minutes, where the build found that this program
// links (src/volume/CMakeLists.txt). Members that the library has inlined everywhere are not among
// its symbols, and GCC inlines them here too when it optimises; clang++ leaves some as calls.

#include <openvdb/openvdb.h>

#if defined(PHOTOSPHERE_OPENVDB_EXPORTS_GRIDS) && !defined(__NO_INLINE__) && \
    !defined(__OPTIMIZE_SIZE__)
#define PHOTOSPHERE_COMPILED_GRID(GridT)                \
  extern template class openvdb::Grid<GridT::TreeType>; \
  extern template class openvdb::tree::Tree<GridT::TreeType::RootNodeType>;
PHOTOSPHERE_COMPILED_GRID(openvdb::BoolGrid)
PHOTOSPHERE_COMPILED_GRID(openvdb::FloatGrid)
PHOTOSPHERE_COMPILED_GRID(openvdb::DoubleGrid)
PHOTOSPHERE_COMPILED_GRID(openvdb::Int32Grid)
PHOTOSPHERE_COMPILED_GRID(openvdb::Int64Grid)
PHOTOSPHERE_COMPILED_GRID(openvdb::Vec3IGrid)
PHOTOSPHERE_COMPILED_GRID(openvdb::Vec3SGrid)
PHOTOSPHERE_COMPILED_GRID(openvdb::Vec3DGrid)
#undef PHOTOSPHERE_COMPILED_GRID
#endif
