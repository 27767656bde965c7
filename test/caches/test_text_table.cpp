#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <clocale>
#include <cmath>

#include "photosphere/caches/cache_format.h"
#include "photosphere/core/error.h"
#include "support/support.h"

namespace photosphere::caches {
namespace {

using test::TemporaryFolder;

CacheContent read(const std::string& name, const std::string& text,
                  const std::string& columns = {}) {
  TemporaryFolder folder;
  test::writeText(folder / name, text);
  const CacheFormat& format = detectFormat(folder / name);
  ParamValues options(format.params);
  if (!columns.empty()) options.set("columns", columns, "test");
  return format.read(folder / name, options);
}

TEST(TextTable, ReadsEveryDelimiterAndLineEnd) {
  for (const char* text :
       {"x,y,z,id\n1,2.5,-3e1,7\n4,5,6,8\n", "x;y;z;id\r\n1;2.5;-3e1;7\r\n4;5;6;8\r\n",
        "\xEF\xBB\xBFx\ty\tz\tid\n1\t2.5\t-3e1\t7\n4\t5\t6\t8",
        "# made by hand\n# x y z id\n  1   2.5 -3e1 7\n\n4 5 6 8\n",
        "\"x\", \"y\", \"z\", \"id\"\n\"1\", 2.5, -30, 7\n4, 5, 6, 8,\n"}) {
    const volume::ParticleSet set = read("a.csv", text).particles.at(0);
    ASSERT_EQ(set.size(), 2u) << text;
    EXPECT_EQ(set.positions[0], Vec3d(1, 2.5, -30)) << text;
    ASSERT_NE(set.find("id"), nullptr) << text;
    EXPECT_EQ(set.find("id")->number(1), 8) << text;
    EXPECT_TRUE(std::holds_alternative<std::vector<std::int32_t>>(set.find("id")->data)) << text;
  }
}

TEST(TextTable, GroupsColumnsOfOtherPrograms) {
  const volume::ParticleSet houdini =
      read("a.csv", "P.x,P.y,P.z,v[0],v[1],v[2],Alpha\n1,2,3,4,5,6,0.5\n").particles.at(0);
  EXPECT_EQ(houdini.positions.at(0), Vec3d(1, 2, 3));
  EXPECT_EQ(houdini.find("v")->number(0, 2), 6);
  const volume::ParticleSet paraview =
      read("a.csv", "\"Points:0\",\"Points:1\",\"Points:2\",\"x\",\"y\",\"z\"\n9,9,9,1,2,3\n")
          .particles.at(0);
  EXPECT_EQ(paraview.positions.at(0), Vec3d(1, 2, 3));
  const volume::ParticleSet krakatoa =
      read("a.csv", "float32 Position,float32 Position,float32 Position,float16 Density\n1,2,3,4\n")
          .particles.at(0);
  EXPECT_EQ(krakatoa.positions.at(0), Vec3d(1, 2, 3));
  EXPECT_EQ(krakatoa.find("density")->number(0), 4);
}

TEST(TextTable, NamesColumnsByOption) {
  const CacheContent content = read("a.xyz", "1 2 3 4 5 6\n", "vx vy vz x y z");
  EXPECT_EQ(content.particles.at(0).positions.at(0), Vec3d(4, 5, 6));
  const volume::ParticleSet some = read("a.xyz", "1 2 3 4 5\n", "x,-,y,z").particles.at(0);
  EXPECT_EQ(some.positions.at(0), Vec3d(1, 3, 4));
  EXPECT_TRUE(some.attributes.empty());
  EXPECT_THROW(read("a.xyz", "1 2 3\n", "x y z w"), ConfigError);
}

TEST(TextTable, TakesTypesFromTheValues) {
  const volume::ParticleSet set =
      read("a.csv",
           "x,y,z,whole,large,real,exact,name\n0,0,0,1,3000000000,1,0.1,\"a, \"\"b\"\"\"\n"
           "0,0,0,2,1,0.5,0.12345678901234567,c\n")
          .particles.at(0);
  EXPECT_TRUE(std::holds_alternative<std::vector<std::int32_t>>(set.find("whole")->data));
  EXPECT_TRUE(std::holds_alternative<std::vector<std::int64_t>>(set.find("large")->data));
  EXPECT_TRUE(std::holds_alternative<std::vector<float>>(set.find("real")->data));
  EXPECT_EQ(set.find("real")->number(0), 1);
  EXPECT_EQ(set.find("exact")->number(1), 0.12345678901234567);
  EXPECT_EQ(std::get<std::vector<std::string>>(set.find("name")->data).at(0), "a, \"b\"");
}

// Few digits, and more than a float holds all the same.
TEST(TextTable, NumbersPastFloatsStay) {
  const volume::ParticleSet set =
      read("a.csv", "x,y,z,mass,big,zero\n1,2,3,1e-46,1e39,0\n4,5,6,2,3,0\n").particles.at(0);
  EXPECT_EQ(set.find("mass")->number(0), 1e-46);
  EXPECT_EQ(set.find("big")->number(0), 1e39);
  const volume::ParticleSet plain =
      read("a.csv", "x,y,z,mass\n1,2,3,1e-30\n4,5,6,inf\n").particles.at(0);
  EXPECT_TRUE(std::holds_alternative<std::vector<float>>(plain.find("mass")->data));
}

TEST(TextTable, EmptyCellsAreNotANumberAndAreNoted) {
  const CacheContent content = read("a.csv", "x,y,z,mass\n1,2,3,\n1,2,3,4\n");
  EXPECT_TRUE(std::isnan(content.particles.at(0).find("mass")->number(0)));
  EXPECT_EQ(content.notes.size(), 1u);
}

// Simulations emit nothing in some frames: what their writers make of that is no damage.
TEST(TextTable, FramesWithoutParticlesAreEmpty) {
  for (const auto& [name, text] : std::initializer_list<std::pair<const char*, const char*>>{
           {"a.csv", "x,y,z,pscale\n"},
           {"a.csv", "# of a solver\nx,y,z,pscale"},
           {"a.xyz", "# x y z vx vy vz\n"},
           {"a.pts", "0\n"},
           {"a.pts", "0\n0\n"}}) {
    const CacheContent content = read(name, text);
    ASSERT_EQ(content.particles.size(), 1u) << text;
    EXPECT_EQ(content.particles[0].size(), 0u) << text;
    for (const volume::Attribute& attribute : content.particles[0].attributes)
      EXPECT_EQ(attribute.size(), 0u) << text;
  }
  EXPECT_NE(read("a.csv", "x,y,z,pscale\n").particles[0].find("pscale"), nullptr);
  EXPECT_EQ(read("a.pts", "0\n2\n1 1 1\n2 2 2\n").particles[0].size(), 2u);
  for (const auto& [name, text] :
       std::initializer_list<std::pair<const char*, const char*>>{{"a.csv", ""},
                                                                  {"a.csv", "\n\n"},
                                                                  {"a.csv", "# of a solver\n"},
                                                                  {"a.csv", "a,b\n"},
                                                                  {"a.pts", "2\n"},
                                                                  {"a.pts", "2\n0\n"}})
    EXPECT_THROW(read(name, text), InputError) << text;
}

TEST(TextTable, ErrorsNameTheLine) {
  const auto message = [](const std::string& name, const std::string& text) -> std::string {
    try {
      read(name, text);
    } catch (const InputError& error) {
      return error.what();
    }
    return "no error";
  };
  EXPECT_NE(message("a.csv", "x,y,z\n1,2,3\n1,2\n").find("line 3"), std::string::npos);
  EXPECT_NE(message("a.csv", "x,y,z\n1,2,3\n1,2,3,4\n").find("line 3"), std::string::npos);
  EXPECT_NE(message("a.csv", "x,y,z\n1,2,3\n1,two,3\n").find("'two'"), std::string::npos);
  EXPECT_NE(message("a.csv", "x;y;z\n1,5;2;3\n").find("decimal commas"), std::string::npos);
  EXPECT_NE(message("a.csv", "a,b\n1,2\n").find("columns"), std::string::npos);
  EXPECT_NE(message("a.csv", "x,y,z,x\n1,2,3,4\n").find("several columns 'x'"), std::string::npos);
  EXPECT_NE(message("a.csv", "x,y,z,pscale,pscale\n1,2,3,4,5\n").find("several columns 'pscale'"),
            std::string::npos);
  EXPECT_NE(message("a.pts", "5\n1 2 3\n1 2 3\n").find("truncated"), std::string::npos);
  // More than the count is damage as well, and no count makes room that the file has not.
  EXPECT_NE(message("a.pts", "1\n1 2 3\n1 2 3\n").find("damaged"), std::string::npos);
  EXPECT_NE(message("a.pts", "18446744073709551615\n1 2 3\n").find("line 1"), std::string::npos);
  EXPECT_NE(message("a.pts", "1\n1 2 3\n18446744073709551615\n").find("line 3"), std::string::npos);
  EXPECT_NE(message("a.csv", std::string("x,y,z\0", 6)).find("not text"), std::string::npos);
  EXPECT_NE(
      message("a.csv", std::string("x,y,z\n1,2,3\n1,2,\0003\n", 19)).find("'\\x003' in column 'z'"),
      std::string::npos);
  EXPECT_NE(message("a.csv", "x,y,z\r1,2,3\r4,5,6\r").find("end in CR alone"), std::string::npos);
  EXPECT_NE(message("a.csv", std::string(3 << 20, 'x')).find("longer"), std::string::npos);
}

TEST(TextTable, PointsAreReadTheSameInEveryLocale) {
  const std::string before = std::setlocale(LC_ALL, nullptr);
  if (!std::setlocale(LC_ALL, "de_DE.UTF-8")) std::setlocale(LC_ALL, "C.UTF-8");
  EXPECT_EQ(read("a.csv", "x,y,z\n1.5,2,3\n").particles.at(0).positions.at(0).x, 1.5);
  std::setlocale(LC_ALL, before.c_str());
}

TEST(TextTable, PtsHoldsSeveralScansAndColourBytes) {
  const volume::ParticleSet set =
      read("a.pts", "1\n0 0 0 5 255 0 51\n2\n1 1 1 6 0 0 0\n2 2 2 7 0 0 0\n").particles.at(0);
  ASSERT_EQ(set.size(), 3u);
  EXPECT_EQ(set.find("intensity")->number(2), 7);
  EXPECT_FLOAT_EQ(static_cast<float>(set.find("Cd")->number(0, 2)), 0.2f);
}

TEST(TextTable, PtsWritesColourBytes) {
  TemporaryFolder folder;
  const CacheContent content = read("a.pts", "1\n0.5 0 -2 5 255 0 51\n");
  formatForWriting("b.pts").write(folder / "b.pts", content,
                                  ParamValues(formatForWriting("b.pts").params));
  EXPECT_EQ(test::readText(folder / "b.pts"), "1\n0.5 0 -2 5 255 0 51\n");
}

TEST(TextTable, ReadsFilesOfOtherPrograms) {
  FOREIGN_CACHE(folder, "text_ply_pdal");
  EXPECT_EQ(readCache(folder / "test.pts").particles.at(0).size(), 19u);
  const volume::ParticleSet crlf = readCache(folder / "crlf_test.txt").particles.at(0);
  EXPECT_EQ(crlf.size(), 10u);
  EXPECT_EQ(crlf.positions[9], Vec3d(289818.50, 4320980.59, 170.58));
  EXPECT_THROW(readCache(folder / "text.txt"), InputError);
}

RC_GTEST_PROP(TextTableFuzz, AnyTextIsReadOrRefused, (const std::string& text)) {
  try {
    read("a.csv", text);
  } catch (const Error&) {
  }
}

/// Text that looks like a table: the characters that mean something here, at random.
RC_GTEST_PROP(TextTableFuzz, AnyTableIsReadOrRefused, ()) {
  const auto piece =
      rc::gen::element<std::string>("1", "-2.5", "1e999", "x", "y", "z", "v", ",", ";", "\t", " ",
                                    "\n", "\r\n", "\"", "#", "nan", "", "_0", ".", "12");
  const auto pieces = *rc::gen::container<std::vector<std::string>>(piece);
  std::string text = *rc::gen::element<std::string>("", "x,y,z\n", "x y z\n1 2 3\n", "3\n");
  for (const std::string& word : pieces)
    text += word;
  try {
    const CacheContent content =
        read(*rc::gen::element<std::string>("a.csv", "a.pts", "a.xyz"), text);
    for (const volume::Attribute& attribute : content.particles.at(0).attributes)
      RC_ASSERT(attribute.size() == content.particles.at(0).size());
  } catch (const Error&) {
  }
}

/// Any finite particles survive the way through text, to the bit.
RC_GTEST_PROP(TextTableFuzz, NumbersSurvive,
              (const std::vector<double>& values, const std::vector<float>& floats)) {
  TemporaryFolder folder;
  CacheContent content;
  volume::ParticleSet set;
  std::vector<float> attribute;
  for (std::size_t i = 0; i < values.size(); ++i) {
    set.positions.emplace_back(values[i], -values[i], values[i] * 1e-300);
    attribute.push_back(floats.empty() ? 1.0f : floats[i % floats.size()]);
  }
  set.add({"a", 1, attribute});
  content.particles.push_back(set);
  content.particleNames.push_back("points");
  const CacheFormat& csv = formatForWriting("a.csv");
  csv.write(folder / "a.csv", content, ParamValues(csv.params));
  const volume::ParticleSet back = readCache(folder / "a.csv").particles.at(0);
  RC_ASSERT(back.positions == set.positions);
  for (std::size_t i = 0; i < set.size(); ++i)
    RC_ASSERT(back.find("a")->number(i) == static_cast<double>(attribute[i]));
}

}  // namespace
}  // namespace photosphere::caches
