#include "targets.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>

#include "exr_scan.h"
#include "photosphere/caches/cache_format.h"
#include "photosphere/cameras/chan.h"
#include "photosphere/core/checkpoint.h"
#include "photosphere/core/error.h"
#include "photosphere/core/frames.h"
#include "photosphere/estimators/light_cache.h"
#include "photosphere/estimators/light_shard.h"
#include "photosphere/image/color.h"
#include "photosphere/image/exr.h"
#include "photosphere/image/load.h"
#include "photosphere/scene/scene_file.h"
#include "photosphere/volume/vdb_file.h"
#include "stats_file.h"
#include "support/uni_files.h"
#include "vdb_walk.h"

namespace photosphere::fuzz {

namespace fs = std::filesystem;

namespace {

using test::deflated;
using test::gzip;

/// What must never happen, whatever the bytes are.
void require(bool holds, const std::string& what) {
  if (!holds) throw std::logic_error(what);
}

fs::path place(const fs::path& folder, const std::string& name, const std::string& bytes) {
  const fs::path path = folder / name;
  // Some file systems flush a file that is cut short and written again.
  unlink(path.c_str());
  const int fd = open(path.c_str(), O_CREAT | O_WRONLY | O_TRUNC, 0600);
  require(fd >= 0, "cannot create " + path.string());
  const ssize_t written = write(fd, bytes.data(), bytes.size());
  close(fd);
  require(written == static_cast<ssize_t>(bytes.size()), "cannot write " + path.string());
  return path;
}

/// Deflate makes at most 1032 bytes of one; text makes a number of every second character.
void checkContent(const caches::CacheContent& content, std::size_t bytes) {
  require(content.particles.size() == content.particleNames.size(), "particles without a name");
  for (const volume::ParticleSet& set : content.particles) {
    require(set.size() <= bytes * 1032, "more particles than bytes allow");
    for (const volume::Attribute& attribute : set.attributes)
      require(attribute.size() == set.size(), "attribute of another length: " + attribute.name);
  }
}

void readByFormat(const caches::CacheFormat& format, const fs::path& path, std::size_t bytes) {
  checkContent(format.read(path, ParamValues(format.params)), bytes);
}

void readScene(const std::string& text, const std::vector<std::string>& sets,
               const fs::path& folder) {
  const scene::SceneFile scene = scene::parseScene(text, "scene.toml", folder, sets);
  require(!scene.hash().empty(), "no hash");
  for (const double time : {-1e9, 0.0, 1.0, 12.5, 1e9})
    scene::sceneAt(scene, time);
  const std::string dump = scene::dumpScene(scene);
  try {
    scene::parseScene(dump, "dump.toml", folder);
  } catch (const Error& error) {
    require(false, fmt::format("a dumped scene is refused: {}\n{}", error.what(), dump));
  }
}

constexpr std::string_view kBaseScene =
    "[camera]\nposition = [0, 0, 5]\n[[volume]]\nfile = \"smoke.####.vdb\"\n"
    "phase = { type = \"draine\", g = 0.5 }\n[[light]]\ntype = \"spot\"\n";

/// Each line is one `--set`.
void readOverrides(const std::string& text, const fs::path& folder) {
  std::vector<std::string> sets;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    sets.push_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  readScene(std::string(kBaseScene), sets, folder);
}

void readFrames(const std::string& text) {
  hasFrameToken(text);
  for (const std::int64_t frame : {std::int64_t{-12}, std::int64_t{7}, std::int64_t{1} << 40})
    framePath(text, frame);
  const std::vector<std::int64_t> frames = parseFrames(text);
  require(frames.empty() || parseFrames(formatFrames(frames)) == frames,
          "frames do not read back: " + formatFrames(frames).substr(0, 1000));
}

std::vector<std::string> wordsOf(std::string_view format) {
  if (format == "ply")
    return {"ply\n",          "format ascii 1.0\n",
            "end_header\n",   "format binary_little_endian 1.0\n",
            "comment ",       "format binary_big_endian 1.0\n",
            "property list ", "element vertex ",
            "property ",      "float",
            "double",         "uchar",
            "short",          "uint",
            "int8",           "float64"};
  if (format == "vdb")
    return {"Tree_float_5_4_3",  "Tree_vec3s_5_4_3", "_HalfFloat",    "UniformScaleMap",
            "ScaleTranslateMap", "AffineMap",        "__delayedload", "Tree_ptdataidx32_5_4_3"};
  return {};
}

void addCacheFormats(std::vector<Target>& all) {
  for (const caches::CacheFormat* format : caches::cacheFormats()) {
    if (!format->read) continue;
    const bool library = format->name == "vdb";
    for (const std::string_view extension : format->extensions) {
      std::string file = "x_0001";
      file += extension;
      const std::string name = targetOf(*format, extension);
      if (name == format->name && extension != format->extensions.front()) continue;
      all.push_back({name,
                     [format, file](const std::string& bytes, const fs::path& folder) {
                       readByFormat(*format, place(folder, file, bytes), bytes.size());
                     },
                     library, wordsOf(format->name)});
    }
  }
  all.push_back({"detect",
                 [](const std::string& bytes, const fs::path& folder) {
                   caches::detectFormat(place(folder, "x.bin", bytes));
                 },
                 false});
}

const caches::CacheFormat* formatNamed(std::string_view name) {
  for (const caches::CacheFormat* format : caches::cacheFormats())
    if (format->name == name) return format;
  return nullptr;
}

/// What lies packed in a file, where a checksum would keep chance out.
void addPackedContents(std::vector<Target>& all) {
  if (const caches::CacheFormat* uni = formatNamed("uni"))
    all.push_back({"uni.unpacked",
                   [uni](const std::string& bytes, const fs::path& folder) {
                     const std::string file = gzip(bytes, 1);
                     readByFormat(*uni, place(folder, "pp_0001.uni", file), file.size());
                   },
                   false,
                   {"MNT3", "PB02", "PD01", "M4T3", "MNT2", "DDF2"}});
  if (const caches::CacheFormat* prt = formatNamed("prt"))
    all.push_back({"prt.unpacked",  // the header's length in two bytes, header, particles
                   [prt](const std::string& bytes, const fs::path& folder) {
                     if (bytes.size() < 2) throw InputError("prt.unpacked", "is too short");
                     const std::size_t wanted = static_cast<unsigned char>(bytes[0]) +
                                                256u * static_cast<unsigned char>(bytes[1]);
                     const std::size_t header = std::min(wanted, bytes.size() - 2);
                     const std::string file =
                         bytes.substr(2, header) + deflated(bytes.substr(2 + header), 1);
                     readByFormat(*prt, place(folder, "x.prt", file), file.size());
                   },
                   false});
}

void addVolumes(std::vector<Target>& all) {
  all.push_back({"vdb.walk",
                 [](const std::string& bytes, const fs::path& folder) {
                   volume::walkVdb(place(folder, "x.vdb", bytes));
                 },
                 false, wordsOf("vdb")});
  all.push_back({"light_cache",
                 [](const std::string& bytes, const fs::path& folder) {
                   const fs::path path = place(folder, "light.vdb", bytes);
                   const auto field = estimators::readLightCache(path, {"m", "l", {}}, true);
                   require(field.values.size() ==
                               field.carriers() *
                                   static_cast<std::size_t>(field.layout.valuesPerCarrier()),
                           "values without a carrier");
                 },
                 true});
  all.push_back({"light_shard",
                 [](const std::string& bytes, const fs::path& folder) {
                   const fs::path path = place(folder, "shard.vdb", bytes);
                   const auto shard = estimators::readLightShard(path);
                   require(shard.light.sums.size() ==
                               shard.light.places() *
                                   static_cast<std::size_t>(shard.light.layout.valuesPerCarrier()),
                           "sums without a place");
                   estimators::mergeLightShards({path});
                 },
                 true});
}

/// Goes on from what a checkpoint's folder holds, as long work does.
void readCheckpoint(const std::string& bytes, const fs::path& folder) {
  const fs::path kept = folder / "a.exr.checkpoint";
  fs::create_directories(kept);
  place(kept, "light", bytes);
  Checkpoint checkpoint(kept, 1e9, Resume::require);
  checkpoint.identify("work");
  std::optional<StateReader> in = checkpoint.load("light");
  require(in.has_value(), "a part that was found unhurt cannot be loaded");
  in->text();
  std::vector<double> numbers;
  in->value(numbers);
  std::vector<std::int64_t> sums;
  in->value(sums);
  if (!in->atEnd()) in->fail();
}

/// OpenImageIO opens every picture with 64 MiB.
constexpr std::size_t kPictureRoom = std::size_t{80} << 20;

void addPictures(std::vector<Target>& all) {
  all.push_back({"exr.scan",
                 [](const std::string& bytes, const fs::path& folder) {
                   image::scanExr(place(folder, "x.exr", bytes));
                 },
                 false,
                 {"channels", "chlist", "compression", "dataWindow", "displayWindow", "tiledesc",
                  "tiles", "chunkCount", "type", "deepscanline", "deeptile", "tiledimage"}});
  all.push_back({"exr",
                 [](const std::string& bytes, const fs::path& folder) {
                   const image::ExrFile file = image::readExr(place(folder, "x.exr", bytes));
                   for (const image::Channel& channel : file.image.channels())
                     require(channel.pixels.size() == file.image.pixelCount(), "pixels missing");
                 },
                 false,
                 {},
                 std::size_t{128} << 20});  // one byte of DWA may stand for 67,000
  all.push_back({"hdr",
                 [](const std::string& bytes, const fs::path& folder) {
                   image::loadImage(place(folder, "x.hdr", bytes));
                 },
                 false,
                 {"#?RADIANCE\n", "FORMAT=32-bit_rle_rgbe\n", "-Y ", "+X ", "EXPOSURE="},
                 kPictureRoom});
  all.push_back({"picture",  // of any kind: its bytes decide, not its name
                 [](const std::string& bytes, const fs::path& folder) {
                   image::loadImage(place(folder, "x.picture", bytes));
                 },
                 false,
                 {"IHDR", "IDAT", "\x89PNG\r\n\x1a\n", "II*", "MM", "\xFF\xD8\xFF"},
                 kPictureRoom});
  all.push_back({"ocio",
                 [](const std::string& bytes, const fs::path& folder) {
                   const auto config =
                       image::ColorConfig::load(place(folder, "x.ocio", bytes).string());
                   const auto spaces = config.colorSpaces();
                   if (!spaces.empty()) config.converter(spaces.front(), spaces.back());
                   config.displayConverter(spaces.empty() ? "" : spaces.front(), "", "");
                 },
                 false,
                 {"ocio_profile_version: 2\n", "roles:\n", "displays:\n", "colorspaces:\n",
                  "- !<ColorSpace>\n", "!<MatrixTransform>", "!<FileTransform>", "name: "}});
}

std::vector<std::string> sceneWords() {
  std::vector<std::string> words{
      "[[volume]]\n", "[[light]]\n", "[camera]\n",           "[estimator]\n",
      "[effects]\n",  "[render]\n",  "[output]\n",           "[scene]\n",
      "frame = ",     "value = ",    "{ frame = 1, value = "};
  for (const auto rows : {scene::sceneParams(), scene::volumeParams(), scene::emissionParams(),
                          scene::estimatorParams(), scene::effectsParams(), scene::renderParams(),
                          scene::outputParams()})
    for (const Param& row : rows)
      words.push_back(std::string(row.name) + " = ");
  return words;
}

void addTexts(std::vector<Target>& all) {
  all.push_back(
      {"scene",
       [](const std::string& bytes, const fs::path& folder) { readScene(bytes, {}, folder); },
       false, sceneWords()});
  all.push_back({"overrides", readOverrides, false, sceneWords()});
  all.push_back({"frames",
                 [](const std::string& bytes, const fs::path&) { readFrames(bytes); },
                 false,
                 {"####", "%04d", "$F4"}});
  all.push_back(
      {"chan",
       [](const std::string& bytes, const fs::path&) { cameras::parseChan(bytes, "shot.chan"); },
       false});
  all.push_back({"checkpoint", readCheckpoint, false});
  all.push_back({"stats",
                 [](const std::string& bytes, const fs::path& folder) {
                   const fs::path path = place(folder, "stats.json", bytes);
                   require(!cli::readStatsFile(path).dump().empty(), "cannot be written again");
                 },
                 false,
                 {"[{\"frame\": 1, ", "\"output\": \"", "\\u0000", "null", "true", "1e9"}});
}

}  // namespace

std::string targetOf(const caches::CacheFormat& format, std::string_view extension) {
  // Leica's tables begin with a count.
  return std::string(extension == ".pts" ? "pts" : format.name);
}

const std::vector<Target>& targets() {
  static const std::vector<Target> all = [] {
    std::vector<Target> list;
    addCacheFormats(list);
    addPackedContents(list);
    addVolumes(list);
    addPictures(list);
    addTexts(list);
    return list;
  }();
  return all;
}

const Target* findTarget(std::string_view name) {
  for (const Target& target : targets())
    if (target.name == name) return &target;
  return nullptr;
}

}  // namespace photosphere::fuzz
