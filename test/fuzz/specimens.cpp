// Small sound files of everything that is read.

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfTiledOutputFile.h>
#include <fmt/format.h>

#include <cstring>

#include "openimageio.h"
#include "photosphere/caches/cache_format.h"
#include "photosphere/core/checkpoint.h"
#include "photosphere/core/error.h"
#include "photosphere/estimators/light_cache.h"
#include "photosphere/estimators/light_shard.h"
#include "photosphere/image/exr.h"
#include "photosphere/volume/vdb_file.h"
#include "support/log_level.h"
#include "support/support.h"
#include "support/uni_files.h"
#include "targets.h"

namespace photosphere::fuzz {

namespace {

using caches::CacheContent;
using test::deflated;
using test::gzip;
using test::put;
using test::TemporaryFolder;
using test::uniParticles;

volume::ParticleSet someParticles() {
  volume::ParticleSet set;
  for (int i = 0; i < 6; ++i)
    set.positions.emplace_back(i, 0.25 * i, -i);
  set.add({"v", 3, std::vector<float>(18, 0.5f)});
  set.add({"id", 1, std::vector<std::int32_t>(6, 7)});
  return set;
}

volume::Grid someSmoke() {
  std::vector<float> values(27);
  for (std::size_t i = 0; i < values.size(); ++i)
    values[i] = static_cast<float>(i);
  return volume::denseToGrid("density", Vec3i(3), values, Mat4d(1));
}

void addBytes(std::vector<Specimen>& all, std::string target, std::string name, std::string bytes) {
  all.push_back({std::move(target), std::move(name), [bytes = std::move(bytes)] { return bytes; }});
}

/// Contents to offer a writer: it takes the first that its format can hold.
std::vector<CacheContent> contents() {
  CacheContent particles;
  particles.particles.push_back(someParticles());
  particles.particleNames.push_back("points");
  CacheContent grids;
  grids.grids.push_back(someSmoke());
  return {particles, grids};
}

std::string written(const caches::CacheFormat& format, const std::string& file,
                    const char* encoding = nullptr) {
  const TemporaryFolder folder;
  const test::LogLevel quiet(log::Level::off);  // of what a format cannot hold
  ParamValues options(format.params);
  if (encoding) options.set("encoding", std::string(encoding), "specimen");
  for (const CacheContent& content : contents()) {
    try {
      format.write(folder / file, content, options);
      return test::readText(folder / file);
    } catch (const ConfigError&) {
      // Not what this format holds.
    }
  }
  return {};
}

void addWritten(std::vector<Specimen>& all) {
  for (const caches::CacheFormat* format : caches::cacheFormats()) {
    if (!format->write || !format->read) continue;
    for (const std::string_view extension : format->extensions) {
      std::string file = "a";
      file += extension;
      all.push_back({targetOf(*format, extension), file.substr(2),
                     [format, file] { return written(*format, file); }});
    }
    if (format->name == "ply")
      for (const char* encoding : {"ascii", "binary_big_endian"})
        all.push_back(
            {"ply", encoding, [format, encoding] { return written(*format, "a.ply", encoding); }});
  }
}

/// A Mantaflow grid of dim^3 cells; type 1 is of numbers, 2 of vectors.
std::string uniGrid(int dim, int gridType, int elementType) {
  const int components = elementType == 2 ? 3 : 1;
  std::string raw = "MNT3";
  for (const int value : {dim, dim, dim, gridType, elementType, 4 * components})
    put(raw, value);
  raw.append(252, 'i');
  put(raw, 0);
  raw.append(8, '\0');
  for (int i = 0; i < dim * dim * dim * components; ++i)
    put(raw, static_cast<float>(i));
  return raw;
}

/// A particle file's header and what its zlib stream holds, for `prt.unpacked`.
std::string unpackedPrt() {
  std::string header("\xC0PRT\r\n\x1A\n", 8);
  put(header, std::int32_t{56});
  std::string signature = "Extensible Particle Format";
  signature.resize(32, '\0');
  header += signature;
  put(header, std::int32_t{1});
  put(header, std::int64_t{2});
  for (const std::int32_t value : {4, 1, 44})
    put(header, value);
  std::string name = "Position";
  name.resize(32, '\0');
  header += name;
  for (const std::int32_t value : {4, 3, 0})
    put(header, value);
  std::string out;
  put(out, static_cast<std::uint16_t>(header.size()));
  out += header;
  for (int i = 0; i < 6; ++i)
    put(out, 0.5f * static_cast<float>(i));
  return out;
}

void addHandMade(std::vector<Specimen>& all) {
  addBytes(all, "ply", "lists",
           "ply\nformat ascii 1.0\nelement f 1\nproperty list uchar int i\nelement vertex 2\n"
           "property float x\nproperty float y\nproperty float z\nproperty list int uchar l\n"
           "end_header\n2 1 2\n0 0 0 1 1\n1 1 1 0\n");
  addBytes(all, "pts", "colours", "2\n0 0 0 5 255 0 0\n1 1 1 5 0 255 0\n");
  const std::string grids[] = {uniGrid(3, 1, 1), uniGrid(2, 12, 2), uniParticles(5)};
  const char* const names[] = {"numbers", "staggered", "particles"};
  for (int i = 0; i < 3; ++i) {
    addBytes(all, "uni", names[i], gzip(grids[i], 9));
    addBytes(all, "uni.unpacked", names[i], grids[i]);
  }
  addBytes(all, "prt.unpacked", "positions", unpackedPrt());
  addBytes(all, "detect", "ply", "ply\nformat ascii 1.0\n");
}

/// Of three voxels, with weights, or of three particles: what fields and sums of light share.
template <class Light>
Light lightOf(estimators::Carrier carrier) {
  Light light;
  light.layout.basis = estimators::Basis::histogram;
  light.layout.carrier = carrier;
  light.layout.deposit = carrier == estimators::Carrier::voxels ? estimators::Deposit::trackLength
                                                                : estimators::Deposit::collision;
  light.layout.rows = 1;
  light.layout.channels = 1;
  light.layout.radius = light.layout.depositRadius = 0.5;
  const std::vector<Vec3i> voxels{{1, 2, 3}, {1, 2, 4}, {9, 2, 3}};
  if (carrier == estimators::Carrier::voxels) {
    light.lattice = transport::SupportLattice(Vec3d(-1), 0.25, Vec3i(2, 1, 1), voxels);
    light.layout.smoothing = estimators::Smoothing::visible;
    light.weights = std::make_shared<const std::vector<float>>(3, 0.5f);
  } else {
    light.particles = {Vec3f(0.1f), Vec3f(0.2f), Vec3f(0.7f)};
  }
  return light;
}

std::string lightCache(estimators::Carrier carrier) {
  auto field = lightOf<estimators::LightField>(carrier);
  for (int i = 0; i < 3 * 8; ++i)
    field.values.push_back(static_cast<float>(i));
  const TemporaryFolder folder;
  estimators::writeLightCache(folder / "a.vdb", field, {"m", "l", {}});
  return test::readText(folder / "a.vdb");
}

std::string lightShard(estimators::Carrier carrier) {
  estimators::LightShard shard;
  shard.light = lightOf<estimators::LightSums>(carrier);
  shard.light.photons = shard.light.photonCount = 100;
  for (int i = 0; i < 3 * 8; ++i)
    shard.light.sums.push_back(1000 + i);
  shard.key = {"m", "l", {}};
  shard.randomKey.assign(1, 'r');
  shard.build.assign(1, 'b');
  const TemporaryFolder folder;
  estimators::writeLightShard(folder / "a.vdb", shard);
  return test::readText(folder / "a.vdb");
}

std::string smokeAndPoints() {
  volume::ParticleSet points;
  points.positions = {Vec3d(0.1), Vec3d(0.2, 0.3, 0.9), Vec3d(1.5)};
  points.add({"v", 3, std::vector<float>{1, 2, 3, 4, 5, 6, 7, 8, 9}});
  points.add({"label", 1, std::vector<std::string>{"a", "b", "a"}});
  const TemporaryFolder folder;
  volume::writeVdb(folder / "a.vdb", {someSmoke(), volume::pointsToGrid(points, "points", 1)},
                   {{"note", "made to be damaged"}});
  return test::readText(folder / "a.vdb");
}

std::string twoSmokes() {
  const TemporaryFolder folder;
  volume::writeVdb(folder / "a.vdb", {someSmoke(), volume::renamed(someSmoke(), "again")});
  return test::readText(folder / "a.vdb");
}

/// Says that it lacks the offsets of its grids.
std::string withoutOffsets() {
  std::string bytes = twoSmokes();
  bytes[20] = 0;
  return bytes;
}

void addVolumes(std::vector<Specimen>& all) {
  for (const char* target : {"vdb", "vdb.walk"})
    all.push_back({target, "smoke_and_points", smokeAndPoints});
  all.push_back({"vdb", "smoke", twoSmokes});
  all.push_back({"vdb.walk", "without_offsets", withoutOffsets});
  using estimators::Carrier;
  for (const auto carrier : {Carrier::voxels, Carrier::particles}) {
    const char* name = carrier == Carrier::voxels ? "voxels" : "particles";
    all.push_back({"light_cache", name, [carrier] { return lightCache(carrier); }});
    all.push_back({"light_shard", name, [carrier] { return lightShard(carrier); }});
  }
}

std::string exr(image::ExrCompression compression) {
  image::Image picture(5, 18);
  picture.addLayer("", image::ChannelKind::color);
  picture.addChannel("Z", image::ChannelKind::data);
  for (int i = 0; i < 5 * 18; ++i)
    picture.setRgb("", i % 5, i / 5, Rgb(0.01f * static_cast<float>(i), 1.0f, 2.5f));
  const TemporaryFolder folder;
  image::writeExr(folder / "a.exr", picture, {{"note", std::string("text")}},
                  {.compression = compression});
  return test::readText(folder / "a.exr");
}

/// Three tiles across and two down, mip-mapped.
std::string tiledExr() {
  const TemporaryFolder folder;
  const std::string path = (folder / "a.exr").string();
  std::vector<float> pixels(20 * 12);
  for (std::size_t i = 0; i < pixels.size(); ++i)
    pixels[i] = 0.1f * static_cast<float>(i);
  {
    Imf::Header header(20, 12);
    header.compression() = Imf::ZIP_COMPRESSION;
    header.setTileDescription(Imf::TileDescription(8, 8, Imf::MIPMAP_LEVELS));
    Imf::FrameBuffer buffer;
    for (const char* name : {"R", "G", "B"}) {
      header.channels().insert(name, Imf::Channel(Imf::FLOAT));
      buffer.insert(name, Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(pixels.data()),
                                     sizeof(float), 20 * sizeof(float)));
    }
    Imf::TiledOutputFile file(path.c_str(), header, 0);
    file.setFrameBuffer(buffer);
    for (int level = 0; level < file.numLevels(); ++level)
      file.writeTiles(0, file.numXTiles(level) - 1, 0, file.numYTiles(level) - 1, level);
  }
  return test::readText(path);
}

/// 12 x 5 pixels by OpenImageIO.
std::string picture(const char* format, const char* compression) {
  std::vector<float> rgb(12 * 5 * 3);
  for (std::size_t i = 0; i < rgb.size(); ++i)
    rgb[i] = static_cast<float>(i % 37) / 36.0f;
  std::string bytes;
  image::openImageIo().encode({format, 12, 5, false, compression}, rgb.data(), bytes);
  return bytes;
}

constexpr const char* kColorConfig = R"(ocio_profile_version: 2
roles:
  default: linear
  scene_linear: linear
displays:
  screen:
    - !<View> {name: plain, colorspace: curve}
colorspaces:
  - !<ColorSpace>
    name: linear
    encoding: scene-linear
    bitdepth: 32f
  - !<ColorSpace>
    name: curve
    from_scene_reference: !<GroupTransform>
      children:
        - !<MatrixTransform> {matrix: [2, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]}
        - !<ExponentTransform> {value: 2.2, direction: inverse}
)";

