#include <gtest/gtest.h>

#include "photosphere/caches/cache_format.h"
#include "photosphere/core/error.h"
#include "support/support.h"

namespace photosphere::caches {
namespace {

using test::TemporaryFolder;

std::string refusal(const std::filesystem::path& path) {
  try {
    detectFormat(path);
  } catch (const InputError& error) {
    return error.what();
  }
  return "no error";
}

TEST(DetectFormat, GoesByContentBeforeTheName) {
  TemporaryFolder folder;
  test::writeText(folder / "misnamed.csv", "ply\nformat ascii 1.0\n");
  EXPECT_EQ(detectFormat(folder / "misnamed.csv").name, "ply");
  test::writeText(folder / "UPPER.CSV", "x,y,z\n");
  EXPECT_EQ(detectFormat(folder / "UPPER.CSV").name, "csv");
  test::writeText(folder / "a.ply", "something else");
  EXPECT_NE(refusal(folder / "a.ply").find("damaged or misnamed"), std::string::npos);
  test::writeText(folder / "a.unknown", "something else");
  EXPECT_NE(refusal(folder / "a.unknown").find(".prt"), std::string::npos);
  test::writeText(folder / "empty.csv", "");
  EXPECT_NE(refusal(folder / "empty.csv").find("empty"), std::string::npos);
}

TEST(DetectFormat, SaysWhatIsMissing) {
  TemporaryFolder folder;
  EXPECT_THROW(detectFormat(folder / "none.ply"), InputMissingError);
  EXPECT_THROW(detectFormat(folder.path()), InputMissingError);
}

struct Foreign {
  const char* file;
  std::string head;
  const char* word;
};

TEST(DetectFormat, TellsWhatToExportInsteadOfForeignFormats) {
  using namespace std::string_literals;
  TemporaryFolder folder;
  const Foreign cases[] = {
      {"a.f3d", "data", "OpenVDB"},
      {"a.usdc", "PXR-USDC", "USD"},
      {"a.usd", "data", "USD"},
      {"a.las", "LASF", "LAS"},
      {"a.e57", "ASTM-E57", "E57"},
      {"a.abc", "Ogawa\xFF", "Alembic"},
      {"b.abc", "\x89HDF\r\n\x1A\n"s, "HDF5"},
      {"a.bgeo.sc", "scf1", "Houdini"},
      {"a.bgeo", "\x7FNSJb", "Houdini"},
      {"a.BGEO", "gzipped", "Houdini"},
      {"a.geo", "PGEOMETRY V5", "Houdini"},
      {"a.mc", "FOR4", "Maya"},
      {"a.pdc", "PDC ", "Maya"},
      {"a.bphys", "BPHYSICS", "Blender"},
      {"a.bin", "\xDA\xBA\xFA\0\0"s, "RealFlow"},
      {"a.vtk", "# vtk DataFile Version 4.1", "VTK"},
      {"a.vti", "<?xml?><VTKFile>", "VTK"},
      {"a.nvdb", "NanoVDB0", "NanoVDB"},
      {"a.prt", "\xC0PRT2\r\n\x1A"s, "PRT version 2"},
      {"a.sprt", "data", ".sprt"},
  };
  for (const Foreign& foreign : cases) {
    test::writeText(folder / foreign.file, foreign.head);
    const std::string message = refusal(folder / foreign.file);
    EXPECT_NE(message.find(foreign.word), std::string::npos) << message;
    EXPECT_NE(message.find("does not read"), std::string::npos) << message;
  }
}

TEST(DetectFormat, KnowsRealForeignFiles) {
  FOREIGN_CACHE(folder, "");
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    const std::string extension = entry.path().extension().string();
    if (extension == ".bgeo" || extension == ".geo" || extension == ".sc" || extension == ".abc" ||
        extension == ".mc" || extension == ".pdc" || extension == ".bphys") {
      EXPECT_NE(refusal(entry.path()).find("does not read"), std::string::npos) << entry.path();
    }
  }
}

}  // namespace
}  // namespace photosphere::caches
