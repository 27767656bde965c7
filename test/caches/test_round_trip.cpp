// What every writer of the table writes, its reader reads back.

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "photosphere/caches/cache_format.h"
#include "photosphere/core/error.h"
#include "support/support.h"

namespace photosphere::caches {
namespace {

using test::TemporaryFolder;
using volume::Attribute;
using volume::ParticleSet;

/// Particles with an attribute of every kind; positions need all digits of a double.
ParticleSet sample(std::size_t count, double offset) {
  ParticleSet set;
  std::vector<float> velocity, colour, radius, orient;
  std::vector<double> weight;
  std::vector<std::int32_t> group;
  std::vector<std::int64_t> id;
  for (std::size_t i = 0; i < count; ++i) {
    const double t = static_cast<double>(i) / 7.0;
    set.positions.emplace_back(offset + t, -offset - 2 * t, offset * 0.5 + t * t);
    for (int c = 0; c < 3; ++c) {
      velocity.push_back(static_cast<float>(std::sin(t + c)));
      colour.push_back(
          static_cast<float>((i * 37 + static_cast<std::size_t>(c) * 11) % 256 / 255.0));
    }
    for (int c = 0; c < 4; ++c)
      orient.push_back(static_cast<float>(c) - 1.5f);
    radius.push_back(static_cast<float>(0.1 + t));
    weight.push_back(1.0 / 3.0 + t);
    group.push_back(static_cast<std::int32_t>(i) - 3);
    id.push_back(3000000000 + static_cast<std::int64_t>(i));
  }
  set.add({"v", 3, velocity});
  set.add({"Cd", 3, colour});
  set.add({"pscale", 1, radius});
  set.add({"orient", 4, orient});
  set.add({"weight", 1, weight});
  set.add({"group", 1, group});
  set.add({"id", 1, id});
  return set;
}

CacheContent contentOf(ParticleSet set) {
  CacheContent content;
  content.particles.push_back(std::move(set));
  content.particleNames.push_back("points");
  return content;
}

/// For each particle of `a` its index in `b`: a point grid keeps its own order, `id` tells.
std::vector<std::size_t> matching(const ParticleSet& a, const ParticleSet& b) {
  const Attribute* idA = a.find("id");
  const Attribute* idB = b.find("id");
  std::vector<std::size_t> index(a.size(), b.size());
  for (std::size_t i = 0; idA && idB && i < a.size(); ++i)
    for (std::size_t j = 0; j < b.size(); ++j)
      if (idA->number(i) == idB->number(j)) index[i] = j;
  return index;
}

void expectSame(const ParticleSet& expected, const ParticleSet& read) {
  ASSERT_EQ(read.size(), expected.size());
  const auto index = matching(expected, read);
  for (std::size_t i = 0; i < expected.size(); ++i) {
    ASSERT_LT(index[i], read.size()) << "particle " << i << " is gone";
    EXPECT_EQ(read.positions[index[i]], expected.positions[i]) << "particle " << i;
  }
  for (const Attribute& attribute : expected.attributes) {
    const Attribute* found = read.find(attribute.name);
    ASSERT_NE(found, nullptr) << attribute.name;
    ASSERT_EQ(found->arity, attribute.arity) << attribute.name;
    ASSERT_EQ(found->size(), read.size()) << attribute.name;
    for (std::size_t i = 0; i < expected.size(); ++i)
      for (int c = 0; c < attribute.arity; ++c)
        EXPECT_EQ(found->number(index[i], c), attribute.number(i, c))
            << attribute.name << " of " << i;
  }
}

std::vector<const CacheFormat*> writers() {
  std::vector<const CacheFormat*> formats;
  for (const CacheFormat* format : cacheFormats())
    if (format->write) formats.push_back(format);
  return formats;
}

std::string formatName(const testing::TestParamInfo<const CacheFormat*>& info) {
  return std::string(info.param->name);
}

class RoundTrip : public testing::TestWithParam<const CacheFormat*> {
 protected:
  /// Writes, finds the format of the file by its content, reads.
  ParticleSet through(const ParticleSet& set) {
    const auto path = m_folder / ("cache" + std::string(GetParam()->extensions[0]));
    EXPECT_EQ(&formatForWriting(path), GetParam());
    GetParam()->write(path, contentOf(set), ParamValues(GetParam()->params));
    EXPECT_EQ(&detectFormat(path), GetParam());
    CacheContent content = readCache(path);
    EXPECT_EQ(content.particles.size(), 1u);
    return content.particles.at(0);
  }
  TemporaryFolder m_folder;
};

TEST_P(RoundTrip, KeepsPositionsAndAttributes) {
  const ParticleSet set = sample(50, 0);
  ParticleSet read = through(set);
  if (GetParam()->name == "vdb") {
    // A point grid holds positions as float offsets from voxel centres.
    for (const std::size_t j : matching(set, read))
      ASSERT_LT(j, read.size());
    const auto index = matching(set, read);
    for (std::size_t i = 0; i < set.size(); ++i) {
      EXPECT_LT(glm::length(read.positions[index[i]] - set.positions[i]), 1e-5);
      read.positions[index[i]] = set.positions[i];
    }
  }
  expectSame(set, read);
}

TEST_P(RoundTrip, KeepsPositionsAMillionUnitsAway) {
  const ParticleSet set = sample(20, 1e6);
  const ParticleSet read = through(set);
  const auto index = matching(set, read);
  for (std::size_t i = 0; i < set.size(); ++i) {
    ASSERT_LT(index[i], read.size());
    EXPECT_LT(glm::length(read.positions[index[i]] - set.positions[i]), 1e-5);
  }
}

TEST_P(RoundTrip, HoldsNoParticleAndOneParticle) {
  EXPECT_EQ(through(sample(0, 0)).size(), 0u);
  const ParticleSet one = sample(1, 0);
  expectSame(one, through(one));
}

TEST_P(RoundTrip, HoldsBlocksOfRecords) {
  // More than one block of a megabyte, and not a multiple of it.
  ParticleSet set;
  std::vector<std::int32_t> id;
  for (int i = 0; i < 70001; ++i) {
    set.positions.emplace_back(i, 0.5 * i, -i);
    id.push_back(i);
  }
  set.add({"id", 1, id});
  const ParticleSet read = through(set);
  ASSERT_EQ(read.size(), set.size());
  double sum = 0, expected = 0;
  for (std::size_t i = 0; i < read.size(); ++i) {
    sum += (read.positions[i].x - read.find("id")->number(i)) + read.find("id")->number(i) * 1e-3;
    expected += static_cast<double>(i) * 1e-3;
  }
  EXPECT_NEAR(sum, expected, 0.01 * static_cast<double>(read.size()) * 1e-3);
}

TEST_P(RoundTrip, LeavesTheOldFileWhenItCannotWrite) {
  const auto path = m_folder / ("cache" + std::string(GetParam()->extensions[0]));
  test::writeText(path, "old");
  EXPECT_THROW(GetParam()->write(path, CacheContent(), ParamValues(GetParam()->params)),
               ConfigError);
  EXPECT_EQ(test::readText(path), "old");
  EXPECT_THROW(
      GetParam()->write("/dev/full", contentOf(sample(5000, 0)), ParamValues(GetParam()->params)),
      OutputError);
}

INSTANTIATE_TEST_SUITE_P(Formats, RoundTrip, testing::ValuesIn(writers()), formatName);

TEST(PlyEncodings, AllReadBackTheSame) {
  TemporaryFolder folder;
  const CacheFormat& ply = formatForWriting("a.ply");
  for (const char* encoding : {"ascii", "binary_little_endian", "binary_big_endian"}) {
    ParamValues options(ply.params);
    options.set("encoding", std::string(encoding), "test");
    ParticleSet set = sample(20, 1e6);
    set.positions[3].y = std::numeric_limits<double>::quiet_NaN();
    ply.write(folder / "a.ply", contentOf(set), options);
    ParticleSet read = readCache(folder / "a.ply").particles.at(0);
    EXPECT_TRUE(std::isnan(read.positions[3].y));
    read.positions[3] = set.positions[3] = Vec3d(0);
    expectSame(set, read);
  }
}

TEST(FormatForWriting, ListsWhatCanBeWritten) {
  try {
    formatForWriting("a.uni");
    FAIL();
  } catch (const ConfigError& error) {
    EXPECT_NE(std::string(error.what()).find(".ply"), std::string::npos) << error.what();
    EXPECT_EQ(std::string(error.what()).find(".uni,"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace photosphere::caches
