// Krakatoa PRT, versions 1 and 1.1. Source: Thinkbox Software, "PRT File Format", Krakatoa
// documentation. All numbers are little endian.

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "byte_writer.h"
#include "columns.h"
#include "content.h"
#include "inflate.h"
#include "photosphere/caches/cache_format.h"
#include "photosphere/core/error.h"
#include "photosphere/core/log.h"
#include "prt_header.h"
#include "text_number.h"

namespace photosphere::caches::plugins {
namespace {

bool recognize(std::string_view head) {
  return head.starts_with(kPrtMagic);
}

// ---- reading

volume::ParticleSet readParticles(FileReader& file, const PrtHeader& header,
                                  CacheContent& content) {
  const RecordLayout& layout = header.layout;
  const bool unfinished = header.count == kPrtUnfinished;
  const std::uint64_t room = maxInflated(file.remaining()) / layout.stride;
  const std::uint64_t count = unfinished ? room : static_cast<std::uint64_t>(header.count);
  if (count > room)
    throw InputError(file.path(), fmt::format("says {} particles of {} bytes, which its {} bytes "
                                              "cannot hold; write it again",
                                              count, layout.stride, file.size()));
  // Particles shrink to a half or a quarter; a header that promises more gets memory as it
  // delivers.
  const std::uint64_t likely = file.remaining() * 8 / layout.stride + 4096;
  if (count == 0 && file.remaining() == 0) return readRecords(layout, 0, 0, {});
  Inflate stream(file);
  volume::ParticleSet set = readRecords(
      layout, count, std::min(count, likely), [&](unsigned char* records, std::size_t wanted) {
        if (!unfinished) {
          stream.read(records, wanted * layout.stride, "the particles");
          return wanted;
        }
        std::size_t bytes = 0;
        while (bytes < wanted * layout.stride) {
          const std::size_t got = stream.readSome(records + bytes, wanted * layout.stride - bytes);
          if (got == 0) break;
          bytes += got;
        }
        return bytes / layout.stride;
      });
  if (!unfinished && !stream.finish())
    throw InputError(
        file.path(),
        fmt::format("holds more than the {} particles that its header counts: the file "
                    "is damaged; write it again",
                    count));
  if (unfinished)
    content.notes.push_back(
        fmt::format("the writer did not finish this file; it holds {} particles", set.size()));
  return set;
}

CacheContent read(const std::filesystem::path& path, const ParamValues&) {
  FileReader file(path);
  CacheContent content;
  const PrtHeader header = readPrtHeader(file, content);
  const auto& channels = header.layout.channels;
  if (std::none_of(channels.begin(), channels.end(), [](const Channel& channel) {
        return channel.name == "P" && channel.components.size() == 3;
      }))
    throw InputError(file.path(), "has no channel Position of three numbers; export it");
  content.particles.push_back(readParticles(file, header, content));
  content.particleNames.push_back("particles");
  return content;
}

// ---- writing

template <class T>
void put(std::string& out, T value) {
  char raw[sizeof(T)];
  encode(raw, value, kLittle);
  out.append(raw, sizeof raw);
}

/// One metadata chunk of `values` of one type.
template <class T>
void putMeta(std::string& out, std::string_view channel, std::string_view name, Scalar type,
             const std::vector<T>& values) {
  std::string body;
  body.append(channel).append(1, '\0').append(name).append(1, '\0');
  put(body, static_cast<std::int32_t>(prtTypeNumber(type)));
  for (const T value : values)
    put(body, value);
  out.append("Meta");
  put(out, static_cast<std::int32_t>(body.size()));
  out.append(body);
}

/// Krakatoa's channel name for an attribute; one that PRT cannot spell is written as near as may
/// be, and a warning says so.
std::string channelName(const std::string& attribute, const std::string& path) {
  static const std::map<std::string, std::string> names = {{"P", "Position"},
                                                           {"v", "Velocity"},
                                                           {"Cd", "Color"},
                                                           {"id", "ID"},
                                                           {"density", "Density"},
                                                           {"age", "Age"},
                                                           {"life", "LifeSpan"},
                                                           {"pscale", "Radius"},
                                                           {"N", "Normal"},
                                                           {"mass", "Mass"},
                                                           {"temperature", "Temperature"}};
  if (const auto known = names.find(attribute); known != names.end()) return known->second;
  std::string name = attribute.substr(0, kPrtChannelName - 1);
  for (char& c : name)
    if (!((c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9'))) c = '_';
  if (name != attribute)
    log::warning(
        "{}: attribute '{}' is written as PRT channel '{}' (at most {} letters and digits)", path,
        attribute, name, kPrtChannelName - 1);
  return name;
}

std::string metadataChunks(const volume::ParticleSet& particles, const CacheContent& content) {
  std::string chunks;
  const auto number = [&](const char* key, double& value) {
    const auto at = content.metadata.find(key);
    return at != content.metadata.end() && parseReal(at->second, value);
  };
  double value = 0;
  if (number("LengthUnitInMeters", value))
    putMeta(chunks, "", "LengthUnitInMeters", Scalar::f64, std::vector<double>{value});
  if (number("CoordSys", value))
    putMeta(chunks, "", "CoordSys", Scalar::i32,
            std::vector<std::int32_t>{static_cast<int>(value)});
  if (const Box3d box = particles.bounds(); !box.empty()) {
    std::vector<float> corners;
    for (const Vec3d& corner : {box.min, box.max})
      for (int c = 0; c < 3; ++c)
        corners.push_back(static_cast<float>(corner[c]));
    putMeta(chunks, "", "BoundBox", Scalar::f32, corners);
  }
  putMeta(chunks, "Position", "Interpretation", Scalar::i32, std::vector<std::int32_t>{1});
  if (particles.find("v"))
    putMeta(chunks, "Velocity", "Interpretation", Scalar::i32, std::vector<std::int32_t>{2});
  chunks.append("Stop");
  put(chunks, std::int32_t(0));
  return chunks;
}

/// Adds a channel to the layout and its record to `list`.
void addChannel(const std::string& attribute, int arity, Scalar type, RecordLayout& layout,
                std::string& list, std::set<std::string>& taken, const std::string& path) {
  const std::string name = channelName(attribute, path);
  if (!taken.insert(name).second)
    throw ConfigError(fmt::format("{}: two attributes would be the PRT channel '{}'; rename '{}'",
                                  path, name, attribute));
  list.append(name).append(kPrtChannelName - name.size(), '\0');
  put(list, static_cast<std::int32_t>(prtTypeNumber(type)));
  put(list, static_cast<std::int32_t>(arity));
  put(list, static_cast<std::int32_t>(layout.stride));
  Channel channel{attribute, {}, 1};
  for (int c = 0; c < arity; ++c) {
    channel.components.push_back({type, layout.stride});
    layout.stride += scalarSize(type);
  }
  layout.channels.push_back(std::move(channel));
}

void write(const std::filesystem::path& path, const CacheContent& content, const ParamValues&) {
  const WritableParticles particles = onlyParticles(path, content, "PRT", false);
  RecordLayout layout;
  std::string list;
  std::set<std::string> taken;
  addChannel("P", 3, positionType(particles.set), layout, list, taken, path.string());
  for (const volume::Attribute* attribute : particles.attributes)
    addChannel(attribute->name, attribute->arity, memoryType(*attribute), layout, list, taken,
               path.string());

  if (layout.channels.size() > kMaxPrtChannels)
    throw ConfigError(
        fmt::format("{}: {} channels are more than the {} of a PRT file; write .vdb, "
                    ".ply or .csv",
                    path.string(), layout.channels.size(), kMaxPrtChannels));

  const std::string chunks = metadataChunks(particles.set, content);
  std::string header(kPrtMagic);
  put(header, static_cast<std::int32_t>(kPrtFixedHeader + chunks.size()));
  header.append("Extensible Particle Format").append(6, '\0');
  put(header, std::int32_t(2));
  put(header, static_cast<std::int64_t>(particles.set.size()));
  header += chunks;
  put(header, std::int32_t(4));
  put(header, static_cast<std::int32_t>(layout.channels.size()));
  put(header, static_cast<std::int32_t>(kPrtChannelRecord));
  header += list;

  ByteWriter file(path);
  file.write(header);
  Deflate stream(file);
  writeRecords(particles.set, layout, [&](const unsigned char* records, std::size_t count) {
    stream.write(records, count * layout.stride);
  });
  stream.finish();
  file.commit();
}

constexpr std::string_view kExtensions[] = {".prt"};

}  // namespace

extern const CacheFormat prt;
const CacheFormat prt = {"prt", "Krakatoa particles, version 1", {}, kExtensions, recognize, read,
                         write};

}  // namespace photosphere::caches::plugins
