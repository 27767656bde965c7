#include "prt_header.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "columns.h"
#include "photosphere/core/error.h"
#include "text_number.h"

namespace photosphere::caches {

namespace {

constexpr std::size_t kMaxStride = std::size_t(1) << 20;
constexpr Scalar kTypes[] = {Scalar::i16, Scalar::i32, Scalar::i64, Scalar::f16,
                             Scalar::f32, Scalar::f64, Scalar::u16, Scalar::u32,
                             Scalar::u64, Scalar::i8,  Scalar::u8};

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
    if (!text.empty())
      content.metadata[channel.empty() ? name : fmt::format("{}.{}", channel, name)] = text;
  }
}

Channel readChannel(FileReader& file, std::size_t recordLength, RecordLayout& layout) {
  std::vector<char> record(recordLength);
  file.read(record.data(), record.size(), "the channel list");
  const std::string name = untilZero({record.data(), kPrtChannelName});
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
  if (channels < 1 || channels > static_cast<std::int32_t>(kMaxPrtChannels) ||
      length < static_cast<std::int32_t>(kPrtChannelRecord) || length > 4096 ||
      static_cast<std::uint64_t>(channels) > file.remaining() / static_cast<std::uint64_t>(length))
    throw InputError(file.path(),
                     fmt::format("says {} channels of {} bytes: the header is damaged; "
                                 "write it again",
                                 channels, length));
  std::set<std::string> names;
  std::size_t components = 0;
  for (std::int32_t i = 0; i < channels; ++i) {
    Channel channel = readChannel(file, static_cast<std::size_t>(length), layout);
    // Channels that share no byte have no more components than a particle has bytes.
    if (components += channel.components.size(); components > kMaxStride)
      throw InputError(file.path(), fmt::format("channel '{}' is the first of more than {} bytes a "
                                                "particle: the header is damaged; write it again",
                                                channel.name, kMaxStride));
    while (!names.insert(channel.name).second)
      channel.name += '_';
    layout.channels.push_back(std::move(channel));
  }
}

}  // namespace

int prtTypeNumber(Scalar type) {
  return static_cast<int>(std::find(std::begin(kTypes), std::end(kTypes), type) - kTypes);
}

PrtHeader readPrtHeader(FileReader& file, CacheContent& content) {
  char fixed[kPrtFixedHeader];
  file.read(fixed, sizeof fixed, "the header");
  const auto length = decode<std::int32_t>(fixed + 8, kLittle);
  const auto version = decode<std::int32_t>(fixed + 44, kLittle);
  PrtHeader header;
  header.count = decode<std::int64_t>(fixed + 48, kLittle);
  if (!std::string_view(fixed, 8).starts_with(kPrtMagic) ||
      untilZero({fixed + 12, 32}) != "Extensible Particle Format" || version < 1 || version > 2)
    throw InputError(file.path(),
                     fmt::format("is no PRT of version 1 or 2 (says {}); save it again as "
                                 ".prt, .ply or .csv",
                                 version));
  if (header.count < kPrtUnfinished)
    throw InputError(file.path(), fmt::format("says {} particles: the header is damaged; write it "
                                              "again",
                                              header.count));
  if (length < static_cast<std::int32_t>(kPrtFixedHeader) ||
      static_cast<std::uint64_t>(length) - kPrtFixedHeader > file.remaining())
    throw InputError(file.path(), fmt::format("says a header of {} bytes; write it again", length));
  std::string chunks(static_cast<std::size_t>(length) - kPrtFixedHeader, '\0');
  file.read(chunks.data(), chunks.size(), "the metadata");
  readMetadata(chunks, content);
  readChannels(file, header.layout);
  return header;
}

}  // namespace photosphere::caches
