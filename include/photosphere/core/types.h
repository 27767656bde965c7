#pragma once
// Vector, matrix and colour types of the whole project: GLM under project names.

#include <glm/mat3x3.hpp>
#include <glm/mat4x4.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <limits>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

namespace photosphere {

using Vec2f = glm::vec2;
using Vec2d = glm::dvec2;
using Vec2i = glm::ivec2;
using Vec3f = glm::vec3;
using Vec3d = glm::dvec3;
using Vec3i = glm::ivec3;
using Vec4f = glm::vec4;
using Mat3d = glm::dmat3;
using Mat4d = glm::dmat4;

/// Linear colour in the rendering space; its unit is that of the quantity it holds.
using Rgb = glm::vec3;

inline float maxComponent(const Vec3f& v) {
  return glm::max(v.x, glm::max(v.y, v.z));
}
inline double maxComponent(const Vec3d& v) {
  return glm::max(v.x, glm::max(v.y, v.z));
}
inline float meanComponent(const Vec3f& v) {
  return (v.x + v.y + v.z) * (1.0f / 3.0f);
}

/// Axis-aligned box; empty (max < min) when default constructed.
template <class V>
struct Box {
  using T = typename V::value_type;
  V min = V(std::numeric_limits<T>::max());
  V max = V(std::numeric_limits<T>::lowest());

  bool empty() const { return max.x < min.x || max.y < min.y || max.z < min.z; }
  V extent() const { return empty() ? V(T(0)) : max - min; }
  V center() const { return min + (max - min) / T(2); }
  /// One of the eight corners of a box in space; bits 0, 1 and 2 choose the upper x, y and z.
  V corner(int i) const {
    return {i & 1 ? max.x : min.x, i & 2 ? max.y : min.y, i & 4 ? max.z : min.z};
  }
  void grow(const V& p) {
    min = glm::min(min, p);
    max = glm::max(max, p);
  }
  void grow(const Box& b) {
    if (b.empty()) return;
    grow(b.min);
    grow(b.max);
  }
  /// The point of the box that is nearest to another.
  V nearest(const V& p) const { return glm::clamp(p, min, max); }
  bool contains(const V& p) const {
    return p.x >= min.x && p.y >= min.y && p.z >= min.z && p.x <= max.x && p.y <= max.y &&
           p.z <= max.z;
  }
};
using Box3f = Box<Vec3f>;
using Box3d = Box<Vec3d>;
using Box3i = Box<Vec3i>;

/// Applies an affine matrix to a position.
inline Vec3d transformPoint(const Mat4d& m, const Vec3d& p) {
  return Vec3d(m * glm::dvec4(p, 1.0));
}
/// The box around what an affine matrix makes of a box that is not empty.
inline Box3d transformBox(const Mat4d& m, const Box3d& box) {
  Box3d out;
  for (int corner = 0; corner < 8; ++corner)
    out.grow(transformPoint(m, box.corner(corner)));
  return out;
}
/// Applies the linear part of an affine matrix to a direction or displacement.
inline Vec3d transformVector(const Mat4d& m, const Vec3d& v) {
  return Mat3d(m) * v;
}

inline constexpr double kPi = 3.14159265358979323846;
inline constexpr float kPiF = 3.14159265358979323846f;
inline constexpr float kInfinity = std::numeric_limits<float>::infinity();

}  // namespace photosphere
