#include "ply_header.h"

#include <fmt/format.h>

#include "photosphere/core/error.h"
#include "text_number.h"

namespace photosphere::caches {

namespace {

constexpr std::size_t kMaxProperties = 4096;

struct TypeName {
  std::string_view name;
  Scalar type;
};
constexpr TypeName kTypes[] = {
    {"char", Scalar::i8},     {"uchar", Scalar::u8},   {"short", Scalar::i16},
    {"ushort", Scalar::u16},  {"int", Scalar::i32},    {"uint", Scalar::u32},
    {"float", Scalar::f32},   {"double", Scalar::f64}, {"int8", Scalar::i8},
    {"uint8", Scalar::u8},    {"int16", Scalar::i16},  {"uint16", Scalar::u16},
    {"int32", Scalar::i32},   {"uint32", Scalar::u32}, {"float32", Scalar::f32},
    {"float64", Scalar::f64}, {"int64", Scalar::i64},  {"uint64", Scalar::u64},
};

class HeaderParser {
 public:
  explicit HeaderParser(FileReader& file) : m_file(file) {}

  PlyHeader parse() {
    std::string_view line;
    const bool any = m_file.nextLine(line);
    if (any && trimmed(line).find('\r') != std::string_view::npos)
      fail("its lines end in CR alone, as on old Macs");
    if (!any || trimmed(line) != "ply") fail("does not begin with 'ply'");
    bool formatSeen = false;
    for (;;) {
      if (!m_file.nextLine(line)) fail("the file ends inside the header (no end_header)");
      const std::string_view whole = trimmed(line);
      std::string_view rest = whole;
      const std::string_view keyword = nextWord(rest);
      if (keyword == "end_header") break;
      if (keyword == "format") {
        format(rest);
        formatSeen = true;
      } else if (keyword == "element") {
        element(rest);
      } else if (keyword == "property") {
        property(rest);
      } else if (keyword == "comment" || keyword == "obj_info") {
        if (m_header.comments.size() < 1000) m_header.comments.emplace_back(trimmed(rest));
      } else if (!keyword.empty()) {
        fail(fmt::format("unknown header line '{}'", whole.substr(0, 60)));
      }
    }
    if (!formatSeen) fail("the header has no 'format' line");
    return std::move(m_header);
  }

 private:
  [[noreturn]] void fail(const std::string& reason) const {
    throw InputError(m_file.path(), fmt::format("PLY header line {}: {}; export the file again",
                                                m_file.lineNumber(), reason));
  }

  Scalar type(std::string_view name) const {
    for (const TypeName& known : kTypes)
      if (known.name == name) return known.type;
    fail(fmt::format("unknown type '{}'", name.substr(0, 40)));
  }

  void format(std::string_view rest) {
    const std::string_view name = nextWord(rest);
    m_header.ascii = name == "ascii";
    if (name == "binary_big_endian")
      m_header.order = ByteOrder::big;
    else if (!m_header.ascii && name != "binary_little_endian")
      fail(fmt::format("unknown format '{}'", name.substr(0, 40)));
  }

  void element(std::string_view rest) {
    PlyElement element;
    element.name = nextWord(rest);
    if (element.name.empty() || !parseInteger(nextWord(rest), element.count))
      fail("an element needs a name and a count");
    m_header.elements.push_back(std::move(element));
  }

  void property(std::string_view rest) {
    if (m_header.elements.empty()) fail("a property before any element");
    PlyElement& element = m_header.elements.back();
    if (element.properties.size() >= kMaxProperties) fail("more than 4096 properties");
    PlyProperty property;
    std::string_view word = nextWord(rest);
    if (word == "list") {
      property.isList = true;
      property.countType = type(nextWord(rest));
      if (isReal(property.countType)) fail("the count of a list must be an integer type");
      word = nextWord(rest);
    }
    property.type = type(word);
    property.name = nextWord(rest);
    if (property.name.empty()) fail("a property without a name");
    element.properties.push_back(std::move(property));
  }

  FileReader& m_file;
  PlyHeader m_header;
};

}  // namespace

bool PlyElement::hasLists() const {
  for (const PlyProperty& property : properties)
    if (property.isList) return true;
  return false;
}

std::size_t PlyElement::stride() const {
  std::size_t bytes = 0;
  for (const PlyProperty& property : properties)
    if (!property.isList) bytes += scalarSize(property.type);
  return bytes;
}

std::size_t PlyElement::smallest(bool ascii) const {
  if (ascii) return 2 * properties.size();
  std::size_t bytes = stride();
  for (const PlyProperty& property : properties)
    if (property.isList) bytes += scalarSize(property.countType);
  return bytes;
}

int PlyHeader::vertex() const {
  for (std::size_t i = 0; i < elements.size(); ++i)
    if (elements[i].name == "vertex") return static_cast<int>(i);
  return -1;
}

PlyHeader readPlyHeader(FileReader& file) {
  return HeaderParser(file).parse();
}

std::string_view plyTypeName(Scalar type) {
  for (const TypeName& known : kTypes)
    if (known.type == type) return known.name;
  return "float";
}

}  // namespace photosphere::caches
