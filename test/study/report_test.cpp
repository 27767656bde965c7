// Text from outside cannot break out of HTML, CSV, JSON or a gnuplot script.

#include <cmath>
#include <cstdlib>

#include "child.h"
#include "curves.h"
#include "gnuplot.h"
#include "hard_cases.h"
#include "html.h"
#include "paper_exhibits.h"
#include "photosphere/core/error.h"
#include "photosphere/core/resources.h"
#include "photosphere/study/paper.h"
#include "photosphere/study/study.h"
#include "plots.h"
#include "support/support.h"
#include "tables.h"

namespace photosphere::study {
namespace {

TEST(Html, escapesWhatHasAMeaning) {
  EXPECT_EQ(escape("<a href=\"x\" id='y'>&amp;"),
            "&lt;a href=&quot;x&quot; id=&#39;y&#39;&gt;&amp;amp;");
  EXPECT_EQ(escape("a\nb\tc\x01"), "a b c ");
  EXPECT_EQ(escape("gr\xc3\xbc\xc3\x9f"), "gr\xc3\xbc\xc3\x9f");
}

TEST(Html, replacesWhatIsNotUtf8) {
  const std::string bad = "\xef\xbf\xbd";
  EXPECT_EQ(escape("\xff"), bad);
  EXPECT_EQ(escape("\xc3<"), bad + "&lt;");  // cut short: the next character stays escaped
  EXPECT_EQ(escape("\xc0\xbc"), bad + bad);  // an overlong '<'
  EXPECT_EQ(escape("\xed\xa0\x80"), bad + bad + bad);  // a surrogate
}

TEST(Html, base64IsThatOfRfc4648) {
  EXPECT_EQ(base64(""), "");
  EXPECT_EQ(base64("f"), "Zg==");
  EXPECT_EQ(base64("fo"), "Zm8=");
  EXPECT_EQ(base64("foobar"), "Zm9vYmFy");
  EXPECT_EQ(base64("\xff\xfe\xfd"), "//79");
}

TEST(Html, tablesEscapeTheirCells) {
  const std::string text = tableTag({"a<b", {{"x", "y"}, {"<i>", "1"}}, 1});
  EXPECT_NE(text.find("a&lt;b"), std::string::npos);
  EXPECT_NE(text.find("<td>&lt;i&gt;</td><td class=\"n\">1</td>"), std::string::npos);
}

TEST(Csv, quotesWhatMustBeQuoted) {
  EXPECT_EQ(csvField("plain"), "plain");
  EXPECT_EQ(csvField("a,b"), "\"a,b\"");
  EXPECT_EQ(csvField("say \"hi\"\n"), "\"say \"\"hi\"\"\n\"");
  EXPECT_EQ(csvField("=1+2"), "'=1+2");
}

TEST(Gnuplot, textCannotEndItsString) {
  EXPECT_EQ(gnuplotText("it's\nhere"), "it''s here");
  std::vector<Curve> curves(1);
  curves[0].title = "x'; system 'touch pwned'; set title 'y";
  curves[0].points.push_back({1, 0.9, 1.1, 0.1, 0.09, 0.11, "p", true});
  curves[0].points.push_back({2, 1.9, 2.1, 0.05, 0.04, 0.06, "q", true});
  const test::TemporaryFolder folder;
  const auto before = std::filesystem::current_path();
  std::filesystem::current_path(folder.path());
  const std::string svg = errorPlot(curves, "a <b> & 'c'", "plot", 400, 300);
  std::filesystem::current_path(before);
  EXPECT_FALSE(std::filesystem::exists(folder / "pwned"));
  EXPECT_NE(svg.find("system &apos;touch pwned&apos;") != std::string::npos
                ? svg.find("<svg")
                : svg.find("system 'touch pwned'"),
            std::string::npos)
      << svg;
  EXPECT_EQ(svg.find("http"), std::string::npos);
  EXPECT_EQ(svg.find("<b>"), std::string::npos);
  EXPECT_NE(svg.find("[s]"), std::string::npos);
}

TEST(Gnuplot, twoPlotsOfAPageShareNoId) {
  const std::string svg =
      "<?xml version=\"1.0\"?><!DOCTYPE svg><svg xmlns=\"http://a\" "
      "xmlns:xlink=\"http://b\"><g id=\"p\"/><use xlink:href='#p'/><path "
      "clip-path=\"url(#p)\"/></svg>";
  EXPECT_EQ(inlineSvg(svg, "one", "d"),
            "<svg role=\"img\" aria-label=\"d\"><g id=\"onep\"/><use href='#onep'/><path "
            "clip-path=\"url(#onep)\"/></svg>\n");
}

TEST(Gnuplot, aMissingOneNamesItsPackage) {
  const test::TemporaryFolder empty;
  const std::string path = std::getenv("PATH");
  setenv("PATH", empty.path().c_str(), 1);
  std::string message;
  try {
    gnuplotVersion();
  } catch (const ConfigError& error) {
    message = error.what();
  }
  setenv("PATH", path.c_str(), 1);
  EXPECT_NE(message.find("gnuplot-nox"), std::string::npos) << message;
  EXPECT_EQ(gnuplotVersion().rfind("gnuplot ", 0), 0u);
}

TEST(Gnuplot, whatItComplainsAboutIsReported) {
  try {
    runGnuplot("plot nonsense(");
    FAIL() << "gnuplot accepted nonsense";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("gnuplot"), std::string::npos);
  }
}

TEST(Child, returnsItsTextOrItsFailure) {
  const ChildResult fine = runInChild([] { return std::string(200'000, 'x') + "\xff\""; });
  EXPECT_FALSE(fine.failed);
  EXPECT_EQ(fine.text.substr(0, 200'000), std::string(200'000, 'x'));
  const ChildResult refused = runInChild([]() -> std::string { throw ConfigError("no such key"); });
  EXPECT_TRUE(refused.failed);
  EXPECT_EQ(refused.code, ExitCode::usage);
  EXPECT_EQ(refused.message, "no such key");
  const ChildResult died = runInChild([]() -> std::string { _exit(3); });
  EXPECT_TRUE(tellsOfDeath(died.message)) << died.message;
  EXPECT_FALSE(tellsOfDeath(refused.message)) << refused.message;
  EXPECT_TRUE(died.failed);
  EXPECT_NE(died.message.find("3"), std::string::npos);
}

// Peak memory of one run must not be that of the run before it.
TEST(Child, memoryIsItsOwn) {
  const auto peakAfter = [](std::size_t bytes) {
    return std::stoull(runInChild([bytes] {
                         std::vector<char> block(bytes);
                         for (std::size_t i = 0; i < bytes; i += 4096)
                           block[i] = 1;
                         return std::to_string(peakMemoryBytes() +
                                               static_cast<unsigned>(block[0] - 1));
                       }).text);
  };
  const std::uint64_t before = peakAfter(1), large = peakAfter(std::size_t{64} << 20),
                      after = peakAfter(1);
  EXPECT_GT(large, before + (std::size_t{60} << 20));
  EXPECT_LT(after, before + (std::size_t{8} << 20));
}

// The paper's numbers, and ratios over the first line of each exhibit.
TEST(PaperExhibits, compareWithThePapersOwnRatios) {
  const auto plans = paperExhibits(200'000);
  const auto plan = [&](const std::string& name) {
    for (const ExhibitPlan& p : plans)
      if (p.name == name) return p;
    ADD_FAILURE() << name;
    return ExhibitPlan();
  };
  for (const char* name : {"Figure 11", "Figure 12", "Figure 13", "Figure 14", "Figure 15",
                           "Figure 16", "Table 1", "Table 2", "Memory (section 4.1.3)"})
    EXPECT_GE(plan(name).frames.size(), 2u) << name;
  PaperExhibit table;
  table.unit = "s";
  for (const PaperFrame& frame : plan("Table 2").frames) {
    PaperRow row;
    row.paperValue = frame.paperValue;
    row.measured = true;
    row.seconds.median = table.rows.empty() ? 4 : 3;
    table.rows.push_back(row);
  }
  EXPECT_NEAR(papersRatio(table, table.rows[1]), 495.75 / 835.5, 1e-12);
  EXPECT_NEAR(ourRatio(table, table.rows[1]), 0.75, 1e-12);
  table.rows[1].measured = false;
  EXPECT_EQ(ourRatio(table, table.rows[1]), 0);
}

TEST(Resolution, isBroughtDownToTheLargestEdge) {
  EXPECT_EQ(resolutionOverride({1280, 720}, false), "camera.resolution=[256, 144]");
  EXPECT_EQ(resolutionOverride({256, 256}, false), "");
  EXPECT_EQ(resolutionOverride({100, 4000}, false), "camera.resolution=[6, 256]");
  EXPECT_EQ(resolutionOverride({4000, 1}, false), "camera.resolution=[256, 1]");
}

TEST(HardCases, areScenesThatOpen) {
  SceneSource source{test::projectFile("data/studies/column.toml"), {}};
  SceneFacts facts;
  facts.bounds.grow(Vec3d(-1, -2, 0));
  facts.bounds.grow(Vec3d(1, 2, 3));
  const scene::SceneFile plain = source.open();
  for (const HardCase& c : hardCases(plain, facts)) {
    const scene::SceneFile scene = source.open(c.sets);
    if (c.name == "forward_phase") {
      EXPECT_EQ(scene.volumes[0].phaseValues.real("g"), 0.95);
    }
    if (c.name == "thin_smoke") {
      EXPECT_NEAR(scene.volumes[0].values.vec3("density_scale").x,
                  0.05 * plain.volumes[0].values.vec3("density_scale").x, 1e-9);
    }
    if (c.name == "light_inside") {
      ASSERT_EQ(scene.lights.size(), 1u);
      EXPECT_EQ(scene.lights[0].values.vec3("position"), Vec3d(0, 0, 1.5));
    }
    if (c.name == "hard_shadow_edge") {
      ASSERT_EQ(scene.lights.size(), 1u);
      EXPECT_EQ(scene.lights[0].type, "spot");
    }
  }
}

// What decides the picture is in the key; how it is estimated is not.
TEST(ReferenceKey, followsThePicture) {
  SceneSource source{test::projectFile("data/studies/column.toml"), {}};
  const auto key = [&](const std::vector<std::string>& sets, std::int64_t frame = 42,
                       const std::string& medium = "m") {
    return referenceKey(source.open(sets), frame, medium);
  };
  const std::string plain = key({});
  for (const char* same : {"estimator.photons=5", "estimator.type=path_traced", "scene.seed=9",
                           "render.samples=9", "light.0.name=lamp", "scene.frames=42"})
    EXPECT_EQ(key({same}), plain) << same;
  for (const char* other : {"camera.fov=36", "camera.resolution=[9, 9]", "light.0.intensity=601",
                            "effects.shadows=off", "render.filter=box"})
    EXPECT_NE(key({other}), plain) << other;
  EXPECT_NE(key({}, 30), plain);
  EXPECT_NE(key({}, 42, "n"), plain);
}

}  // namespace
}  // namespace photosphere::study
