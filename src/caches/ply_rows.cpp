#include "ply_rows.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>

#include "photosphere/core/error.h"
#include "text_number.h"

namespace photosphere::caches {

namespace {

[[noreturn]] void badValue(const FileReader& file, std::string_view word,
                           const PlyProperty& property) {
  throw InputError(
      file.path(),
      fmt::format("line {}: '{}' is not a {} for property '{}'; export the file again",
                  file.lineNumber(), shown(word), plyTypeName(property.type), property.name));
}

template <class T>
void storeInteger(FileReader& file, std::string_view word, const PlyProperty& property,
                  unsigned char* at) {
  T value = 0;
  double real = 0;
  if (!parseInteger(word, value)) {
    // Some writers put `255.0` into an integer property.
    if (!parseReal(word, real) || real != std::floor(real) || std::abs(real) > 0x1p53 ||
        real < static_cast<double>(std::numeric_limits<T>::min()) ||
        real > static_cast<double>(std::numeric_limits<T>::max()))
      badValue(file, word, property);
    value = static_cast<T>(real);
  }
  encode(at, value, ByteOrder::little);
}

/// Stores one word of text in the binary form of its property, little endian.
void storeText(FileReader& file, std::string_view word, const PlyProperty& property,
               unsigned char* at) {
  double real = 0;
  switch (property.type) {
    case Scalar::i8:
      return storeInteger<std::int8_t>(file, word, property, at);
    case Scalar::u8:
      return storeInteger<std::uint8_t>(file, word, property, at);
    case Scalar::i16:
      return storeInteger<std::int16_t>(file, word, property, at);
    case Scalar::u16:
      return storeInteger<std::uint16_t>(file, word, property, at);
    case Scalar::i32:
      return storeInteger<std::int32_t>(file, word, property, at);
    case Scalar::u32:
      return storeInteger<std::uint32_t>(file, word, property, at);
    case Scalar::i64:
      return storeInteger<std::int64_t>(file, word, property, at);
    case Scalar::u64:
      return storeInteger<std::uint64_t>(file, word, property, at);
    default:
      break;
  }
  if (!parseReal(word, real)) badValue(file, word, property);
  if (property.type == Scalar::f32)
    encode(at, static_cast<float>(real), ByteOrder::little);
  else
    encode(at, real, ByteOrder::little);
}

std::string_view nextFilledLine(FileReader& file, const PlyElement& element) {
  std::string_view line;
  do {
    if (!file.nextLine(line))
      throw InputError(file.path(), fmt::format("ends inside element '{}' of {} rows: the file is "
                                                "truncated; write it again",
                                                element.name, element.count));
  } while (trimmed(line).empty());
  return line;
}

std::uint64_t listLength(FileReader& file, const PlyProperty& property, ByteOrder order) {
  unsigned char raw[8];
  file.read(raw, scalarSize(property.countType), "a list");
  std::int64_t items = 0;
  switch (property.countType) {
    case Scalar::i8:
      items = decode<std::int8_t>(raw, order);
      break;
    case Scalar::u8:
      items = raw[0];
      break;
    case Scalar::i16:
      items = decode<std::int16_t>(raw, order);
      break;
    case Scalar::u16:
      items = decode<std::uint16_t>(raw, order);
      break;
    case Scalar::i32:
      items = decode<std::int32_t>(raw, order);
      break;
    case Scalar::u32:
      items = decode<std::uint32_t>(raw, order);
      break;
    default:
      items = decode<std::int64_t>(raw, order);
      break;
  }
  const std::uint64_t fits = file.remaining() / scalarSize(property.type);
  if (items < 0 || static_cast<std::uint64_t>(items) > fits)
    throw InputError(file.path(), fmt::format("list '{}' says {} items, and the file ends before",
                                              property.name, items));
  return static_cast<std::uint64_t>(items);
}

}  // namespace

void readTextRow(FileReader& file, const PlyElement& element, unsigned char* record) {
  std::string_view line = nextFilledLine(file, element);
  for (const PlyProperty& property : element.properties) {
    const std::string_view word = nextWord(line);
    if (word.empty())
      throw InputError(file.path(), fmt::format("line {}: no value for property '{}'",
                                                file.lineNumber(), property.name));
    if (!property.isList) {
      storeText(file, word, property, record);
      record += scalarSize(property.type);
      continue;
    }
    std::uint64_t items = 0;
    if (!parseInteger(word, items)) badValue(file, word, property);
    for (; items > 0; --items)
      if (nextWord(line).empty())
        throw InputError(file.path(), fmt::format("line {}: list '{}' is shorter than it says",
                                                  file.lineNumber(), property.name));
  }
  if (!nextWord(line).empty())
    throw InputError(file.path(),
                     fmt::format("line {}: more values than element '{}' has: the file "
                                 "is damaged; write it again",
                                 file.lineNumber(), element.name));
}

void readBinaryRow(FileReader& file, const PlyElement& element, ByteOrder order,
                   unsigned char* record) {
  for (const PlyProperty& property : element.properties) {
    if (property.isList) {
      file.skip(listLength(file, property, order) * scalarSize(property.type), "a list");
      continue;
    }
    file.read(record, scalarSize(property.type), "element '" + element.name + "'");
    record += scalarSize(property.type);
  }
}

void checkCount(const FileReader& file, const PlyElement& element, bool ascii) {
  const std::size_t smallest = element.smallest(ascii);
  const std::uint64_t fits = smallest == 0 ? 0 : (file.remaining() + (ascii ? 1 : 0)) / smallest;
  if (smallest > 0 && element.count > fits)
    throw InputError(
        file.path(),
        fmt::format("says {} of element '{}', but has room for at most {}: the file is "
                    "truncated or its header is wrong; write it again",
                    element.count, element.name, fits));
}

void checkEnd(FileReader& file, const PlyHeader& header) {
  const std::uint64_t rest = file.remaining();
  char blanks[256] = {};
  bool blank = header.ascii || rest <= 2;  // some writers end binary data with a line end
  for (std::size_t got = 0; blank && (got = file.readSome(blanks, sizeof blanks)) > 0;)
    blank = std::string_view(blanks, got).find_first_not_of(" \t\r\n") == std::string_view::npos;
  if (!blank)
    throw InputError(file.path(),
                     fmt::format("holds {} bytes after the last of its {} elements: its header or "
                                 "its data is damaged; write it again",
                                 rest, header.elements.size()));
}

void skipElement(FileReader& file, const PlyElement& element, const PlyHeader& header) {
  checkCount(file, element, header.ascii);
  if (element.properties.empty()) return;
  if (!header.ascii && !element.hasLists())
    return file.skip(element.count * element.stride(), "element '" + element.name + "'");
  std::vector<unsigned char> scratch(element.stride() + 1);
  for (std::uint64_t i = 0; i < element.count; ++i) {
    if (header.ascii)
      nextFilledLine(file, element);
    else
      readBinaryRow(file, element, header.order, scratch.data());
  }
}

}  // namespace photosphere::caches
