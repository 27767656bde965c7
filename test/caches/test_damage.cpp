// Damaged files: an error that names the file, or something plausible; never a crash, never memory
// that the file cannot fill.

#include <gtest/gtest.h>
#include <zlib.h>

#include <cstring>

#include "photosphere/caches/cache_format.h"
#include "photosphere/core/error.h"
#include "support/support.h"

namespace photosphere::caches {
namespace {

using test::TemporaryFolder;

/// A small whole file of a format of this module's own, with several attributes.
struct Specimen {
  std::string name, file, bytes;
};

void PrintTo(const Specimen& specimen, std::ostream* out) {
  *out << specimen.name;
}

std::string gzip(const std::string& text) {
  z_stream stream{};
  deflateInit2(&stream, 9, Z_DEFLATED, 15 + 16, 8, Z_DEFAULT_STRATEGY);
  std::string out(text.size() + 1000, '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(text.data()));
  stream.avail_in = static_cast<uInt>(text.size());
  stream.next_out = reinterpret_cast<Bytef*>(out.data());
  stream.avail_out = static_cast<uInt>(out.size());
  deflate(&stream, Z_FINISH);
  out.resize(stream.total_out);
  deflateEnd(&stream);
  return out;
}

void put(std::string& out, std::int32_t value) {
  out.append(reinterpret_cast<const char*>(&value), sizeof value);
}

/// Header of a Mantaflow grid of dim^3 cells.
std::string uniGrid(int dim, int gridType, int elementType) {
  const int components = elementType == 2 ? 3 : 1;
  std::string raw = "MNT3";
  for (const int value : {dim, dim, dim, gridType, elementType, 4 * components})
    put(raw, value);
  raw.append(252, 'i');
  put(raw, 0);
  raw.append(8, '\0');
  for (int i = 0; i < dim * dim * dim * components; ++i) {
    const float value = static_cast<float>(i);
    raw.append(reinterpret_cast<const char*>(&value), 4);
  }
  return raw;
}

std::string uniParticles(int count) {
  std::string raw = "PB02";
  for (const int value : {count, 8, 8, 8, 0, 16})
    put(raw, value);
  raw.append(264, '\0');
  for (int i = 0; i < count; ++i) {
    for (int c = 0; c < 3; ++c) {
      const float value = static_cast<float>(i + c) * 0.5f;
      raw.append(reinterpret_cast<const char*>(&value), 4);
    }
    put(raw, i == 1 ? 1 << 10 : 1);
  }
  return raw;
}

std::string written(const char* file, const char* encoding = nullptr) {
  TemporaryFolder folder;
  CacheContent content;
  volume::ParticleSet set;
  for (int i = 0; i < 6; ++i)
    set.positions.emplace_back(i, 0.25 * i, -i);
  set.add({"v", 3, std::vector<float>(18, 0.5f)});
  set.add({"id", 1, std::vector<std::int32_t>(6, 7)});
  content.particles.push_back(set);
  content.particleNames.push_back("points");
  const CacheFormat& format = formatForWriting(file);
  ParamValues options(format.params);
  if (encoding) options.set("encoding", std::string(encoding), "test");
  format.write(folder / file, content, options);
  return test::readText(folder / file);
}

std::vector<Specimen> specimens() {
  const std::string list =
      "ply\nformat ascii 1.0\nelement f 1\nproperty list uchar int i\nelement vertex 2\nproperty "
      "float "
      "x\nproperty float y\nproperty float z\nproperty list int uchar l\nend_header\n2 1 2\n0 0 0 "
      "1 "
      "1\n1 1 1 0\n";
  return {
      {"ply_ascii", "a.ply", written("a.ply", "ascii")},
      {"ply_little", "a.ply", written("a.ply")},
      {"ply_big", "a.ply", written("a.ply", "binary_big_endian")},
      {"ply_list", "a.ply", list},
      {"prt", "a.prt", written("a.prt")},
      {"csv", "a.csv", written("a.csv")},
      {"xyz", "a.xyz", written("a.xyz")},
      {"pts", "a.pts", "2\n0 0 0 5 255 0 0\n1 1 1 5 0 255 0\n"},
      {"uni_grid", "density_0001.uni", gzip(uniGrid(3, 1, 1))},
      {"uni_mac", "vel_0001.uni", gzip(uniGrid(2, 12, 2))},
      {"uni_particles", "pp_0001.uni", gzip(uniParticles(5))},
  };
}

class Damage : public testing::TestWithParam<Specimen> {
 protected:
  enum class Outcome { read, refused };
  /// Anything but an Error with the file's name fails the test.
  Outcome attempt(const std::string& bytes, std::size_t position) {
    const auto path = m_folder / GetParam().file;
    // Some file systems flush a file that is cut short and written again.
    std::filesystem::remove(path);
    test::writeText(path, bytes);
    try {
      const CacheContent content = readCache(path);
      for (const volume::ParticleSet& set : content.particles) {
        EXPECT_LE(set.size(), bytes.size() * 1032) << "byte " << position;
        for (const volume::Attribute& attribute : set.attributes)
          EXPECT_EQ(attribute.size(), set.size()) << attribute.name << ", byte " << position;
      }
      return Outcome::read;
    } catch (const Error& error) {
      const std::string message = error.what();
      EXPECT_NE(message.find(GetParam().file), std::string::npos) << message;
      EXPECT_TRUE(error.code() == ExitCode::inputInvalid || error.code() == ExitCode::inputMissing)
          << message;
    } catch (const std::exception& error) {
      ADD_FAILURE() << "byte " << position << ": " << error.what();
    }
    return Outcome::refused;
  }
  TemporaryFolder m_folder;
};

TEST_P(Damage, TheWholeFileIsRead) {
  EXPECT_EQ(attempt(GetParam().bytes, 0), Outcome::read);
}

TEST_P(Damage, TruncatedAtEveryByte) {
  const std::string& whole = GetParam().bytes;
  std::size_t readable = 0;
  for (std::size_t length = 0; length < whole.size(); ++length)
    readable += attempt(whole.substr(0, length), length) == Outcome::read ? 1 : 0;
  // A text cut between two numbers or digits is whole text; a counted binary file never is.
  const bool text = GetParam().file.ends_with("csv") || GetParam().file.ends_with("xyz");
  if (!text) {
    EXPECT_LE(readable, whole.size() / 16) << "of " << whole.size();
  }
}

TEST_P(Damage, FlippedAtEveryByte) {
  for (std::size_t at = 0; at < GetParam().bytes.size(); ++at)
    for (const unsigned char mask : {0x01, 0x80, 0xFF}) {
      std::string bytes = GetParam().bytes;
      bytes[at] = static_cast<char>(static_cast<unsigned char>(bytes[at]) ^ mask);
      attempt(bytes, at);
    }
}

TEST_P(Damage, AllOnesAtEveryFourBytes) {
  // Counts and lengths of -1 and of 2^31 - 1.
  for (std::size_t at = 0; at + 4 <= GetParam().bytes.size(); ++at)
    for (const char* value : {"\xFF\xFF\xFF\xFF", "\xFF\xFF\xFF\x7F"}) {
      std::string bytes = GetParam().bytes;
      bytes.replace(at, 4, value, 4);
      attempt(bytes, at);
    }
}

INSTANTIATE_TEST_SUITE_P(Formats, Damage, testing::ValuesIn(specimens()),
                         [](const auto& specimen) { return specimen.param.name; });

/// The headers inside gzip, where a flip of the compressed bytes would only spoil the checksum.
TEST(UniDamage, EveryHeaderByteOfTheUncompressedFile) {
  TemporaryFolder folder;
  for (const std::string& raw : {uniGrid(2, 12, 2), uniParticles(3)})
    for (std::size_t at = 4; at < 40; ++at)
      for (const unsigned char mask : {0x01, 0x7F, 0x80, 0xFF}) {
        std::string bytes = raw;
        bytes[at] = static_cast<char>(static_cast<unsigned char>(bytes[at]) ^ mask);
        test::writeText(folder / "pp_0001.uni", gzip(bytes));
        try {
          readCache(folder / "pp_0001.uni");
        } catch (const InputError&) {
        }
      }
}

TEST(UniParticles, DropDeletedOnesAndPairWithTheirAttributes) {
  TemporaryFolder folder;
  test::writeText(folder / "pp_0003.uni", gzip(uniParticles(4)));
  std::string data = "PD01";
  for (const int value : {4, 8, 8, 8, 1, 12})
    put(data, value);
  data.append(264, '\0');
  for (int i = 0; i < 12; ++i) {
    const float value = static_cast<float>(i);
    data.append(reinterpret_cast<const char*>(&value), 4);
  }
  test::writeText(folder / "pVel_0003.uni", gzip(data));
  test::writeText(folder / "pVelSnd_0003.uni", gzip(data));
  test::writeText(folder / "pVel_0004.uni", "not this frame");
  const volume::ParticleSet set = readCache(folder / "pp_0003.uni").particles.at(0);
  ASSERT_EQ(set.size(), 3u);  // particle 1 is deleted
  EXPECT_EQ(set.positions[1], Vec3d(1.0, 1.5, 2.0) / 8.0);
  ASSERT_NE(set.find("v"), nullptr);
  EXPECT_EQ(set.find("v")->number(1, 0), 6);
  EXPECT_EQ(set.attributes.size(), 2u);
  EXPECT_THROW(readCache(folder / "pVel_0003.uni"), InputError);
}

}  // namespace
}  // namespace photosphere::caches