/// Radiance picture of 8 x 4 pixels: a run and literals in every line.
std::string radiance() {
  std::string out = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\nEXPOSURE=1\n\n-Y 4 +X 8\n";
  for (int y = 0; y < 4; ++y) {
    out += std::string("\x02\x02\x00\x08", 4);
    for (int c = 0; c < 4; ++c) {
      out += static_cast<char>(128 + 4);
      out += static_cast<char>(c == 3 ? 129 : 40 * c + y);
      out += '\x04';
      for (int x = 0; x < 4; ++x)
        out += static_cast<char>(c == 3 ? 128 + x : 7 * x + y);
    }
  }
  return out;
}

void addPictures(std::vector<Specimen>& all) {
  using image::ExrCompression;
  const std::pair<const char*, ExrCompression> compressions[] = {
      {"zip", ExrCompression::zip}, {"piz", ExrCompression::piz}, {"dwaa", ExrCompression::dwaa}};
  for (const auto& [name, compression] : compressions)
    all.push_back({"exr", name, [c = compression] { return exr(c); }});
  all.push_back({"exr.scan", "rle", [] { return exr(ExrCompression::rle); }});
  for (const char* target : {"exr", "exr.scan"})
    all.push_back({target, "tiled", tiledExr});
  all.push_back({"hdr", "runs", radiance});
  const auto addPicture = [&](const char* format, const char* compression) {
    const std::string name = std::string(format) + (*compression ? "_" : "") + compression;
    all.push_back({"picture", name, [=] { return picture(format, compression); }});
  };
  for (const char* format : {"png", "jpeg", "bmp", "targa"})
    addPicture(format, "");
  for (const char* compression : {"zip", "lzw"})
    addPicture("tiff", compression);
  addBytes(all, "ocio", "curve", kColorConfig);
}

