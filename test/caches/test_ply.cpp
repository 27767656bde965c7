#include <gtest/gtest.h>

#include <cmath>

#include "photosphere/caches/cache_format.h"
#include "photosphere/core/error.h"
#include "support/support.h"

namespace photosphere::caches {
namespace {

using test::TemporaryFolder;

volume::ParticleSet readText(const std::string& text) {
  TemporaryFolder folder;
  test::writeText(folder / "a.ply", text);
  CacheContent content = readCache(folder / "a.ply");
  EXPECT_EQ(content.particles.size(), 1u);
  return content.particles.front();
}

TEST(Ply, GroupsPropertiesUnderHoudiniNames) {
  const volume::ParticleSet set = readText(
      "ply\r\nformat ascii 1.0\r\ncomment a b\r\nelement vertex 2\r\nproperty float x\r\nproperty "
      "float y\r\nproperty double z\r\nproperty uchar red\r\nproperty uchar green\r\nproperty "
      "uchar "
      "blue\r\nproperty float vx\r\nproperty float vy\r\nproperty float vz\r\nproperty float "
      "radius\r\nproperty uint id\r\nend_header\r\n1 2 3.25 255 0 51 4 5 6 .5 4294967295\r\n"
      "-1e-1 +2 nan 255.0 0 51 4 5 6 .5 7\r\n");
  ASSERT_EQ(set.size(), 2u);
  EXPECT_EQ(set.positions[0], Vec3d(1, 2, 3.25));
  EXPECT_EQ(set.positions[1].x, static_cast<double>(-0.1f));
  EXPECT_TRUE(std::isnan(set.positions[1].z));
  ASSERT_NE(set.find("Cd"), nullptr);
  EXPECT_EQ(set.find("Cd")->arity, 3);
  EXPECT_FLOAT_EQ(static_cast<float>(set.find("Cd")->number(1, 2)), 0.2f);
  ASSERT_NE(set.find("v"), nullptr);
  EXPECT_EQ(set.find("v")->number(1, 1), 5);
  ASSERT_NE(set.find("pscale"), nullptr);
  EXPECT_EQ(set.find("pscale")->number(0), 0.5);
  EXPECT_EQ(set.find("id")->number(0), 4294967295.0);
}

TEST(Ply, PassesOverListsAndOtherElements) {
  const std::string header =
      "element skipped 2\nproperty list uchar int items\nproperty short s\nelement vertex "
      "1\nproperty list uchar float w\nproperty float x\nproperty float y\nproperty float z\n"
      "element face 1\nproperty list uchar int vertex_indices\nend_header\n";
  const volume::ParticleSet ascii =
      readText("ply\nformat ascii 1.0\n" + header + "3 1 2 3 9\n0 9\n2 7 7 1 2 3\n3 0 0 0\n");
  EXPECT_EQ(ascii.positions.at(0), Vec3d(1, 2, 3));
  std::string body("\x01\0\0\0\x05\0\x09\0\0\x09\x01\x40\0\0\0", 15);
  body += std::string("\x3f\x80\0\0\x40\0\0\0\x40\x40\0\0", 12) + '\0';
  const volume::ParticleSet big = readText("ply\nformat binary_big_endian 1.0\n" + header + body);
  EXPECT_EQ(big.positions.at(0), Vec3d(1, 2, 3));
}

TEST(Ply, RefusesACountThatTheFileCannotHold) {
  const std::string header =
      "element vertex 99999999999\nproperty float x\nproperty float y\nproperty float "
      "z\nend_header\n0 0 0\n";
  EXPECT_THROW(readText("ply\nformat ascii 1.0\n" + header), InputError);
  EXPECT_THROW(readText("ply\nformat binary_little_endian 1.0\n" + header), InputError);
}

TEST(Ply, RefusesPropertiesOfOneName) {
  const std::string text =
      "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
      "property float z\nproperty float x\nend_header\n1 2 3 4\n";
  try {
    readText(text);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("several properties 'x'"), std::string::npos)
        << error.what();
  }
}

TEST(Ply, RefusesMoreThanItsHeaderCounts) {
  const std::string header =
      "element vertex 1\nproperty char x\nproperty char y\nproperty char z\nelement edge "
      "1\nproperty char a\nend_header\n";
  const auto refusal = [&](const std::string& format, const std::string& data) -> std::string {
    try {
      readText("ply\nformat " + format + " 1.0\n" + header + data);
    } catch (const InputError& error) {
      return error.what();
    }
    return "read";
  };
  EXPECT_EQ(refusal("ascii", "1 2 3\n4\n \n\r\n"), "read");
  EXPECT_EQ(refusal("binary_little_endian", "xyza"), "read");
  EXPECT_EQ(refusal("binary_little_endian", "xyza\r\n"), "read");
  EXPECT_NE(refusal("ascii", "1 2 3 4\n5\n").find("line 10"), std::string::npos);
  EXPECT_NE(refusal("ascii", "1 2 3\n4\n5\n").find("2 bytes after the last"), std::string::npos);
  EXPECT_NE(refusal("binary_big_endian", "xyzab").find("1 bytes after"), std::string::npos);
  EXPECT_NE(refusal("binary_big_endian", "xyza   ").find("3 bytes after"), std::string::npos);
  EXPECT_NE(refusal("ascii", "1 2 3\n").find("edge"), std::string::npos);
}

TEST(Ply, NamesTheLineOfABadNumber) {
  try {
    readText(
        "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty "
        "float z\nend_header\n0 0 0\n0 zero 0\n");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("line 9"), std::string::npos) << error.what();
  }
}

TEST(Ply, ReadsFilesOfOtherPrograms) {
  FOREIGN_CACHE(folder, "text_ply_pdal");
  EXPECT_EQ(readCache(folder / "simple_binary.ply").particles.at(0).positions.at(2),
            Vec3d(1, 0, 0));
  EXPECT_EQ(readCache(folder / "simple_text.ply").particles.at(0).positions.at(1), Vec3d(0, 1, 0));
  const CacheContent mesh = readCache(folder / "mesh.ply");
  EXPECT_EQ(mesh.particles.at(0).bounds().max, Vec3d(2, 2, 2));
  EXPECT_EQ(mesh.notes.size(), 1u);
}

}  // namespace
}  // namespace photosphere::caches
