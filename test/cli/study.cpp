// photosphere study from outside: files, reuse of the reference, a cut-off run.

#include <nlohmann/json.hpp>

#include "fixture.h"

namespace photosphere::test {
namespace {

constexpr const char* kNastyName = "a<b>&'\"c.toml";

class Study : public ::testing::Test {
 protected:
  void SetUp() override {
    volume::writeVdb(m_folder / "smoke.vdb", {ballOfSmoke(0.1)});
    writeText(m_folder / kNastyName,
              "[camera]\nposition = [0.55, 0.55, 5]\nlook_at = [0.55, 0.55, 0.55]\nfov = 18\n"
              "resolution = [64, 48]\n[[volume]]\nfile = \"smoke.vdb\"\ndensity_scale = 5\n"
              "[[light]]\ntype = \"point\"\nposition = [3, 2, 2]\nintensity = 20\n");
  }
  RunResult study(std::vector<std::string> more) {
    std::vector<std::string> arguments{"study", kNastyName, "-o", "report", "--quick"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return runTool(arguments, m_folder.path());
  }
  nlohmann::json json() const {
    return nlohmann::json::parse(readText(m_folder / "report/study.json"));
  }
  TemporaryFolder m_folder;
};

// Fields of one line of CSV.
std::vector<std::string> fields(const std::string& line) {
  std::vector<std::string> out(1);
  bool quoted = false;
  for (const char c : line) {
    if (c == '"')
      quoted = !quoted;
    else if (c == ',' && !quoted)
      out.emplace_back();
    else
      out.back() += c;
  }
  return out;
}

// The first tag that is closed out of turn or left open; empty for a page in balance.
std::string firstUnbalanced(const std::string& html) {
  const std::set<std::string> empty{"meta", "img", "br"};
  std::vector<std::string> open;
  for (std::size_t at = html.find('<'); at != std::string::npos; at = html.find('<', at + 1)) {
    if (html.compare(at, 2, "<!") == 0) continue;
    const std::size_t end = html.find('>', at);
    if (end == std::string::npos) return html.substr(at, 40);
    const bool closing = html[at + 1] == '/';
    const std::size_t start = at + (closing ? 2 : 1);
    const std::string name = html.substr(start, html.find_first_of(" \t\n/>", start) - start);
    if (name == "style" && !closing) {
      at = html.find("</style>", at);
      continue;
    }
    if (name == "style") continue;
    if (html[end - 1] == '/' || empty.count(name)) continue;
    if (!closing) {
      open.push_back(name);
    } else if (open.empty() || open.back() != name) {
      return html.substr(at, 40);
    } else {
      open.pop_back();
    }
  }
  return open.empty() ? std::string() : "<" + open.back() + ">";
}

TEST_F(Study, WritesPageCsvAndJson) {
  const RunResult result = study({"--frames", "1", "--seeds", "3"});
  ASSERT_EQ(result.exitCode, 0) << result.err;
  const nlohmann::json root = json();
  ASSERT_EQ(root.at("sweeps").size(), 6u);
  std::size_t points = 0;
  for (const auto& sweep : root.at("sweeps"))
    points += sweep.at("points").size();
  std::set<std::string> found;
  for (const auto& point : root.at("sweeps")[0].at("points")) {
    found.insert(point.at("family"));
    EXPECT_GT(point.at("seconds").at("total").at("median").get<double>(), 0);
    EXPECT_GT(point.at("peak_memory_bytes").at("median").get<double>(), 1e6);
    EXPECT_EQ(point.at("seeds"), 3);
    const auto& total = point.at("errors").at("total").at("all");
    const double mean = total.at("mean_ratio").at("value");
    if (point.at("family") == "path_traced") {
      EXPECT_NEAR(mean, 1, 0.2);
    }
    if (point.at("family") == "single") {
      // Multiple scattering is missing: the error is bias, and the picture dark.
      EXPECT_LT(mean, 0.95);
      EXPECT_GT(total.at("bias_squared").at("value").get<double>(),
                10 * total.at("variance").at("value").get<double>());
    }
  }
  EXPECT_EQ(found.count("view") + found.count("path_traced") + found.count("single"), 3u);

  std::istringstream csv(readText(m_folder / "report/study.csv"));
  std::string line;
  std::size_t rows = 0, columns = 0;
  while (std::getline(csv, line)) {
    EXPECT_EQ(line.back(), '\r');
    const auto cells = fields(line);
    if (rows++ == 0) columns = cells.size();
    EXPECT_EQ(cells.size(), columns) << line;
  }
  EXPECT_EQ(rows, 1 + 4 * points);

  for (const auto& row : root.at("flicker")) {
    if (row.at("sequence") == "still" && row.at("seed_per_frame") == false) {
      EXPECT_EQ(row.at("rel_mse").at("value"), 0.0);
    }
    if (row.at("sequence") == "still" && row.at("seed_per_frame") == true) {
      EXPECT_GT(row.at("rel_mse").at("value").get<double>(), 0.0);
    }
  }
  EXPECT_EQ(root.at("flicker").size(), 4u);
}

// Paths from the eye hardly find a lamp in thick smoke; those from a lamp afar hardly meet thin
// smoke.
TEST_F(Study, TheReferenceIsMadeFromTheQuieterEnd) {
  const std::vector<std::string> alone{"--frames", "1",      "--no-hard-cases", "--no-flicker",
                                       "--family", "single", "--seeds",         "3"};
  const auto method = [&](const std::vector<std::string>& sets) {
    std::vector<std::string> arguments = alone;
    for (const std::string& set : sets)
      arguments.insert(arguments.end(), {"-s", set});
    const RunResult result = study(arguments);
    EXPECT_EQ(result.exitCode, 0) << result.err;
    return json().at("sweeps")[0].at("reference").at("method").get<std::string>();
  };
  EXPECT_EQ(method({"volume.0.density_scale=15", "light.0.position=[0.55, 0.55, 0.55]"}),
            "light_traced");
  EXPECT_EQ(method({"volume.0.density_scale=0.5", "effects.tolerance=0"}), "path_traced");
}

TEST_F(Study, ThePageNeedsNothingBesideIt) {
  ASSERT_EQ(study({"--no-hard-cases", "--no-flicker", "--minutes", "0.03"}).exitCode, 0);
  const std::string html = readText(m_folder / "report/index.html");
  for (const char* outside : {"http", "<script", "<link", "@import", "<iframe", "file:"})
    EXPECT_EQ(html.find(outside), std::string::npos) << outside;
  for (std::size_t at = html.find(" src="); at != std::string::npos;
       at = html.find(" src=", at + 1))
    EXPECT_EQ(html.compare(at, 27, " src=\"data:image/png;base64"), 0) << html.substr(at, 60);
  EXPECT_EQ(firstUnbalanced(html), "");
  EXPECT_EQ(html.find("a<b>"), std::string::npos);
  EXPECT_NE(html.find("a&lt;b&gt;&amp;&#39;&quot;c.toml"), std::string::npos);
  EXPECT_NE(html.find("<svg"), std::string::npos);
  EXPECT_NE(html.find("<img"), std::string::npos);
}

TEST_F(Study, ReusesTheReference) {
  const std::vector<std::string> short_{"--no-hard-cases", "--no-flicker", "--family", "view",
                                        "--minutes",       "0.03"};
  ASSERT_EQ(study(short_).exitCode, 0);
  const auto first = json().at("sweeps")[0].at("reference");
  EXPECT_EQ(first.at("samples_before"), 0);
  ASSERT_EQ(study(short_).exitCode, 0);
  const auto second = json().at("sweeps")[0].at("reference");
  EXPECT_EQ(second.at("key"), first.at("key"));
  EXPECT_EQ(second.at("samples_before"), first.at("samples"));
  // Nothing but the reference is left in the cache.
  EXPECT_EQ(namesIn(m_folder / "report/cache").size(), 2u);  // and the seeded particles
}

TEST_F(Study, GoesOnWhereItWasCutOff) {
  // Enough time that the reference would grow for long; ended once its first pair is there.
  const std::string command =
      "'" PHOTOSPHERE_TOOL
      "' study \"$NAME\" -o report --quick --minutes 20 --family view "
      "--no-hard-cases --no-flicker & pid=$!; "
      "while kill -0 $pid && ! ls report/cache/*.exr; do sleep 0.02; done >/dev/null 2>&1; "
      "kill -TERM $pid; wait $pid";
  writeText(m_folder / "cut.sh", std::string("NAME='a<b>&'\\''\"c.toml'\n") + command + "\n");
  const RunResult cut = runShell("sh cut.sh", m_folder.path());
  ASSERT_EQ(cut.exitCode, 75) << cut.out << cut.err;
  EXPECT_NE(cut.err.find("run the same command again"), std::string::npos) << cut.err;
  EXPECT_FALSE(fs::exists(m_folder / "report/index.html"));
  for (const std::string& name : namesIn(m_folder / "report/cache"))
    EXPECT_EQ(name.find("runs-"), std::string::npos) << name;
  ASSERT_EQ(
      study({"--no-hard-cases", "--no-flicker", "--family", "view", "--minutes", "0.03"}).exitCode,
      0);
  EXPECT_GT(json().at("sweeps")[0].at("reference").at("samples_before").get<int>(), 0);
}

TEST_F(Study, RefusesWhatItCannotStudy) {
  EXPECT_EQ(study({"--res", "512x512"}).exitCode, 2);
  EXPECT_EQ(study({"--seeds", "2"}).exitCode, 2);
  const RunResult family = study({"--family", "veiw"});
  EXPECT_EQ(family.exitCode, 2);
  EXPECT_NE(family.err.find("did you mean 'view'"), std::string::npos) << family.err;
  EXPECT_EQ(study({"-s", "volume.0.file=missing.vdb"}).exitCode, 3);
  EXPECT_EQ(study({"-s", "camera.fof=1"}).exitCode, 2);
  EXPECT_EQ(study({"--paper"}).exitCode, 2);
  const RunResult nothing = runTool({"study", "-o", "report"}, m_folder.path());
  EXPECT_EQ(nothing.exitCode, 2);
  EXPECT_NE(nothing.err.find("SCENE"), std::string::npos) << nothing.err;
  const RunResult bare =
      runShell("PATH= '" PHOTOSPHERE_TOOL "' study x.toml -o r", m_folder.path());
  EXPECT_EQ(bare.exitCode, 2);
  EXPECT_NE(bare.err.find("gnuplot-nox"), std::string::npos) << bare.err;
}

TEST_F(Study, RunsTheTableOfHardCases) {
  const RunResult good = runTool({"study", "--hard", "--quick", "--case", "density_invalid",
                                  "--family", "single", "-o", "t.csv"},
                                 m_folder.path());
  EXPECT_EQ(good.exitCode, 0) << good.out << good.err;
  EXPECT_NE(good.out.find("2 rows, 0 outside their bounds"), std::string::npos) << good.out;
  EXPECT_NE(readText(m_folder / "t.csv").find("\"density_invalid_named\",\"single\""),
            std::string::npos);
}

TEST_F(Study, ARowOutsideItsBoundIsExit7) {
  fs::create_directories(m_folder / "hard/cases");
  for (const char* name : {"base.toml", "estimators.toml"})
    fs::copy_file(projectFile(std::string("data/hard/") + name), m_folder / "hard" / name);
  writeText(m_folder / "hard/cases/a.toml",
            "[[case]]\nname = \"a\"\nhard = \"b\"\nestimators = [\"single\"]\noracle = { kind = "
            "\"zero\" }\n");
  const RunResult bad =
      runShell("PHOTOSPHERE_DATA=. '" PHOTOSPHERE_TOOL "' study --hard --quick", m_folder.path());
  EXPECT_EQ(bad.exitCode, 7) << bad.out << bad.err;
  EXPECT_NE(bad.out.find("FAILED a "), std::string::npos) << bad.out;
}

TEST_F(Study, TheHardTableTakesNoScene) {
  EXPECT_EQ(study({"--hard"}).exitCode, 2);
  EXPECT_EQ(runTool({"study", "--hard", "--paper"}, m_folder.path()).exitCode, 2);
  EXPECT_EQ(runTool({"study", "--hard", "--frames", "1"}, m_folder.path()).exitCode, 2);
  EXPECT_EQ(runTool({"study", "--hard", "--case", "nothing"}, m_folder.path()).exitCode, 2);
  EXPECT_EQ(runTool({"study", kNastyName, "--case", "x", "-o", "r"}, m_folder.path()).exitCode, 2);
  EXPECT_EQ(runTool({"study", kNastyName}, m_folder.path()).exitCode, 2);
}

}  // namespace
}  // namespace photosphere::test
