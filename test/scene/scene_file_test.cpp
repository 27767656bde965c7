// The scene file: keys, defaults, overrides, messages.

#include "photosphere/scene/scene_file.h"

#include "fixture.h"

namespace photosphere::test {
namespace {

using namespace scene;

SceneFile parse(const std::string& text, const std::vector<std::string>& sets = {}) {
  return parseScene(text, "shot.toml", "/shots", sets);
}

const std::string kSmoke = "[[volume]]\nfile = \"a.vdb\"\n";

// Every key of the contract with its default, where this version serves the key.
struct KeyCase {
  const char* table;
  const char* key;
  const char* value;
};

const KeyCase kKeys[] = {
    {"scene", "meters_per_unit", "1.0"},
    {"scene", "fps", "24.0"},
    {"scene", "frames", "\"\""},
    {"scene", "seed", "1"},
    {"scene", "seed_per_frame", "true"},
    {"camera", "type", "\"perspective\""},
    {"camera", "position", "[0, 0, 5]"},
    {"camera", "look_at", "[0, 0, 0]"},
    {"camera", "up", "[0, 1, 0]"},
    {"camera", "fov", "30.0"},
    {"camera", "resolution", "[1280, 720]"},
    {"camera", "file", "\"\""},
    {"camera", "near", "0.0"},
    {"camera", "shutter", "[-0.25, 0.25]"},
    {"camera", "fstop", "0.0"},
    {"volume.0", "density", "\"density\""},
    {"volume.0", "density_scale", "1.0"},
    {"volume.0", "albedo", "0.9"},
    {"volume.0", "phase", "{ type = \"henyey_greenstein\", g = 0.0 }"},
    {"volume.0", "origin", "[0, 0, 0]"},
    {"volume.0", "cell_centered", "false"},
    {"volume.0", "velocity", "\"\""},
    {"volume.0", "transform", "[1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1]"},
    {"volume.0", "particle_radius", "0.0"},
    {"volume.0", "strays", "\"leave_out\""},
    {"light.0", "type", "\"spot\""},
    {"light.0", "name", "\"key\""},
    {"light.0", "position", "[3, 2.5, 1]"},
    {"light.0", "target", "[0, 0, 0]"},
    {"light.0", "color", "[1, 1, 1]"},
    {"light.0", "intensity", "1.0"},
    {"light.0", "cone_angle", "20.0"},
    {"light.0", "cone_edge", "0.0"},
    {"light.0", "radius", "0.0"},
    {"estimator", "type", "\"photosphere\""},
    {"estimator", "preset", "\"\""},
    {"estimator", "photons", "1000000"},
    {"estimator", "radius", "0.0"},
    {"estimator", "deposit_radius", "0.0"},
    {"estimator", "spatial_kernel", "\"epanechnikov\""},
    {"estimator", "smoothing", "\"twicing\""},
    {"estimator", "carrier", "\"voxels\""},
    {"estimator", "basis", "\"auto\""},
    {"estimator", "deposit", "\"track_length\""},
    {"estimator", "rows", "2"},
    {"estimator", "direction", "\"nearest\""},
    {"estimator", "representative", "\"bin\""},
    {"estimator", "energy", "\"gather\""},
    {"estimator", "merge", "\"full\""},
    {"estimator", "evaluate", "\"per_view\""},
    {"estimator", "kernel", "\"none\""},
    {"estimator", "bandwidth", "0.5"},
    {"estimator", "truncation", "3.0"},
    {"estimator", "directions", "128"},
    {"estimator", "importance", "\"auto\""},
    {"estimator", "light_voxel", "2.0"},
    {"estimator", "cache", "\"\""},
    {"estimator", "order", "4"},
    {"estimator", "final_gather", "0"},
    {"estimator", "max_photons", "0"},
    {"estimator", "neighbors", "0"},
    {"estimator", "passes", "1"},
    {"estimator", "samples", "256"},
    {"estimator", "max_scatter", "0"},
    {"effects", "emission", "\"auto\""},
    {"effects", "single_scattering", "\"auto\""},
    {"effects", "multiple_scattering", "\"auto\""},
    {"effects", "shadows", "\"auto\""},
    {"effects", "chromatic", "\"auto\""},
    {"effects", "motion_blur", "\"auto\""},
    {"effects", "depth_of_field", "\"auto\""},
    {"effects", "environment", "\"auto\""},
    {"effects", "tolerance", "0.005"},
    {"render", "samples", "4"},
    {"render", "filter", "\"blackman_harris\""},
    {"render", "filter_width", "0.0"},
    {"render", "step", "1.0"},
    {"render", "shadow", "\"grid\""},
    {"render", "time_limit", "0.0"},
    {"render", "target_error", "0.0"},
    {"render", "memory_limit", "0.0"},
    {"output", "file", "\"\""},
    {"output", "aovs", "[]"},
    {"output", "light_groups", "false"},
    {"output", "deep", "\"\""},
    {"output", "preview", "\"\""},
    {"output", "colorspace", "\"ACEScg\""},
};

const std::string kBase = kSmoke + "[[light]]\ntype = \"spot\"\n";

// Writing a key's default changes nothing but that it was given: values and pixels stay.
TEST(SceneFileTest, EveryKeyOfTheContractParsesWithItsDefault) {
  const std::string expected = parse(kBase).hash();
  for (const KeyCase& c : kKeys) {
    const std::string set = std::string(c.table) + "." + c.key + "=" + c.value;
    EXPECT_EQ(complaint([&] { EXPECT_EQ(parse(kBase, {set}).hash(), expected) << set; }), "")
        << set;
  }
}

// A whole file, keys in their tables, as a user writes it.
TEST(SceneFileTest, AFileWithEveryKeyParses) {
  std::string text, table;
  for (const KeyCase& c : kKeys) {
    if (table != c.table) {
      table = c.table;
      text += table == "volume.0"  ? "[[volume]]\nfile = \"a.vdb\"\n"
              : table == "light.0" ? std::string("[[light]]\n")
                                   : "[" + table + "]\n";
    }
    text += std::string(c.key) + " = " + c.value + "\n";
  }
  EXPECT_EQ(complaint([&] { EXPECT_EQ(parse(text).hash(), parse(kBase).hash()); }), "");
}

// Every row of the tables stands in the list above, so a new key cannot be forgotten there.
TEST(SceneFileTest, TheListOfKeysIsComplete) {
  const std::pair<const char*, std::span<const Param>> tables[] = {
      {"scene", sceneParams()},   {"estimator", estimatorParams()}, {"effects", effectsParams()},
      {"render", renderParams()}, {"output", outputParams()},       {"volume.0", volumeParams()}};
  for (const auto& [table, rows] : tables)
    for (const Param& row : rows) {
      bool listed = row.name == "file" && std::string(table) == "volume.0";
      for (const KeyCase& c : kKeys)
        listed = listed || (std::string(c.table) == table && row.name == c.key);
      EXPECT_TRUE(listed) << table << "." << row.name;
    }
}

TEST(SceneFileTest, UnknownKeysNameFileLineAndTheKnownOnes) {
  const std::string message =
      complaint([] { parse("[scene]\nseed = 3\n\n[render]\nsamples = 2\nstepp = 0.5\n"); });
  EXPECT_TRUE(contains(message, "shot.toml:6: [render]: unknown key 'stepp'")) << message;
  EXPECT_TRUE(contains(message, "did you mean 'step'?")) << message;
  EXPECT_TRUE(contains(message, "shadow")) << message;
  EXPECT_TRUE(contains(complaint([] { parse(kSmoke + "dens = 2\n"); }),
                       "shot.toml:3: [volume.0]: unknown key 'dens'"));
  EXPECT_TRUE(contains(complaint([] { parse("\n[ligth]\n"); }),
                       "shot.toml:2: [ligth]: unknown table 'ligth'; did you mean 'light'?"));
  EXPECT_TRUE(contains(complaint([] { parse("[render]\nsamples = \n"); }), "shot.toml:2:"));
  EXPECT_TRUE(contains(complaint([] { parse("[[light]]\nname = \"a\"\n"); }), "'type' is missing"));
  EXPECT_TRUE(
      contains(complaint([] { parse("[[volume]]\ndensity_scale = 1\n"); }), "'file' is missing"));
  EXPECT_TRUE(contains(complaint([] { parse("[volume]\nfile = \"a.vdb\"\n"); }), "[[volume]]"));
  EXPECT_TRUE(contains(complaint([] { parse("[camera]\nwidth = 3.0\n"); }),
                       "'width' is an option of camera type orthographic, not of perspective"));
  EXPECT_TRUE(contains(complaint([] { parse("[camera]\nresolution = [10.5, 3]\n"); }), "whole"));
  EXPECT_TRUE(contains(complaint([] { parse("[render]\nsamples = 0\n"); }), "at least 1"));
  EXPECT_TRUE(
      contains(complaint([] { parse("[output]\naovs = [\"beauty\", \"singel\"]\n"); }),
               "shot.toml:2: [output]: 'aovs' = 'singel' is unknown; did you mean 'single'?"));
}

// What only an override made wrong is not the file's fault, wherever it is noticed.
TEST(SceneFileTest, MistakesOfOverridesNameThem) {
  EXPECT_TRUE(contains(complaint([] { parse(kSmoke, {"volume.0=4"}); }),
                       "--set volume.0=4: [volume]: every volume begins with `[[volume]]`"));
  EXPECT_TRUE(contains(complaint([] { parse(kSmoke, {"volume.0.phase.g=1"}); }),
                       "[volume.0.phase] with --set volume.0.phase.g=1: "));
  EXPECT_EQ(parse("[camera]\nposition = [0, 0, 5]\n" + kSmoke,
                  {"camera.look_at=[0,0,5]", "camera.fov=40"})
                .cameraWhere,
            "shot.toml:1: [camera] with --set camera.fov=40, --set camera.look_at=[0,0,5]");
}

class NotServedTest : public ::testing::TestWithParam<const char*> {};

TEST_P(NotServedTest, IsRefusedAndSaysSo) {
  const std::string message = complaint([] { parse(kBase, {GetParam()}); });
  EXPECT_TRUE(contains(message, "not served by this version yet")) << message;
  EXPECT_TRUE(contains(message, std::string("--set ") + GetParam())) << message;
}

INSTANTIATE_TEST_SUITE_P(Contract, NotServedTest,
                         ::testing::Values("output.deep=deep.exr", "output.light_groups=true"));

TEST(SceneFileTest, NamesThatNobodyKnowsAreNotCalledPromised) {
  for (const char* set : {"light.0.type=lamp", "volume.0.phase={ type = \"mie\" }",
                          "camera.type=fisheye", "estimator.type=magic"}) {
    const std::string message = complaint([&] { parse(kBase, {set}); });
    EXPECT_TRUE(contains(message, "unknown")) << message;
    EXPECT_TRUE(contains(message, "known: ")) << message;
  }
}

TEST(SceneFileTest, CombinationsThatMeanNothingAreRefused) {
  EXPECT_NE(complaint([] { parse("[estimator]\nenergy = \"scatter\"\n"); }), "");
  EXPECT_NE(
      complaint([] { parse("[estimator]\ncarrier = \"particles\"\nenergy = \"scatter\"\n"); }), "");
  EXPECT_EQ(complaint([] {
              parse(
                  "[estimator]\ncarrier = \"particles\"\ndeposit = \"collision\"\n"
                  "energy = \"scatter\"\ndeposit_radius = 0.2\n");
            }),
            "");
  EXPECT_NE(complaint([] { parse("[estimator]\ndeposit_radius = 0.2\n"); }), "");
  EXPECT_NE(complaint([] { parse("[estimator]\ncache = \"a.vdb\"\nbasis = \"view\"\n"); }), "");
  EXPECT_NE(complaint([] { parse("[estimator]\ncache = \"a.vdb\"\ntype = \"single\"\n"); }), "");
  EXPECT_NE(complaint([] { parse("[render]\nmemory_limit = -0.5\n"); }), "");
  const std::string layer = "[output]\naovs = [\"beauty\", \"error\"]\n";
  EXPECT_TRUE(contains(complaint([&] { parse(layer); }), "render.target_error"));
  for (const char* set : {"render.target_error=0.1", "render.time_limit=60"})
    EXPECT_EQ(parse(layer, {set}).output.list("aovs").size(), 2u) << set;
}

TEST(SceneFileTest, SetsOverrideAndCreate) {
  const SceneFile s = parse(
      kSmoke, {"volume.0.density_scale=4", "light.0.type=spot", "light.0.intensity=2.5",
               "scene.frames=1-4", "output.file=out/b.####.exr", "camera.position=[1, 2, 3]",
               "volume.0.phase.g=0.5", "volume.0.albedo=[0.1, 0.2, 0.3]", "camera.position.1=7"});
  EXPECT_EQ(s.volumes.at(0).values.vec3("density_scale"), Vec3d(4));
  EXPECT_EQ(s.lights.at(0).values.real("intensity"), 2.5);
  EXPECT_EQ(s.scene.text("frames"), "1-4");
  EXPECT_EQ(s.output.text("file"), "out/b.####.exr");
  EXPECT_EQ(s.camera.vec3("position"), Vec3d(1, 7, 3));
  EXPECT_EQ(s.volumes[0].phaseValues.real("g"), 0.5);
  EXPECT_EQ(s.volumes[0].values.rgb("albedo"), Rgb(0.1f, 0.2f, 0.3f));
  EXPECT_FALSE(s.framesSmoke());
  EXPECT_TRUE(contains(complaint([] { parse(kSmoke, {"volume.3.albedo=1"}); }), "--set volume.3"));
  EXPECT_TRUE(contains(complaint([] { parse(kSmoke, {"render.sample=1"}); }),
                       "--set render.sample=1: [render]: unknown key 'sample'"));
  EXPECT_NE(complaint([] { parse(kSmoke, {"nonsense"}); }), "");
  // What looks like two lines of TOML is one piece of text, not a way into another table.
  EXPECT_NE(complaint([] { parse(kSmoke, {"scene.seed=4\nfps=3"}); }), "");
}

// Tables nested without end would overflow the stack when they are freed.
TEST(SceneFileTest, KeysOfTooManyPartsAreRefused) {
  std::string path = "a";
  for (int i = 0; i < 200000; ++i)
    path += ".a";
  const std::string before = "# ' \"\n[user]\nt = \"\"\"\n''\n\"\"\"\n";
  for (const std::string& text : {"[" + path + "]\n", path + " = 1\n", "x = {" + path + " = 1}\n"})
    EXPECT_TRUE(contains(complaint([&] { parse(before + text); }),
                         ":6:1: not valid TOML: a key of more than 32 parts"));
  EXPECT_TRUE(contains(complaint([&] { parse("", {path + "=1"}); }), "200001 parts"));
  // Dots of comments, texts and numbers are none of keys.
  std::string numbers = "0.5";
  for (int i = 0; i < 100; ++i)
    numbers += ", 0.5";
  const std::string dots(100, '.');
  for (const std::string& text :
       {"# " + dots + "\n", "x = \"\\\"" + dots + "\"\n", "x = '" + dots + "'\n",
        "x = \"\"\"\n\"" + dots + "\"\"\"\n", "x = [" + numbers + "]\n"})
    EXPECT_FALSE(contains(complaint([&] { parse(text); }), "parts")) << text;
}

TEST(SceneFileTest, FrameRatesMayBeRatios) {
  EXPECT_DOUBLE_EQ(parse("[scene]\nfps = \"24000/1001\"\n").scene.real("fps"), 24000.0 / 1001.0);
  EXPECT_NE(complaint([] { parse("[scene]\nfps = \"24/\"\n"); }), "");
  EXPECT_NE(complaint([] { parse("[scene]\nfps = \"24/1x\"\n"); }), "");
  EXPECT_NE(complaint([] { parse("[scene]\nframes = \"1-\"\n"); }), "");
}

TEST(SceneFileTest, DumpReadsBackToTheSameScene) {
  const SceneFile s =
      parse(kSmoke +
            "albedo = \"Cd \\\"x\\\"\"\nphase = { type = \"isotropic\" }\norigin = [1, 2.5, 1e-7]\n"
            "[[light]]\ntype = \"point\"\ncolor = [1, 0.25, 0.1]\n[[light]]\n"
            "type = \"environment\"\n[scene]\nfps = \"24000/1001\"\nseed = 7\n"
            "[output]\naovs = [\"beauty\", \"depth\"]\nfile = \"o/b.exr\"\n[camera]\n"
            "focal_length = 35\n");
  const std::string text = dumpScene(s);
  const SceneFile again = parseScene(text, "dump.toml", "/elsewhere");
  EXPECT_EQ(dumpScene(again), text);
  EXPECT_EQ(again.hash(), s.hash());
  EXPECT_EQ(again.volumes.at(0).albedoGrid, "Cd \"x\"");
  EXPECT_EQ(again.resolvePath(again.volumes[0].values.text("file")), "/shots/a.vdb");
  EXPECT_EQ(again.output.list("aovs"), (std::vector<std::string>{"beauty", "depth"}));
  EXPECT_FALSE(again.camera.given("fov"));
  EXPECT_TRUE(again.camera.given("focal_length"));
}

TEST(SceneFileTest, DumpKeepsEveryCharacter) {
  std::string name = "\xC3\xA9";
  for (char c = 1; c > 0; ++c)
    name += c;
  const SceneFile s = parse(kSmoke, {"volume.0.density=" + name});
  EXPECT_EQ(s.volumes.at(0).values.text("density"), name);
  const SceneFile again = parseScene(dumpScene(s), "dump.toml", "/shots");
  EXPECT_EQ(again.volumes.at(0).values.text("density"), name);
}

// The parser asks whether a letter is a space in valid text, too.
TEST(SceneFileTest, LettersBeyondAsciiStandInQuotes) {
  const SceneFile s = parse(kSmoke + "[output]\nfile = \"\"\"\\\n   \u00e9t\u00e9.exr\"\"\"\n");
  EXPECT_EQ(s.output.text("file"), "\u00e9t\u00e9.exr");
  struct Bare {
    const char* text;
    const char* place;
  };
  for (const Bare& bare : {Bare{"\u00e9 = 1", ":3:1"},
                           {"[camera]\nfov = \u00e9", ":4:7"},
                           {"[camera]\nfov = 1 \u00e9", ":4:9"},
                           {"[cam\u00e9ra]", ":3:5"},
                           {"1=+\"s\u015a", ":3:3"},
                           {"x = 2020-01-01 \u00e9", ":3:16"}}) {
    const std::string message = complaint([&] { parse(kSmoke + bare.text); });
    EXPECT_TRUE(contains(message, "shot.toml" + std::string(bare.place))) << message;
  }
}

TEST(SceneFileTest, TheHashFollowsPixelsAndNotPlaces) {
  const std::string hash = parse(kBase).hash();
  EXPECT_EQ(parse(kBase, {"volume.0.file=b.vdb", "output.file=x.exr", "scene.frames=4"}).hash(),
            hash);
  for (const char* set : {"scene.seed=2", "light.0.intensity=2", "volume.0.albedo=0.8",
                          "volume.0.phase.g=0.1", "estimator.photons=5", "camera.fov=31"})
    EXPECT_NE(parse(kBase, {set}).hash(), hash) << set;
}

TEST(SceneFileTest, AMissingFileIsNamedWithTheRemedy) {
  EXPECT_TRUE(contains(complaint([] { loadScene("nothere.toml"); }, ExitCode::inputMissing),
                       "nothere.toml: no such file; check its path"));
}

TEST(SceneFileTest, AFileWithoutAVolumeIsRefused) {
  const TemporaryFolder folder;
  writeText(folder / "empty.toml", "");
  writeText(folder / "light.toml", "[[light]]\ntype = \"point\"\n");
  for (const char* name : {"empty.toml", "light.toml"}) {
    const std::string message = complaint([&] { loadScene(folder / name); });
    EXPECT_TRUE(contains(message, name)) << message;
    EXPECT_TRUE(contains(message, "there is no [[volume]]")) << message;
  }
  EXPECT_EQ(loadScene(folder / "empty.toml", {"volume.0.file=a.vdb"}).volumes.size(), 1u);
}

TEST(SceneFileTest, PathsAreRelativeToTheFile) {
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder / "shots");
  writeText(folder.path() / "shots/a.toml", "[[volume]]\nfile = \"../caches/s.####.vdb\"\n");
  const SceneFile s = loadScene(folder.path() / "shots/a.toml");
  EXPECT_EQ(s.resolvePath(s.volumes.at(0).values.text("file")),
            (folder.path() / "caches/s.####.vdb").string());
  EXPECT_EQ(s.resolvePath("/abs/x.vdb"), "/abs/x.vdb");
  EXPECT_EQ(s.resolvePath(""), "");
  EXPECT_NE(complaint([&] { loadScene(folder / "none.toml"); }, ExitCode::inputMissing), "");
  EXPECT_NE(complaint([&] { loadScene(folder.path()); }, ExitCode::inputMissing), "");
}

}  // namespace
}  // namespace photosphere::test
