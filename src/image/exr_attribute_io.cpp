#include "exr_attribute_io.h"

#include <OpenEXR/ImfChromaticitiesAttribute.h>
#include <OpenEXR/ImfDoubleAttribute.h>
#include <OpenEXR/ImfFloatAttribute.h>
#include <OpenEXR/ImfIntAttribute.h>
#include <OpenEXR/ImfMatrixAttribute.h>
#include <OpenEXR/ImfRationalAttribute.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <OpenEXR/ImfTimeCodeAttribute.h>
#include <OpenEXR/ImfVecAttribute.h>

#include <algorithm>
#include <array>
#include <string_view>

namespace photosphere::image {
namespace {

Imath::V2f toImath(const Vec2f& v) {
  return {v.x, v.y};
}
Vec2f fromImath(const Imath::V2f& v) {
  return {v.x, v.y};
}

// Imath multiplies row vectors from the left, GLM column vectors from the right: the file's matrix
// is the transpose. GLM indexes [column][row] and Imath [row][column], so the indices stay as they
// are.
Imath::M44f toImath(const Mat4d& m) {
  Imath::M44f result;
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 4; ++j)
      result[i][j] = static_cast<float>(m[i][j]);
  return result;
}
Mat4d fromImath(const Imath::M44f& m) {
  Mat4d result;
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 4; ++j)
      result[i][j] = m[i][j];
  return result;
}

struct Putter {
  const std::string& name;
  Imf::Header& header;

  template <class T>
  void put(const T& value) const {
    header.insert(name, Imf::TypedAttribute<T>(value));
  }
  void operator()(const std::string& v) const { put(v); }
  void operator()(std::int32_t v) const { put(static_cast<int>(v)); }
  void operator()(float v) const { put(v); }
  void operator()(double v) const { put(v); }
  void operator()(const Vec2f& v) const { put(toImath(v)); }
  void operator()(const Vec3f& v) const { put(Imath::V3f(v.x, v.y, v.z)); }
  void operator()(const Mat4d& v) const { put(toImath(v)); }
  void operator()(const Rational& v) const {
    put(Imf::Rational(v.numerator, static_cast<int>(v.denominator)));
  }
  void operator()(const Chromaticities& v) const {
    put(Imf::Chromaticities(toImath(v.red), toImath(v.green), toImath(v.blue), toImath(v.white)));
  }
  void operator()(const TimeCode& v) const {
    put(Imf::TimeCode(v.hours, v.minutes, v.seconds, v.frame, v.dropFrame, false, v.fieldPhase));
  }
};

template <class T>
const T* as(const Imf::Attribute& attribute) {
  const auto* typed = dynamic_cast<const Imf::TypedAttribute<T>*>(&attribute);
  return typed ? &typed->value() : nullptr;
}

std::optional<ExrAttribute> convert(const Imf::Attribute& attribute) {
  if (const auto* v = as<std::string>(attribute)) return *v;
  if (const auto* v = as<int>(attribute)) return std::int32_t{*v};
  if (const auto* v = as<float>(attribute)) return *v;
  if (const auto* v = as<double>(attribute)) return *v;
  if (const auto* v = as<Imath::V2f>(attribute)) return fromImath(*v);
  if (const auto* v = as<Imath::V3f>(attribute)) return Vec3f(v->x, v->y, v->z);
  if (const auto* v = as<Imath::M44f>(attribute)) return fromImath(*v);
  if (const auto* v = as<Imf::Rational>(attribute)) return Rational{v->n, v->d};
  if (const auto* v = as<Imf::Chromaticities>(attribute))
    return Chromaticities{fromImath(v->red), fromImath(v->green), fromImath(v->blue),
                          fromImath(v->white)};
  if (const auto* v = as<Imf::TimeCode>(attribute))
    return TimeCode{v->hours(), v->minutes(),   v->seconds(),
                    v->frame(), v->dropFrame(), v->fieldPhase()};
  return std::nullopt;
}

}  // namespace

void putAttributes(const ExrAttributes& attributes, Imf::Header& header) {
  for (const auto& [name, value] : attributes)
    std::visit(Putter{name, header}, value);
}

ExrAttributes getAttributes(const Imf::Header& header) {
  // The layout of the file and not something said about the picture.
  constexpr std::array<std::string_view, 5> structural{"type", "name", "chunkCount", "version",
                                                       "dwaCompressionLevel"};
  ExrAttributes attributes;
  for (auto at = header.begin(); at != header.end(); ++at) {
    if (std::find(structural.begin(), structural.end(), at.name()) != structural.end()) continue;
    if (auto value = convert(at.attribute())) attributes.emplace(at.name(), std::move(*value));
  }
  return attributes;
}

}  // namespace photosphere::image
