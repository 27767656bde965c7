// Every byte of a small file of each format cut off and flipped: an error that names the trouble,
// or something plausible; never a crash, a hang, or memory that the file cannot fill.

#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <set>
#include <stdexcept>

#include "photosphere/core/hash.h"
#include "photosphere/estimators/light_cache.h"
#include "photosphere/estimators/light_shard.h"
#include "trial.h"

namespace photosphere::fuzz {

namespace fs = std::filesystem;

void PrintTo(const Specimen& specimen, std::ostream* out) {
  *out << specimen.target << ' ' << specimen.name;
}

namespace {

/// Where each byte is damaged one scene stands for those that are shipped, and one .vdb of a kind
/// for the others: OpenVDB takes long for what it crashes over.
std::vector<Specimen> damagedOnes() {
  const std::set<std::string> chosen{"scene keyed", "vdb smoke", "vdb smoke_and_points",
                                     "light_cache voxels", "light_shard voxels"};
  const std::set<std::string> choosy{"scene", "vdb", "light_cache", "light_shard"};
  std::vector<Specimen> all = specimens();
  std::erase_if(all, [&](const Specimen& specimen) {
    return choosy.count(specimen.target) && !chosen.count(specimen.target + " " + specimen.name);
  });
  return all;
}

/// Text cut between two numbers or lines is whole text, and every byte of one may be another
/// letter. OpenImageIO fills the rest of a cut JPEG, TGA or LZW TIFF with one colour.
bool mayBeCut(const std::string& target) {
  static const std::set<std::string> all{"csv",  "pts",    "scene", "overrides", "frames",
                                         "chan", "detect", "ocio",  "picture",   "stats"};
  return all.count(target) != 0;
}

/// Other bits of deflate that stand for the same bytes: an equal distance, the end's padding.
constexpr int kSameBytes = 3;

/// All that a light cache or shard says of its light.
std::string lightOf(const std::string& target, const fs::path& path) {
  Hasher hasher;
  const auto add = [&](const estimators::LightFieldLayout& layout,
                       const transport::SupportLattice& lattice,
                       const std::vector<Vec3f>& particles, const auto& values) {
    for (const int choice :
         {static_cast<int>(layout.carrier), static_cast<int>(layout.basis),
          static_cast<int>(layout.deposit), static_cast<int>(layout.energy),
          static_cast<int>(layout.kernel), static_cast<int>(layout.direction),
          static_cast<int>(layout.representative), static_cast<int>(layout.smoothing), layout.rows,
          layout.order, layout.channels, layout.unscattered ? 1 : 0})
      hasher.number(choice);
    for (const double number : {layout.radius, layout.depositRadius, layout.lightVoxel,
                                lattice.size() > 0 ? lattice.edge() : 0.0})
      hasher.number(number);
    for (std::size_t i = 0; i < lattice.size(); ++i)
      for (int a = 0; a < 3; ++a)
        hasher.number(lattice.voxel(i)[a]);
    hasher.bytes(particles.data(), particles.size() * sizeof(Vec3f));
    hasher.bytes(values.data(), values.size() * sizeof values[0]);
  };
  if (target == "light_cache") {
    const estimators::LightField f = estimators::readLightCache(path, {"m", "l", {}}, true);
    add(f.layout, f.lattice, f.particles, f.values);
    hasher.number(static_cast<double>(f.photons));
  } else {
    const estimators::LightSums s = estimators::readLightShard(path).light;
    add(s.layout, s.lattice, s.particles, s.sums);
    hasher.number(s.quantum);
    hasher.number(static_cast<double>(s.photonCount));
  }
  return hasher.hex();
}

/// The target, held to more than ending well: a checksum covers all that light caches and shards
/// say, so one that is read says what the whole one does.
Target strict(const Specimen& specimen, const std::string& whole) {
  Target target = *findTarget(specimen.target);
  if (target.name != "light_cache" && target.name != "light_shard") return target;
  const test::TemporaryFolder folder;
  test::writeText(folder / "whole.vdb", whole);
  const std::string light = lightOf(target.name, folder / "whole.vdb");
  target.read = [name = target.name, light](const std::string& bytes, const fs::path& scratch) {
    fs::remove(scratch / "light.vdb");  // some file systems flush what is written again
    test::writeText(scratch / "light.vdb", bytes);
    if (lightOf(name, scratch / "light.vdb") != light)
      throw std::logic_error("was read as other light than was written");
  };
  return target;
}

using Change = std::function<void(std::string& bytes, std::size_t at)>;

class Damage : public testing::TestWithParam<Specimen> {
 protected:
  const std::string& whole() const { return m_whole; }
  const Target& target() const { return m_target; }

