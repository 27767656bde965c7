// Options as rows, and output that appears whole or not at all.

#include "photosphere/core/param.h"

#include <gtest/gtest.h>

#include <fstream>

#include "photosphere/core/error.h"
#include "photosphere/core/hash.h"
#include "photosphere/core/output_file.h"
#include "support/support.h"

namespace photosphere::test {

namespace {

constexpr Param kRows[] = {
    {"count", ParamType::integer, "", "4", "how many", 1, 10},
    {"scale", ParamType::real, "m", "1.5", "how large", 0},
    {"mode", ParamType::text, "", "plain", "which", 0, 0, "plain|fancy|later", "later"},
    {"colour", ParamType::rgb, "", "[1, 2, 3]", "what colour"},
    {"later", ParamType::boolean, "", "false", "not yet", 0, 0, {}, {}, false},
    {"names", ParamType::list, "", "[]", "several"},
    {"parts", ParamType::list, "", "[]", "some", 0, 0, "head|tail"},
};

std::string messageOf(const std::function<void()>& call) {
  try {
    call();
  } catch (const ConfigError& e) {
    return e.what();
  }
  return "";
}

TEST(Params, DefaultsAndTexts) {
  ParamValues v(kRows);
  EXPECT_EQ(v.integer("count"), 4);
  EXPECT_EQ(v.real("scale"), 1.5);
  EXPECT_EQ(v.rgb("colour"), Rgb(1, 2, 3));
  EXPECT_FALSE(v.given("count"));
  v.setText("count", "7", "--count");
  v.setText("colour", "0.5", "--colour");
  v.setText("names", "a, b", "--names");
  EXPECT_EQ(v.integer("count"), 7);
  EXPECT_EQ(v.rgb("colour"), Rgb(0.5f));
  EXPECT_EQ(v.list("names"), (std::vector<std::string>{"a", "b"}));
  EXPECT_TRUE(v.given("count"));
}

TEST(Params, ErrorsNameKeyPlaceAndRemedy) {
  ParamValues v(kRows);
  const std::string unknown = messageOf([&] { v.setText("scal", "1", "s.toml:3: [x]"); });
  EXPECT_NE(unknown.find("s.toml:3: [x]: unknown key 'scal'; did you mean 'scale'?"),
            std::string::npos)
      << unknown;
  EXPECT_NE(unknown.find("known: count, scale"), std::string::npos);
  EXPECT_NE(messageOf([&] { v.setText("count", "11", "w"); }).find("at most 10"),
            std::string::npos);
  EXPECT_NE(messageOf([&] { v.setText("count", "1.5", "w"); }).find("whole number"),
            std::string::npos);
  EXPECT_NE(messageOf([&] { v.setText("scale", "nan", "w"); }).find("finite"), std::string::npos);
  EXPECT_NE(messageOf([&] { v.setText("mode", "fency", "w"); }).find("did you mean 'fancy'"),
            std::string::npos);
  EXPECT_NE(messageOf([&] {
              v.setText("parts", "[\"head\", \"tale\"]", "w");
            }).find("w: 'parts' = 'tale' is unknown; did you mean 'tail'? (known: head, tail)"),
            std::string::npos);
  EXPECT_EQ(messageOf([&] { v.set("parts", std::vector<std::string>{"tail", "head"}, "w"); }), "");
  EXPECT_NE(messageOf([&] { v.setText("mode", "later", "w"); }).find("not served"),
            std::string::npos);
  EXPECT_NE(messageOf([&] { v.setText("later", "true", "w"); }).find("not served"),
            std::string::npos);
  EXPECT_EQ(messageOf([&] { v.setText("later", "false", "w"); }), "");
}

TEST(Params, FormatReadsBack) {
  ParamValues v(kRows);
  v.set("scale", 0.1, "w");
  v.set("mode", std::string("fancy"), "w");
  EXPECT_EQ(v.format("scale"), "0.1");
  EXPECT_EQ(v.format("mode"), "\"fancy\"");
  EXPECT_EQ(v.format("colour"), "[1, 2, 3]");
}

TEST(OutputFile, AppearsWholeOrNotAtAll) {
  const TemporaryFolder folder;
  const auto target = folder / "deep/er/file.txt";
  writeFile(target, "old");
  EXPECT_EQ(readText(target), "old");
  {
    OutputFile file(target);
    std::ofstream(file.temporaryPath()) << "half";
  }  // never committed
  EXPECT_EQ(readText(target), "old");
  int files = 0;
  for ([[maybe_unused]] const auto& entry :
       std::filesystem::directory_iterator(target.parent_path()))
    ++files;
  EXPECT_EQ(files, 1);
  writeFile(target, "new");
  EXPECT_EQ(readText(target), "new");
}

TEST(OutputFile, RefusesFoldersAndFullDevices) {
  const TemporaryFolder folder;
  EXPECT_THROW(OutputFile file(folder.path()), OutputError);
  EXPECT_THROW(writeFile("/dev/full", "x"), OutputError);
  EXPECT_TRUE(std::filesystem::exists("/dev/full"));
  EXPECT_THROW(writeFile("/proc/nowhere/file", "x"), OutputError);
}

TEST(Hash, ChangesWithContentAndLength) {
  auto hexOf = [](std::string_view s) {
    Hasher h;
    h.bytes(s.data(), s.size());
    return h.hex();
  };
  EXPECT_EQ(hexOf("abc"), hexOf("abc"));
  EXPECT_NE(hexOf("abc"), hexOf("abd"));
  EXPECT_NE(hexOf(std::string("a\0", 2)), hexOf("a"));
  EXPECT_EQ(hexOf("abc").size(), 16u);
}

}  // namespace

}  // namespace photosphere::test
