// PLY point clouds: ascii and binary of both byte orders, the properties of element `vertex`.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "byte_writer.h"
#include "columns.h"
#include "content.h"
#include "photosphere/caches/cache_format.h"
#include "photosphere/core/error.h"
#include "ply_header.h"
#include "ply_rows.h"
#include "text_number.h"

namespace photosphere::caches::plugins {
namespace {

bool recognize(std::string_view head) {
  return head.starts_with("ply\n") || head.starts_with("ply\r") || head.starts_with("ply ");
}

// ---- reading

RecordLayout layoutOf(const PlyElement& vertex, const PlyHeader& header, const std::string& path) {
  std::vector<std::string> names;
  std::vector<Component> components;
  RecordLayout layout;
  layout.order = header.ascii ? ByteOrder::little : header.order;
  for (const PlyProperty& property : vertex.properties) {
    if (property.isList) continue;
    names.push_back(property.name);
    components.push_back({property.type, layout.stride});
    layout.stride += scalarSize(property.type);
  }
  const std::vector<ColumnGroup> groups = groupColumns(names);
  if (const std::string name = repeatedColumn(names, groups); !name.empty())
    throw InputError(
        path,
        fmt::format("element 'vertex' has several properties '{}'; rename all but one", name));
  for (const ColumnGroup& group : groups) {
    Channel channel{group.name, {}, 1};
    for (const std::size_t column : group.columns)
      channel.components.push_back(components[column]);
    const Scalar first = channel.components.front().type;
    // Colours in integers run over the whole range of their type.
    if (group.name == "Cd" || lowered(group.name) == "alpha")
      channel.divisor = first == Scalar::u8 ? 255.0 : first == Scalar::u16 ? 65535.0 : 1.0;
    layout.channels.push_back(std::move(channel));
  }
  return layout;
}

volume::ParticleSet readVertices(FileReader& file, const PlyElement& vertex,
                                 const PlyHeader& header) {
  checkCount(file, vertex, header.ascii);
  const RecordLayout layout = layoutOf(vertex, header, file.path());
  const bool positions = std::any_of(layout.channels.begin(), layout.channels.end(),
                                     [](const Channel& channel) { return channel.name == "P"; });
  if (!positions)
    throw InputError(file.path(),
                     "element 'vertex' has no properties x, y, z; export with positions");
  const bool direct = !header.ascii && !vertex.hasLists();
  return readRecords(layout, vertex.count, vertex.count,
                     [&](unsigned char* records, std::size_t count) {
                       if (direct) {
                         file.read(records, count * layout.stride, "element 'vertex'");
                         return count;
                       }
                       for (std::size_t i = 0; i < count; ++i, records += layout.stride) {
                         if (header.ascii)
                           readTextRow(file, vertex, records);
                         else
                           readBinaryRow(file, vertex, header.order, records);
                       }
                       return count;
                     });
}

CacheContent read(const std::filesystem::path& path, const ParamValues&) {
  FileReader file(path);
  const PlyHeader header = readPlyHeader(file);
  const int vertex = header.vertex();
  if (vertex < 0)
    throw InputError(file.path(), "has no element 'vertex'; export it as a point cloud");
  CacheContent content;
  for (int i = 0; i < vertex; ++i)
    skipElement(file, header.elements[static_cast<std::size_t>(i)], header);
  const PlyElement& points = header.elements[static_cast<std::size_t>(vertex)];
  content.particles.push_back(readVertices(file, points, header));
  content.particleNames.push_back("points");
  for (std::size_t i = static_cast<std::size_t>(vertex) + 1; i < header.elements.size(); ++i)
    skipElement(file, header.elements[i], header);
  checkEnd(file, header);
  if (!header.comments.empty())
    content.metadata["comment"] = fmt::format("{}", fmt::join(header.comments, "\n"));
  for (const PlyElement& element : header.elements)
    if (element.name != "vertex" && element.count > 0)
      content.notes.push_back(
          fmt::format("{} of element '{}' not read (only vertices are particles)", element.count,
                      element.name));
  for (const PlyProperty& property : points.properties)
    if (property.isList)
      content.notes.push_back(fmt::format("list property '{}' not read", property.name));
  return content;
}

// ---- writing

/// 64-bit integers have no PLY type of 1994: the narrowest that holds every value.
Scalar integerType(const std::vector<std::int64_t>& values, const std::string& path,
                   const std::string& name) {
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  const std::int64_t min = values.empty() ? 0 : *low, max = values.empty() ? 0 : *high;
  if (min >= INT32_MIN && max <= INT32_MAX) return Scalar::i32;
  if (min >= 0 && max <= std::int64_t(UINT32_MAX)) return Scalar::u32;
  if (min < -(std::int64_t(1) << 53) || max > (std::int64_t(1) << 53))
    throw ConfigError(
        fmt::format("{}: attribute '{}' needs 64-bit integers, which PLY has not; write "
                    ".vdb, .prt or .csv",
                    path, name));
  return Scalar::f64;
}

/// True when colours are whole 255ths, so that the bytes which most programs expect lose nothing.
bool fitsBytes(const std::vector<float>& values) {
  return std::all_of(values.begin(), values.end(), [](float value) {
    return value >= 0 && value <= 1 &&
           static_cast<float>(std::round(value * 255.0f) / 255.0) == value;
  });
}

std::string propertyName(std::string name) {
  std::replace_if(
      name.begin(), name.end(), [](char c) { return c >= 0 && c <= ' '; }, '_');
  return name;
}

struct Plan {
  RecordLayout layout;
  std::string header;
};

void addChannel(Plan& plan, const std::string& name, int arity, Scalar type, double factor) {
  Channel channel{name, {}, factor};
  for (const std::string& column : columnNames(name, arity)) {
    plan.header += fmt::format("property {} {}\n", plyTypeName(type), propertyName(column));
    channel.components.push_back({type, plan.layout.stride});
    plan.layout.stride += scalarSize(type);
  }
  plan.layout.channels.push_back(std::move(channel));
}

Plan planOf(const WritableParticles& particles, const std::string& encoding,
            const std::string& path, const std::map<std::string, std::string>& metadata) {
  Plan plan;
  plan.layout.order = encoding == "binary_big_endian" ? ByteOrder::big : ByteOrder::little;
  plan.header = fmt::format("ply\nformat {} 1.0\n", encoding);
  if (const auto comment = metadata.find("comment"); comment != metadata.end()) {
    std::string text = comment->second;
    text.erase(std::remove(text.begin(), text.end(), '\r'), text.end());
    for (std::size_t begin = 0, end = 0; begin < text.size(); begin = end + 1) {
      end = std::min(text.find('\n', begin), text.size());
      plan.header += "comment " + text.substr(begin, end - begin) + "\n";
    }
  }
  plan.header += fmt::format("element vertex {}\n", particles.set.size());
  addChannel(plan, "P", 3, positionType(particles.set), 1);
  for (const volume::Attribute* const column : particles.attributes) {
    const volume::Attribute& attribute = *column;
    Scalar type = memoryType(attribute);
    double factor = 1;
    if (const auto* wide = std::get_if<std::vector<std::int64_t>>(&attribute.data))
      type = integerType(*wide, path, attribute.name);
    const auto* colour = std::get_if<std::vector<float>>(&attribute.data);
    if (attribute.name == "Cd" && attribute.arity == 3 && colour && fitsBytes(*colour)) {
      type = Scalar::u8;
      factor = 255;
    }
    addChannel(plan, attribute.name, attribute.arity, type, factor);
  }
  plan.header += "end_header\n";
  return plan;
}

void appendText(std::string& text, const unsigned char* at, Scalar type) {
  const auto order = ByteOrder::little;
  switch (type) {
    case Scalar::u8:
      return appendNumber(text, static_cast<unsigned>(*at));
    case Scalar::i32:
      return appendNumber(text, decode<std::int32_t>(at, order));
    case Scalar::u32:
      return appendNumber(text, decode<std::uint32_t>(at, order));
    case Scalar::f32:
      return appendNumber(text, decode<float>(at, order));
    default:
      return appendNumber(text, decode<double>(at, order));
  }
}

void write(const std::filesystem::path& path, const CacheContent& content,
           const ParamValues& options) {
  const WritableParticles particles = onlyParticles(path, content, "PLY", false);
  const std::string& encoding = options.text("encoding");
  const Plan plan = planOf(particles, encoding, path.string(), content.metadata);
  ByteWriter file(path);
  file.write(plan.header);
  std::string text;
  writeRecords(particles.set, plan.layout, [&](const unsigned char* records, std::size_t count) {
    if (encoding != "ascii") return file.write(records, count * plan.layout.stride);
    text.clear();
    for (std::size_t i = 0; i < count; ++i, records += plan.layout.stride) {
      for (const Channel& channel : plan.layout.channels)
        for (const Component& component : channel.components) {
          appendText(text, records + component.offset, component.type);
          text += ' ';
        }
      text.back() = '\n';
    }
    file.write(text);
  });
  file.commit();
}

constexpr Param kParams[] = {
    {.name = "encoding",
     .type = ParamType::text,
     .unit = "",
     .defaultText = "binary_little_endian",
     .help = "how the numbers are written",
     .choices = "binary_little_endian|binary_big_endian|ascii"},
};
constexpr std::string_view kExtensions[] = {".ply"};

}  // namespace

extern const CacheFormat ply;
const CacheFormat ply = {"ply", "PLY point clouds", kParams, kExtensions, recognize, read, write};

}  // namespace photosphere::caches::plugins
