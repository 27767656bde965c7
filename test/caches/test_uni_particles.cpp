// Mantaflow's particles: deleted ones, and the files of their attributes.

#include <gtest/gtest.h>
#include <zlib.h>

#include "photosphere/caches/cache_format.h"
#include "photosphere/core/error.h"
#include "support/support.h"

namespace photosphere::caches {
namespace {

using test::TemporaryFolder;

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
