#include <gtest/gtest.h>
#include <zlib.h>

#include <cstring>

#include "photosphere/caches/cache_format.h"
#include "photosphere/core/error.h"
#include "photosphere/volume/vdb_file.h"
#include "support/support.h"

namespace photosphere::caches {
namespace {

using test::TemporaryFolder;

template <class T>
T at(const std::string& bytes, std::size_t offset) {
  T value;
  std::memcpy(&value, bytes.data() + offset, sizeof value);
  return value;
}

TEST(Prt, ReadsFilesOfKrakatoa) {
  FOREIGN_CACHE(folder, "prt_thinkbox");
  const CacheContent fractal = readCache(folder / "prt_fractal_for_krscene.prt");
  ASSERT_EQ(fractal.particles.at(0).size(), 312u);
  EXPECT_EQ(fractal.metadata.at("LengthUnitInMeters"), "0.01");
  // The file's own BoundBox.
  const Box3d box = fractal.particles[0].bounds();
  const std::string header = test::readText(folder / "prt_fractal_for_krscene.prt").substr(0, 256);
  const std::size_t values = header.find("BoundBox") + 9 + 4;
  for (int c = 0; c < 3; ++c) {
    EXPECT_FLOAT_EQ(static_cast<float>(box.min[c]),
                    at<float>(header, values + 4 * static_cast<std::size_t>(c)));
    EXPECT_FLOAT_EQ(static_cast<float>(box.max[c]),
                    at<float>(header, values + 12 + 4 * static_cast<std::size_t>(c)));
  }
  for (const char* name : {"Cd", "v", "density"})
    EXPECT_NE(fractal.particles[0].find(name), nullptr) << name;

  const CacheContent corrupt = readCache(folder / "negative_eight.prt");
  EXPECT_EQ(corrupt.particles.at(0).size(), 1u);
  EXPECT_EQ(corrupt.particles[0].find("density")->number(0), 1);
  EXPECT_EQ(corrupt.notes.size(), 1u);
}

TEST(Prt, RefusesVersionTwoWithAdvice) {
  FOREIGN_CACHE(path, "prt_thinkbox/doubleFloat.prt");
  try {
    readCache(path);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("version 1"), std::string::npos) << error.what();
  }
}

CacheContent twoParticles() {
  CacheContent content;
  volume::ParticleSet set;
  set.positions = {Vec3d(1, 2, 3), Vec3d(-1, 0.5, 4)};
  set.add({"v", 3, std::vector<float>{1, 2, 3, 4, 5, 6}});
  set.add({"id", 1, std::vector<std::int64_t>{7, 8}});
  content.particles.push_back(set);
  content.particleNames.push_back("points");
  content.metadata["LengthUnitInMeters"] = "0.01";
  return content;
}

// A list of channels that claims more bytes of each particle than a record can have: few bytes of
// the file would become gigabytes of components, or a name looked up a million times.
TEST(Prt, ChannelsMustFitIntoARecord) {
  const TemporaryFolder folder;
  const auto path = folder / "two.prt";
  const CacheFormat& prt = formatForWriting("two.prt");
  prt.write(path, twoParticles(), ParamValues(prt.params));
  const std::string whole = test::readText(path);
  const std::string header = whole.substr(0, at<std::uint32_t>(whole, 8));
  const auto number = [](std::int32_t value) {
    std::string bytes(sizeof value, '\0');
    std::memcpy(bytes.data(), &value, sizeof value);
    return bytes;
  };
  const auto refusal = [&](std::int32_t channels, std::int32_t arity) {
    std::string text = header + number(4) + number(channels) + number(44);
    for (std::int32_t i = 0; i < channels; ++i) {
      std::string name = "Same";
      name.resize(32, '\0');
      text += name + number(9) + number(arity) + number(0);  // int8 at byte 0
    }
    test::writeText(path, text);
    try {
      readCache(path);
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string("read");
  };
  EXPECT_NE(refusal(64, 1 << 20).find("bytes a particle"), std::string::npos);
  EXPECT_NE(refusal(30000, 1).find("30000 channels"), std::string::npos);
}

/// Follows the published layout by hand, with no code of the reader's.
TEST(Prt, WritesTheDocumentedLayout) {
  TemporaryFolder folder;
  const CacheFormat& prt = formatForWriting("a.prt");
  prt.write(folder / "a.prt", twoParticles(), ParamValues(prt.params));
  const std::string bytes = test::readText(folder / "a.prt");
  EXPECT_EQ(bytes.substr(0, 8), std::string("\xC0PRT\r\n\x1A\n"));
  const auto header = static_cast<std::size_t>(at<std::int32_t>(bytes, 8));
  EXPECT_EQ(bytes.substr(12, 27), std::string("Extensible Particle Format") + '\0');
  EXPECT_EQ(at<std::int32_t>(bytes, 44), 2);
  EXPECT_EQ(at<std::int64_t>(bytes, 48), 2);
  std::size_t chunk = 56;
  while (bytes.substr(chunk, 4) == "Meta")
    chunk += 8 + static_cast<std::size_t>(at<std::int32_t>(bytes, chunk + 4));
  EXPECT_EQ(bytes.substr(chunk, 4), "Stop");
  EXPECT_EQ(chunk + 8, header);
  EXPECT_EQ(at<std::int32_t>(bytes, header), 4);
  ASSERT_EQ(at<std::int32_t>(bytes, header + 4), 3);
  EXPECT_EQ(at<std::int32_t>(bytes, header + 8), 44);
  const std::size_t channels = header + 12;
  EXPECT_STREQ(bytes.c_str() + channels, "Position");
  EXPECT_STREQ(bytes.c_str() + channels + 44, "Velocity");
  EXPECT_STREQ(bytes.c_str() + channels + 88, "ID");
  EXPECT_EQ(at<std::int32_t>(bytes, channels + 32), 4);       // float32
  EXPECT_EQ(at<std::int32_t>(bytes, channels + 88 + 32), 2);  // int64
  EXPECT_EQ(at<std::int32_t>(bytes, channels + 88 + 40), 24);
  std::string records(64, '\0');
  uLongf length = 64;
  const std::string packed = bytes.substr(channels + 3 * 44);
  ASSERT_EQ(uncompress(reinterpret_cast<Bytef*>(records.data()), &length,
                       reinterpret_cast<const Bytef*>(packed.data()), packed.size()),
            Z_OK);
  EXPECT_EQ(length, 64u);
  EXPECT_EQ(at<float>(records, 32), -1);
  EXPECT_EQ(at<std::int64_t>(records, 32 + 24), 8);
}

TEST(Prt, ReadsAFileWhoseWriterDidNotFinish) {
  TemporaryFolder folder;
  const CacheFormat& prt = formatForWriting("a.prt");
  prt.write(folder / "a.prt", twoParticles(), ParamValues(prt.params));
  std::string bytes = test::readText(folder / "a.prt");
  bytes.replace(48, 8, std::string(8, '\xFF'));
  test::writeText(folder / "a.prt", bytes);
  const CacheContent content = readCache(folder / "a.prt");
  EXPECT_EQ(content.particles.at(0).size(), 2u);
  EXPECT_EQ(content.notes.size(), 1u);
}

// The checksum stands behind the last particle: a lower count would leave it unread.
TEST(Prt, TheCountMustBeThatOfTheData) {
  const TemporaryFolder folder;
  const CacheFormat& prt = formatForWriting("a.prt");
  prt.write(folder / "a.prt", twoParticles(), ParamValues(prt.params));
  const std::string whole = test::readText(folder / "a.prt");
  const auto refusal = [&](std::int64_t count) {
    std::string bytes = whole;
    std::memcpy(bytes.data() + 48, &count, sizeof count);
    test::writeText(folder / "a.prt", bytes);
    try {
      readCache(folder / "a.prt");
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string("read");
  };
  EXPECT_EQ(refusal(2), "read");
  EXPECT_NE(refusal(3).find("truncated"), std::string::npos);
  EXPECT_NE(refusal(1).find("more than the 1 particles"), std::string::npos);
  EXPECT_NE(refusal(0).find("more than the 0 particles"), std::string::npos);
  EXPECT_NE(refusal(-2).find("says -2 particles"), std::string::npos);
}

/// Blender baked the same frames as .uni and as .vdb: the values must agree to half precision.
TEST(Uni, HoldsWhatTheVdbOfTheSameFrameHolds) {
  FOREIGN_CACHE(folder, "blender");
  const CacheContent uni = readCache(folder / "gas_uni/data/density_0016.uni");
  const volume::VdbFile vdb = volume::readVdb(folder / "gas_vdb16/data/fluid_data_0016.vdb");
  const auto a = volume::statistics(uni.grids.at(0)), b = volume::statistics(vdb.find("density"));
  EXPECT_NEAR(a.max, b.max, 1e-3);
  const double massA = a.mean * static_cast<double>(uni.grids[0].activeVoxels());
  const double massB = b.mean * static_cast<double>(vdb.find("density").activeVoxels());
  EXPECT_NEAR(massA, massB, 1e-3 * massB);
  EXPECT_EQ(uni.grids[0].name(), "density");
  EXPECT_DOUBLE_EQ(uni.grids[0].voxelSize().x, 1.0 / 32);
}

TEST(Uni, ReadsAWholeFrameAtItsPlace) {
  FOREIGN_CACHE(path, "blender/gas_uni/data/heat_0016.uni");
  const CacheFormat& format = detectFormat(path);
  ParamValues options(format.params);
  options.set("whole_frame", true, "test");
  options.set("voxel_size", 0.125, "test");
  options.set("origin", std::vector<double>{-2, -2, 0}, "test");
  const CacheContent content = format.read(path, options);
  std::vector<std::string> names;
  for (const volume::Grid& grid : content.grids)
    names.push_back(grid.name());
  EXPECT_EQ(names, (std::vector<std::string>{"temperature", "color_b", "color_g", "color_r",
                                             "density", "flame", "shadow", "velocity"}));
  // Cell 0 of each axis is centred half a cell from the corner.
  const Mat4d m = content.grids[0].worldFromIndex();
  EXPECT_EQ(transformPoint(m, Vec3d(0)), Vec3d(-2 + 0.0625, -2 + 0.0625, 0.0625));
}

}  // namespace
}  // namespace photosphere::caches