/// A part of a checkpoint, of the work named `work`.
std::string checkpointPart() {
  const TemporaryFolder folder;
  Checkpoint checkpoint(folder / "a.exr.checkpoint", 1e9, Resume::automatic);
  checkpoint.identify("work");
  checkpoint.save("light", [](StateWriter& out) {
    out.text("stage");
    out.value(std::vector<double>{1, 2.5, -3});
    out.value(std::vector<std::int64_t>{7, 8});
  });
  return test::readText(folder / "a.exr.checkpoint" / "light");
}

void addTexts(std::vector<Specimen>& all) {
  addBytes(all, "scene", "keyed", R"([scene]
fps = "24000/1001"
frames = "1-5x2"
[camera]
position = [{ frame = 1, value = [0, 0, 5] }, { frame = 4, value = [1, 0, 5] }]
fov = 30
[[volume]]
file = "smoke.####.vdb"
density_scale = [1, 2, 3.5]
phase = { type = "draine", g = 0.5 }
emission = { grid = "flame", scale = 2, color = [1, 0.5, 0.2] }
[[light]]
type = "spot"
intensity = 1e1
[output]
aovs = ["beauty", 'single']
)");
  for (const auto& entry : std::filesystem::directory_iterator(test::projectFile("data/scenes")))
    all.push_back({"scene", entry.path().stem().string(),
                   [path = entry.path()] { return test::readText(path); }});
  addBytes(all, "overrides", "several",
           "volume.0.density_scale=4\nlight.1.type=point\ncamera.look_at=[1, 2, 3]\n"
           "render.samples=2\nvolume.0.file=other.vdb\n");
  addBytes(all, "frames", "range", "3,4,10-20x2,5-1,-10--5,1-5y2");
  addBytes(all, "chan", "shot",
           "# frame, translation, rotation, field of view\n1 0 0 5 0 0 0 40\n"
           "2\t+0.5 -1e-1 5 10 20 -30 41.5\r\n\n3 1 0 5 0 0 0 42\n");
  all.push_back({"checkpoint", "part", checkpointPart});
  addBytes(all, "stats", "two_frames",
           R"([{"frame": 1, "output": "a.0001.exr", "seconds": {"total": 1.5e0}},
 {"frame": -2, "output": "\u00fc", "energy_watts": {"emitted": [1, 2, null]}, "why": ["a", true]}]
)");
}

}  // namespace

std::vector<Specimen> specimens() {
  std::vector<Specimen> all;
  addWritten(all);
  addHandMade(all);
  addVolumes(all);
  addPictures(all);
  addTexts(all);
  return all;
}

}  // namespace photosphere::fuzz
