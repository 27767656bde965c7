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
#include "records.h"
#include "text_number.h"

namespace photosphere::caches::plugins {
namespace {

using namespace std::string_view_literals;

constexpr auto kMagic = "\xC0PRT\r\n\x1A\n"sv;
constexpr std::size_t kFixedHeader = 56;
constexpr std::size_t kChannelRecord = 44;
constexpr std::size_t kChannelName = 32;
constexpr std::size_t kMaxStride = std::size_t(1) << 20;
constexpr auto kLittle = ByteOrder::little;
constexpr Scalar kTypes[] = {Scalar::i16, Scalar::i32, Scalar::i64, Scalar::f16,
                             Scalar::f32, Scalar::f64, Scalar::u16, Scalar::u32,
                             Scalar::u64, Scalar::i8,  Scalar::u8};

bool recognize(std::string_view head) {
  return head.starts_with(kMagic);
}

int typeNumber(Scalar type) {
  return static_cast<int>(std::find(std::begin(kTypes), std::end(kTypes), type) - kTypes);
}

// ---- reading

std::string untilZero(std::string_view text) {
  return std::string(text.substr(0, text.find('\0')));
}

/// The values of a metadata chunk as text; empty for a type that is not a number.
std::string valuesText(std::string_view data, std::int32_t type) {
  if (type < 0 || type >= static_cast<std::int32_t>(std::size(kTypes))) return {};
  const Scalar scalar = kTypes[type];
  std::string text;
  for (std::size_t at = 0; at + scalarSize(scalar) <= data.size(); at += scalarSize(scalar)) {
    if (at > 0) text += ' ';
    const char* bytes = data.data() + at;
    switch (scalar) {
      case Scalar::i32:
        appendNumber(text, decode<std::int32_t>(bytes, kLittle));
        break;
      case Scalar::i64:
        appendNumber(text, decode<std::int64_t>(bytes, kLittle));
        break;
      case Scalar::f32:
        appendNumber(text, decode<float>(bytes, kLittle));
        break;
      case Scalar::f64:
        appendNumber(text, decode<double>(bytes, kLittle));
        break;
      default:
        return {};
    }
  }
  return text;
}

/// Version 1.1: chunks of tag, length and `channel\0 name\0 type value` up to the header's end.
/// Real files hold wrong lengths, so nothing here is trusted and nothing here is fatal.
void readMetadata(std::string_view chunks, CacheContent& content) {
  while (chunks.size() >= 8) {
    const std::string_view tag = chunks.substr(0, 4);
    const std::int32_t length = decode<std::int32_t>(chunks.data() + 4, kLittle);
    if (tag == "Stop") return;
    chunks.remove_prefix(8);
    if (length < 0 || static_cast<std::size_t>(length) > chunks.size()) {
      content.notes.push_back(fmt::format(
          "metadata chunk says a length of {} bytes: metadata from there on not read", length));
      return;
    }
    std::string_view chunk = chunks.substr(0, static_cast<std::size_t>(length));
    chunks.remove_prefix(chunk.size());
    if (tag != "Meta") continue;
    const std::size_t first = chunk.find('\0');
    const std::size_t second = first == chunk.npos ? first : chunk.find('\0', first + 1);
    if (second == chunk.npos || chunk.size() < second + 5) continue;
    const std::string channel(chunk.substr(0, first));
    const std::string name(chunk.substr(first + 1, second - first - 1));
    const auto type = decode<std::int32_t>(chunk.data() + second + 1, kLittle);
    const std::string text = valuesText(chunk.substr(second + 5), type);
    if (!text.empty()) content.metadata[channel.empty() ? name : channel + "." + name] = text;
  }
}

struct Header {
  std::int64_t count = 0;  ///< -1: the writer did not come to the end
  RecordLayout layout;
};

Channel readChannel(FileReader& file, std::size_t recordLength, RecordLayout& layout) {
  std::vector<char> record(recordLength);
  file.read(record.data(), record.size(), "the channel list");
  const std::string name = untilZero({record.data(), kChannelName});
  const auto type = decode<std::int32_t>(record.data() + 32, kLittle);
  const auto arity = decode<std::int32_t>(record.data() + 36, kLittle);
  const auto offset = decode<std::int32_t>(record.data() + 40, kLittle);
  const bool known = type >= 0 && type < static_cast<std::int32_t>(std::size(kTypes));
  const std::size_t size = known ? scalarSize(kTypes[type]) : 0;
  if (!known || arity < 1 || offset < 0 || static_cast<std::size_t>(arity) > kMaxStride ||
      static_cast<std::size_t>(offset) + static_cast<std::size_t>(arity) * size > kMaxStride)
    throw InputError(file.path(), fmt::format("channel '{}' has type {}, {} components at byte {}: "
                                              "the header is damaged; write it again",
                                              name, type, arity, offset));
  Channel channel{attributeName(name), {}, 1};
  for (int c = 0; c < arity; ++c)
    channel.components.push_back(
        {kTypes[type], static_cast<std::size_t>(offset) + static_cast<std::size_t>(c) * size});
  layout.stride = std::max(layout.stride, channel.components.back().offset + size);
  return channel;
}

void readChannels(FileReader& file, RecordLayout& layout) {
  file.number<std::int32_t>(kLittle, "the channel list");  // always 4
  const auto channels = file.number<std::int32_t>(kLittle, "the channel list");
  const auto length = file.number<std::int32_t>(kLittle, "the channel list");
  if (channels < 1 || length < static_cast<std::int32_t>(kChannelRecord) || length > 4096 ||
      static_cast<std::uint64_t>(channels) > file.remaining() / static_cast<std::uint64_t>(length))
    throw InputError(file.path(),
                     fmt::format("says {} channels of {} bytes: the header is damaged; "
                                 "write it again",
                                 channels, length));
  std::set<std::string> names;
  for (std::int32_t i = 0; i < channels; ++i) {
    Channel channel = readChannel(file, static_cast<std::size_t>(length), layout);
    while (!names.insert(channel.name).second)
      channel.name += '_';
    layout.channels.push_back(std::move(channel));
  }
}

Header readHeader(FileReader& file, CacheContent& content) {
  char fixed[kFixedHeader];
  file.read(fixed, sizeof fixed, "the header");
  const auto length = decode<std::int32_t>(fixed + 8, kLittle);
  const auto version = decode<std::int32_t>(fixed + 44, kLittle);
  Header header;
  header.count = decode<std::int64_t>(fixed + 48, kLittle);
  if (!std::string_view(fixed, 8).starts_with(kMagic) ||
      untilZero({fixed + 12, 32}) != "Extensible Particle Format" || version < 1 || version > 2)
    throw InputError(file.path(),
                     fmt::format("is no PRT of version 1 or 2 (says {}); save it again as "
                                 ".prt, .ply or .csv",
                                 version));
  if (length < static_cast<std::int32_t>(kFixedHeader) ||
      static_cast<std::uint64_t>(length) - kFixedHeader > file.remaining())
    throw InputError(file.path(), fmt::format("says a header of {} bytes; write it again", length));
  std::string chunks(static_cast<std::size_t>(length) - kFixedHeader, '\0');
  file.read(chunks.data(), chunks.size(), "the metadata");
  readMetadata(chunks, content);
  readChannels(file, header.layout);
  return header;
}

volume::ParticleSet readParticles(FileReader& file, const Header& header, CacheContent& content) {
  const RecordLayout& layout = header.layout;
  const bool unfinished = header.count < 0;
  const std::uint64_t room = maxInflated(file.remaining()) / layout.stride;
  const std::uint64_t count = unfinished ? room : static_cast<std::uint64_t>(header.count);
  if (count > room)
    throw InputError(file.path(), fmt::format("says {} particles of {} bytes, which its {} bytes "
                                              "cannot hold; write it again",
                                              count, layout.stride, file.size()));
  // Particles shrink to a half or a quarter; a header that promises more gets memory as it
  // delivers.
  const std::uint64_t likely = file.remaining() * 8 / layout.stride + 4096;
  if (count == 0) return readRecords(layout, 0, 0, {});
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
    content.notes.push_back("holds more data than the particles that its header counts");
  if (unfinished)
    content.notes.push_back(
        fmt::format("the writer did not finish this file; it holds {} particles", set.size()));
  return set;
}

CacheContent read(const std::filesystem::path& path, const ParamValues&) {
  FileReader file(path);
  CacheContent content;
  const Header header = readHeader(file, content);
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
  put(body, static_cast<std::int32_t>(typeNumber(type)));
  for (const T value : values)
    put(body, value);
  out.append("Meta");
  put(out, static_cast<std::int32_t>(body.size()));
  out.append(body);
}

/// Krakatoa's channel name for an attribute.
std::string channelName(const std::string& attribute) {
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
  std::string name = attribute.substr(0, kChannelName - 1);
  for (char& c : name)
    if (!((c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9'))) c = '_';
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
  const std::string name = channelName(attribute);
  if (!taken.insert(name).second)
    throw ConfigError(fmt::format("{}: two attributes would be the PRT channel '{}'; rename '{}'",
                                  path, name, attribute));
  list.append(name).append(kChannelName - name.size(), '\0');
  put(list, static_cast<std::int32_t>(typeNumber(type)));
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

  const std::string chunks = metadataChunks(particles.set, content);
  std::string header(kMagic);
  put(header, static_cast<std::int32_t>(kFixedHeader + chunks.size()));
  header.append("Extensible Particle Format").append(6, '\0');
  put(header, std::int32_t(2));
  put(header, static_cast<std::int64_t>(particles.set.size()));
  header += chunks;
  put(header, std::int32_t(4));
  put(header, static_cast<std::int32_t>(layout.channels.size()));
  put(header, static_cast<std::int32_t>(kChannelRecord));
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
