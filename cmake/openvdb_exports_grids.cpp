// Links where OpenVDB's library exports its grids: src/volume/CMakeLists.txt tries.
#include "openvdb_instances.h"

template <class GridT>
openvdb::Index64 use() {
  const auto grid = GridT::create();
  grid->fill(openvdb::CoordBBox(openvdb::Coord(0), openvdb::Coord(1)),
             typename GridT::ValueType(1));
  grid->pruneGrid();
  return grid->deepCopyGrid()->memUsage();
}

int main() {
  using namespace openvdb;
  const Index64 bytes = use<BoolGrid>() + use<FloatGrid>() + use<DoubleGrid>() + use<Int32Grid>() +
                        use<Int64Grid>() + use<Vec3IGrid>() + use<Vec3SGrid>() + use<Vec3DGrid>();
  return bytes > 0 ? 0 : 1;
}