  /// Damages the whole at every place, in each of the ways in turn.
  Outcomes damage(const char* what, const std::vector<Change>& changes, std::size_t begin = 0) {
    std::vector<std::size_t> places;
    // Without a limit of memory OpenVDB fills what it is told to.
    const std::size_t step = test::kSanitized && target().isolated ? 7 : 1;
    for (std::size_t at = begin; at < whole().size(); at += step)
      if (!insideZeros(at)) places.push_back(at);
    const std::size_t ways = changes.size();
    const Outcomes outcomes = attempt(
        target(), places.size() * ways,
        [&](std::size_t i) {
          std::string bytes = whole();
          changes[i % ways](bytes, places[i / ways]);
          return bytes;
        },
        [&](std::size_t i) {
          return GetParam().target + ": " + what + ", byte " + std::to_string(places[i / ways]) +
                 ", way " + std::to_string(i % ways);
        });
    // Of grids every length has been held against the tree before the library sees it.
    if (GetParam().target == "vdb" && GetParam().name == "smoke") {
      EXPECT_EQ(outcomes.guarded, 0);
    }
    std::printf("%s at %zu of %zu bytes: %d read, %d refused, %d ended by the guard\n", what,
                places.size(), whole().size(), outcomes.read, outcomes.refused, outcomes.guarded);
    return outcomes;
  }

 private:
  /// Most of a .vdb is zeros of node masks, each like the others: every 256th stands for them,
  /// unless PHOTOSPHERE_EVERY_BYTE is set.
  bool insideZeros(std::size_t i) const {
    static const bool every = std::getenv("PHOTOSPHERE_EVERY_BYTE") != nullptr;
    const bool vdb = !every && (target().isolated || target().name == "vdb.walk");
    const std::size_t begin = i < 8 ? 0 : i - 8, end = std::min(whole().size(), i + 9);
    return vdb && i % 256 != 0 &&
           whole().substr(begin, end - begin).find_first_not_of('\0') == std::string::npos;
  }

  const std::string m_whole = GetParam().content();
  const Target m_target = strict(GetParam(), m_whole);
};

Change flip(unsigned char mask) {
  return [mask](std::string& bytes, std::size_t at) {
    bytes[at] = static_cast<char>(static_cast<unsigned char>(bytes[at]) ^ mask);
  };
}

Change put(const char* four) {
  return [four](std::string& bytes, std::size_t at) {
    bytes.replace(at, 4, four, std::min<std::size_t>(4, bytes.size() - at));
  };
}

TEST_P(Damage, CutAtEveryByte) {
  const Outcomes outcomes =
      damage("cut", {[](std::string& bytes, std::size_t at) { bytes.resize(at); }});
  EXPECT_GT(outcomes.refused, 0);
  if (!mayBeCut(GetParam().target)) {
    EXPECT_LE(outcomes.read, static_cast<int>(whole().size() / 16));
  }
}

/// Where the checksummed particles of a PRT begin.
std::size_t beginOfParticles(const std::string& prt) {
  const auto number = [&](std::size_t at) {
    std::int32_t value = 0;
    std::memcpy(&value, prt.data() + at, sizeof value);
    return static_cast<std::size_t>(value);
  };
  const std::size_t list = number(8);
  return list + 12 + number(list + 4) * number(list + 8);
}

TEST_P(Damage, FlippedAtEveryByte) {
  const Outcomes outcomes = target().isolated
                                ? damage("flipped", {flip(0x80), flip(0xFF)})
                                : damage("flipped", {flip(0x01), flip(0x80), flip(0xFF)});
  EXPECT_GT(outcomes.refused, 0);
  // Its hash covers all of it.
  if (GetParam().target == "checkpoint") {
    EXPECT_EQ(outcomes.read, 0);
  }
  // The checksum of gzip covers all but its own header: time, level and system say nothing.
  if (GetParam().target == "uni") {
    EXPECT_LE(outcomes.read, 3 * 7 + kSameBytes);
  }
  if (GetParam().target == "prt") {
    const Outcomes particles =
        damage("flipped below its checksum", {flip(0x01), flip(0xFF)}, beginOfParticles(whole()));
    EXPECT_LE(particles.read, kSameBytes);
    EXPECT_GT(particles.refused, 100);
  }
}

TEST_P(Damage, OnesAtEveryFourBytes) {
  // Counts and lengths of -1 and of 2^31 - 1.
  damage("ones", {put("\xFF\xFF\xFF\xFF"), put("\xFF\xFF\xFF\x7F")});
}

INSTANTIATE_TEST_SUITE_P(Specimens, Damage, testing::ValuesIn(damagedOnes()), [](const auto& test) {
  std::string name = test.param.target + "_" + test.param.name;
  for (char& c : name)
    if (c == '.') c = '_';
  return name;
});

TEST(Targets, EachHasASoundSpecimen) {
  std::set<std::string> seen;
  for (const Specimen& specimen : specimens()) {
    const Target* target = findTarget(specimen.target);
    ASSERT_NE(target, nullptr) << specimen.target;
    const std::string bytes = specimen.content();
    ASSERT_FALSE(bytes.empty()) << specimen.target << ' ' << specimen.name;
    const auto name = [&](std::size_t) { return specimen.target + " " + specimen.name; };
    EXPECT_EQ(attempt(
                  *target, 1, [&](std::size_t) { return bytes; }, name)
                  .read,
              1)
        << name(0);
    seen.insert(specimen.target);
  }
  for (const Target& target : targets())
    EXPECT_EQ(seen.count(target.name), 1u)
        << "no specimen of " << target.name << ": a reader without a writer needs one made by hand";
}

}  // namespace
}  // namespace photosphere::fuzz
