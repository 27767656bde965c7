#include "records.h"

#include <algorithm>
#include <type_traits>
#include <variant>

namespace photosphere::caches {

namespace {

constexpr std::size_t kBlock = std::size_t(1) << 20;

struct Half {
  std::uint16_t bits;
};

/// Calls `use` with a value of the C++ type of a scalar.
template <class Use>
void dispatch(Scalar type, Use&& use) {
  // NOLINTBEGIN(bugprone-branch-clone): the calls differ in the type of their argument
  switch (type) {
    case Scalar::i8:
      return use(std::int8_t());
    case Scalar::u8:
      return use(std::uint8_t());
    case Scalar::i16:
      return use(std::int16_t());
    case Scalar::u16:
      return use(std::uint16_t());
    case Scalar::i32:
      return use(std::int32_t());
    case Scalar::u32:
      return use(std::uint32_t());
    case Scalar::i64:
      return use(std::int64_t());
    case Scalar::u64:
      return use(std::uint64_t());
    case Scalar::f16:
      return use(Half());
    case Scalar::f32:
      return use(float());
    case Scalar::f64:
      return use(double());
  }
  // NOLINTEND(bugprone-branch-clone)
}

template <class Stored>
auto decodeScalar(const unsigned char* bytes, ByteOrder order) {
  if constexpr (std::is_same_v<Stored, Half>)
    return floatFromHalf(decode<std::uint16_t>(bytes, order));
  else
    return decode<Stored>(bytes, order);
}

volume::AttributeData emptyColumn(const Channel& channel) {
  bool real = channel.divisor != 1, wide = false, longer = false;
  for (const Component& component : channel.components) {
    real = real || isReal(component.type);
    wide = wide || component.type == Scalar::f64;
    longer = longer || component.type == Scalar::u32 || component.type == Scalar::i64 ||
             component.type == Scalar::u64;
  }
  if (wide || (real && longer)) return std::vector<double>();
  if (real) return std::vector<float>();
  if (longer) return std::vector<std::int64_t>();
  return std::vector<std::int32_t>();
}

/// Decodes one component of `count` records to `out[0], out[step], ..`.
template <class Out>
void decodeComponent(const unsigned char* records, std::size_t count, const RecordLayout& layout,
                     const Component& component, double divisor, Out* out, std::size_t step) {
  dispatch(component.type, [&](auto stored) {
    using Stored = decltype(stored);
    const unsigned char* at = records + component.offset;
    for (std::size_t i = 0; i < count; ++i, at += layout.stride) {
      const auto value = decodeScalar<Stored>(at, layout.order);
      if constexpr (std::is_floating_point_v<Out>)
        out[i * step] = divisor == 1 ? static_cast<Out>(value)
                                     : static_cast<Out>(static_cast<double>(value) / divisor);
      else if constexpr (!std::is_floating_point_v<decltype(value)>)
        out[i * step] = static_cast<Out>(value);  // emptyColumn never pairs real with integer
    }
  });
}

class Columns {
 public:
  Columns(const RecordLayout& layout, std::uint64_t reserve) : m_layout(layout) {
    const std::size_t expected = static_cast<std::size_t>(reserve);
    for (const Channel& channel : layout.channels) {
      if (isPosition(channel)) {
        m_set.positions.reserve(expected);
        continue;
      }
      volume::Attribute attribute;
      attribute.name = channel.name;
      attribute.arity = static_cast<int>(channel.components.size());
      attribute.data = emptyColumn(channel);
      std::visit([&](auto& column) { column.reserve(expected * channel.components.size()); },
                 attribute.data);
      m_set.attributes.push_back(std::move(attribute));
    }
  }

  void append(const unsigned char* records, std::size_t count) {
    const std::size_t before = m_done;
    m_done += count;
    std::size_t index = 0;
    for (const Channel& channel : m_layout.channels) {
      if (isPosition(channel)) {
        m_set.positions.resize(m_done);
        for (int c = 0; c < 3; ++c)
          decodeComponent(records, count, m_layout, channel.components[static_cast<std::size_t>(c)],
                          channel.divisor, &m_set.positions[before][c], 3);
        continue;
      }
      std::visit([&](auto& column) { appendColumn(column, channel, records, before, count); },
                 m_set.attributes[index++].data);
    }
  }

  volume::ParticleSet take() { return std::move(m_set); }

 private:
  static bool isPosition(const Channel& channel) {
    return channel.name == "P" && channel.components.size() == 3;
  }

