// Every byte of a small file of each format cut off and flipped: an error that names the trouble,
// or something plausible; never a crash, a hang, or memory that the file cannot fill.

#include <gtest/gtest.h>

#include <cstdio>
#include <set>

#include "trial.h"

namespace photosphere::fuzz {

void PrintTo(const Specimen& specimen, std::ostream* out) {
  *out << specimen.target << ' ' << specimen.name;
}

namespace {

/// Scenes that are shipped are whole; one scene stands for all where each byte is damaged.
std::vector<Specimen> damagedOnes() {
  std::vector<Specimen> chosen;
  for (Specimen& specimen : specimens())
    if (specimen.target != "scene" || specimen.name == "keyed")
      chosen.push_back(std::move(specimen));
  return chosen;
}

class Damage : public testing::TestWithParam<Specimen> {
 protected:
  const std::string& whole() const { return GetParam().bytes; }
  const Target& target() const { return *findTarget(GetParam().target); }

  Outcome attempt(const std::string& bytes, const std::string& what, std::size_t at) {
    const Outcome outcome = fuzz::attempt(
        target(), bytes, GetParam().target + " " + what + " " + std::to_string(at), m_folder);
    ++m_counts[static_cast<std::size_t>(outcome)];
    return outcome;
  }
  int count(Outcome outcome) const { return m_counts[static_cast<std::size_t>(outcome)]; }

  /// Most of a .vdb is zeros of node masks, each like the others: every 256th stands for them.
  bool insideZeros(std::size_t i) const {
    const std::size_t begin = i < 8 ? 0 : i - 8, end = std::min(whole().size(), i + 9);
    return target().isolated && i % 256 != 0 &&
           whole().substr(begin, end - begin).find_first_not_of('\0') == std::string::npos;
  }
  /// A fork copies the sanitizer's maps too.
  std::size_t step() const { return test::kSanitized && target().isolated ? 7 : 1; }

  void print(const char* what) const {
    std::printf("%s: %d read, %d refused, %d ended by the guard\n", what, count(Outcome::read),
                count(Outcome::refused), count(Outcome::guarded));
  }

 private:
  test::TemporaryFolder m_folder;
  int m_counts[4] = {};
};

/// Text cut between two numbers or lines is whole text, and every byte of one may be another
/// letter.
bool isText(const std::string& target) {
  static const std::set<std::string> texts{"csv",   "xyz",       "pts",    "txt",  "tsv",   "asc",
                                           "scene", "overrides", "frames", "chan", "detect"};
  return texts.count(target) != 0;
}

TEST_P(Damage, TheWholeIsRead) {
  EXPECT_EQ(attempt(whole(), "whole", whole().size()), Outcome::read);
}

TEST_P(Damage, CutAtEveryByte) {
  for (std::size_t length = 0; length < whole().size(); length += step())
    if (!insideZeros(length)) attempt(whole().substr(0, length), "cut at", length);
  print("cut");
  EXPECT_GT(count(Outcome::refused), 0);
  if (!isText(GetParam().target)) {
    EXPECT_LE(count(Outcome::read), static_cast<int>(whole().size() / 16));
  }
}

TEST_P(Damage, FlippedAtEveryByte) {
  for (std::size_t at = 0; at < whole().size(); at += step())
    for (const unsigned char mask : {0x01, 0x80, 0xFF}) {
      if (insideZeros(at)) continue;
      std::string bytes = whole();
      bytes[at] = static_cast<char>(static_cast<unsigned char>(bytes[at]) ^ mask);
      attempt(bytes, "flipped at", at);
    }
  print("flipped");
  EXPECT_GT(count(Outcome::refused), 0);
}

TEST_P(Damage, AllOnesAtEveryFourBytes) {
  // Counts and lengths of -1 and of 2^31 - 1.
  for (std::size_t at = 0; at + 4 <= whole().size(); at += step())
    for (const char* value : {"\xFF\xFF\xFF\xFF", "\xFF\xFF\xFF\x7F"}) {
      if (insideZeros(at)) continue;
      std::string bytes = whole();
      bytes.replace(at, 4, value, 4);
      attempt(bytes, "ones at", at);
    }
  print("ones");
}

INSTANTIATE_TEST_SUITE_P(Specimens, Damage, testing::ValuesIn(damagedOnes()), [](const auto& info) {
  std::string name = info.param.target + "_" + info.param.name;
  for (char& c : name)
    if (c == '.') c = '_';
  return name;
});

TEST(Targets, EachHasASoundSpecimen) {
  const test::TemporaryFolder folder;
  std::set<std::string> seen;
  for (const Specimen& specimen : specimens()) {
    const Target* target = findTarget(specimen.target);
    ASSERT_NE(target, nullptr) << specimen.target;
    ASSERT_FALSE(specimen.bytes.empty()) << specimen.target << ' ' << specimen.name;
    EXPECT_EQ(attempt(*target, specimen.bytes, specimen.target + " " + specimen.name, folder),
              Outcome::read)
        << specimen.target << ' ' << specimen.name;
    seen.insert(specimen.target);
  }
  for (const Target& target : targets())
    EXPECT_EQ(seen.count(target.name), 1u)
        << "no specimen of " << target.name << ": a reader without a writer needs one made by hand";
}

}  // namespace
}  // namespace photosphere::fuzz
