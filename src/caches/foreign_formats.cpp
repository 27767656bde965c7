#include "foreign_formats.h"

namespace photosphere::caches {

using namespace std::string_view_literals;

namespace {

constexpr auto kHoudini =
    "export .vdb from Houdini (Convert VDB or a VDB from Particles, File Cache)"sv;
constexpr auto kPoints = "export .vdb points, .ply or .csv instead"sv;

constexpr ForeignFormat kField3d{
    "Field3D", "export OpenVDB (.vdb), which every tool that writes Field3D also writes"};
constexpr ForeignFormat kUsd{"USD", "export the volume's .vdb assets, or the points as .ply"};
constexpr ForeignFormat kLas{"LAS/LAZ", "convert to .ply, .csv or .xyz (CloudCompare, PDAL)"};
constexpr ForeignFormat kE57{"E57", "convert to .ply or .xyz (CloudCompare)"};
constexpr ForeignFormat kAlembic{"Alembic", kPoints};
constexpr ForeignFormat kHdf5{"HDF5 (Alembic or Field3D of old writers)",
                              "export .vdb grids, or particles as .ply or .csv"};
constexpr ForeignFormat kBgeo{"Houdini geometry", kHoudini};
constexpr ForeignFormat kMaya{"Maya nCache or PDC", "export .vdb or Krakatoa .prt from Maya"};
constexpr ForeignFormat kBphys{"Blender point cache",
                               "export the particle system as .ply or .csv, or bake to OpenVDB"};
constexpr ForeignFormat kRealflow{"RealFlow .bin", "export .prt, .vdb or .csv from RealFlow"};
constexpr ForeignFormat kVtk{"VTK", "export .vdb, or the points as .ply or .csv from ParaView"};
constexpr ForeignFormat kNanovdb{"NanoVDB",
                                 "convert to OpenVDB with `nanovdb_convert in.nvdb out.vdb`"};
constexpr ForeignFormat kPrt2{
    "PRT version 2",
    "save as Krakatoa PRT version 1 (.prt with the PRT 1 file type), .ply or .csv"};
constexpr ForeignFormat kSprt{"Krakatoa .sprt", "save as .prt, .ply or .csv"};
constexpr ForeignFormat kNumpy{"NumPy", "write .vdb with pyopenvdb (`grid.copyFromArray`) instead"};
constexpr ForeignFormat kPcd{"PCD", "convert to .ply (`pcl_pcd2ply`)"};

struct ByContent {
  std::string_view head;
  const ForeignFormat* format;
};
constexpr ByContent kContents[] = {
    {"\xC0PRT2\r\n\x1A"sv, &kPrt2},
    {"\x89HDF\r\n\x1A\n"sv, &kHdf5},
    {"Ogawa"sv, &kAlembic},
    {"PXR-USDC"sv, &kUsd},
    {"#usda"sv, &kUsd},
    {"LASF"sv, &kLas},
    {"ASTM-E57"sv, &kE57},
    {"scf1"sv, &kBgeo},
    {"\x7FNSJb"sv, &kBgeo},
    {"\x7F"
     "bJSN"sv,
     &kBgeo},
    {"BgeoV"sv, &kBgeo},
    {"PGEOMETRY"sv, &kBgeo},
    {"[\n\t\"fileversion\""sv, &kBgeo},
    {"FOR4"sv, &kMaya},
    {"FOR8"sv, &kMaya},
    {"PDC "sv, &kMaya},
    {"BPHYSICS"sv, &kBphys},
    {"\xDA\xBA\xFA\x00"sv, &kRealflow},
    {"# vtk DataFile"sv, &kVtk},
    {"<VTKFile"sv, &kVtk},
    {"NanoVDB"sv, &kNanovdb},
    {"\x93NUMPY"sv, &kNumpy},
    {"# .PCD"sv, &kPcd},
};

struct ByName {
  std::string_view ending;
  const ForeignFormat* format;
};
constexpr ByName kNames[] = {
    {".f3d", &kField3d},  {".usd", &kUsd},     {".usda", &kUsd},     {".usdc", &kUsd},
    {".usdz", &kUsd},     {".las", &kLas},     {".laz", &kLas},      {".e57", &kE57},
    {".abc", &kAlembic},  {".bgeo", &kBgeo},   {".bgeo.sc", &kBgeo}, {".bgeo.gz", &kBgeo},
    {".bgeosc", &kBgeo},  {".bgeogz", &kBgeo}, {".geo", &kBgeo},     {".geo.gz", &kBgeo},
    {".mc", &kMaya},      {".mcx", &kMaya},    {".pdc", &kMaya},     {".bphys", &kBphys},
    {".bin", &kRealflow}, {".vtk", &kVtk},     {".vti", &kVtk},      {".vtp", &kVtk},
    {".vtu", &kVtk},      {".vtr", &kVtk},     {".vts", &kVtk},      {".pvd", &kVtk},
    {".nvdb", &kNanovdb}, {".sprt", &kSprt},   {".h5", &kHdf5},      {".hdf5", &kHdf5},
    {".npy", &kNumpy},    {".npz", &kNumpy},   {".pcd", &kPcd},
};

}  // namespace

const ForeignFormat* foreignByContent(std::string_view head) {
  for (const ByContent& entry : kContents)
    if (head.starts_with(entry.head)) return entry.format;
  return nullptr;
}

const ForeignFormat* foreignByName(std::string_view name) {
  for (const ByName& entry : kNames)
    if (name.ends_with(entry.ending)) return entry.format;
  return nullptr;
}

}  // namespace photosphere::caches
