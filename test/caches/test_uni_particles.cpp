// Mantaflow's particles: deleted ones, and the files of their attributes.

#include <gtest/gtest.h>

#include "photosphere/caches/cache_format.h"
#include "photosphere/core/error.h"
#include "support/support.h"
#include "support/uni_files.h"

namespace photosphere::caches {
namespace {

using test::gzip;
using test::put;
using test::TemporaryFolder;
using test::uniParticles;

TEST(UniParticles, DropDeletedOnesAndPairWithTheirAttributes) {
  TemporaryFolder folder;
  test::writeText(folder / "pp_0003.uni", gzip(uniParticles(4)));
  std::string data = "PD01";
  for (const int value : {4, 8, 8, 8, 1, 12})
    put(data, value);
  data.append(264, '\0');
  for (int i = 0; i < 12; ++i)
    put(data, static_cast<float>(i));
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