  template <class T>
  void appendColumn(std::vector<T>& column, const Channel& channel, const unsigned char* records,
                    std::size_t before, std::size_t count) {
    if constexpr (std::is_arithmetic_v<T>) {
      const std::size_t arity = channel.components.size();
      column.resize(m_done * arity);
      for (std::size_t c = 0; c < arity; ++c)
        decodeComponent(records, count, m_layout, channel.components[c], channel.divisor,
                        &column[before * arity + c], arity);
    }
  }

  const RecordLayout& m_layout;
  volume::ParticleSet m_set;
  std::size_t m_done = 0;
};

template <class In>
void encodeComponent(const In* in, std::size_t step, std::size_t count, const RecordLayout& layout,
                     const Component& component, double factor, unsigned char* records) {
  dispatch(component.type, [&](auto stored) {
    using Stored = decltype(stored);
    if constexpr (!std::is_same_v<Stored, Half>) {
      unsigned char* at = records + component.offset;
      for (std::size_t i = 0; i < count; ++i, at += layout.stride) {
        Stored value;
        if constexpr (std::is_floating_point_v<In> && !std::is_floating_point_v<Stored>)
          value = static_cast<Stored>(std::lround(static_cast<double>(in[i * step]) * factor));
        else
          value = static_cast<Stored>(in[i * step]);
        encode(at, value, layout.order);
      }
    }
  });
}

}  // namespace

std::size_t scalarSize(Scalar type) {
  switch (type) {
    case Scalar::i8:
    case Scalar::u8:
      return 1;
    case Scalar::i16:
    case Scalar::u16:
    case Scalar::f16:
      return 2;
    case Scalar::i32:
    case Scalar::u32:
    case Scalar::f32:
      return 4;
    default:
      return 8;
  }
}

volume::ParticleSet readRecords(const RecordLayout& layout, std::uint64_t count,
                                std::uint64_t reserve, const FetchRecords& fetch) {
  const std::size_t perBlock =
      std::max<std::size_t>(1, kBlock / std::max<std::size_t>(1, layout.stride));
  std::vector<unsigned char> block(
      static_cast<std::size_t>(std::min<std::uint64_t>(count, perBlock)) * layout.stride);
  Columns columns(layout, reserve);
  for (std::uint64_t done = 0; done < count;) {
    const std::size_t wanted =
        static_cast<std::size_t>(std::min<std::uint64_t>(count - done, perBlock));
    const std::size_t got = fetch(block.data(), wanted);
    columns.append(block.data(), got);
    done += got;
    if (got < wanted) break;
  }
  return columns.take();
}

void writeRecords(const volume::ParticleSet& particles, const RecordLayout& layout,
                  const std::function<void(const unsigned char*, std::size_t)>& put) {
  const std::size_t perBlock =
      std::max<std::size_t>(1, kBlock / std::max<std::size_t>(1, layout.stride));
  std::vector<unsigned char> block(std::min(perBlock, particles.size()) * layout.stride);
  for (std::size_t begin = 0; begin < particles.size(); begin += perBlock) {
    const std::size_t count = std::min(perBlock, particles.size() - begin);
    for (const Channel& channel : layout.channels) {
      const std::size_t arity = channel.components.size();
      for (std::size_t c = 0; c < arity; ++c) {
        if (channel.name == "P") {
          encodeComponent(&particles.positions[begin][static_cast<int>(c)], 3, count, layout,
                          channel.components[c], channel.divisor, block.data());
          continue;
        }
        std::visit(
            [&](const auto& column) {
              using Value = typename std::decay_t<decltype(column)>::value_type;
              if constexpr (std::is_arithmetic_v<Value>)
                encodeComponent(&column[begin * arity + c], arity, count, layout,
                                channel.components[c], channel.divisor, block.data());
            },
            particles.find(channel.name)->data);
      }
    }
    put(block.data(), count);
  }
}

Scalar positionType(const volume::ParticleSet& particles) {
  const auto isFloat = [](double v) {
    return v != v || static_cast<double>(static_cast<float>(v)) == v;
  };
  for (const Vec3d& p : particles.positions)
    if (!isFloat(p.x) || !isFloat(p.y) || !isFloat(p.z)) return Scalar::f64;
  return Scalar::f32;
}

Scalar memoryType(const volume::Attribute& attribute) {
  constexpr Scalar types[] = {Scalar::f32, Scalar::f64, Scalar::i32, Scalar::i64, Scalar::i8};
  return types[attribute.data.index()];
}

}  // namespace photosphere::caches
