#include "photosphere/scene/keys.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/gtc/quaternion.hpp>

namespace photosphere::scene {

namespace {

constexpr std::size_t kMatrixNumbers = 16;

Mat4d matrixOf(const std::vector<double>& rows) {
  Mat4d m(1.0);
  for (int i = 0; i < 16; ++i)
    m[i % 4][i / 4] = rows.at(static_cast<std::size_t>(i));
  return m;
}

std::vector<double> rowsOf(const Mat4d& m) {
  std::vector<double> rows;
  for (int i = 0; i < 16; ++i)
    rows.push_back(m[i % 4][i / 4]);
  return rows;
}

double between(double a, double b, double t) {
  return glm::clamp(a * (1 - t) + b * t, std::min(a, b), std::max(a, b));
}

// An affine matrix as translation, rotation and what remains, a symmetric stretch; of a mirror the
// stretch is negative.
struct Motion {
  Vec3d translation;
  glm::dquat rotation;
  Mat3d stretch;
};

// The rotation nearest to a matrix, by Newton's iteration (Higham 1986).
Mat3d nearestRotation(const Mat3d& m) {
  Mat3d r = m * (1 / glm::length(m[0]));
  for (int i = 0; i < 100; ++i) {
    const Mat3d next = (r + glm::inverse(glm::transpose(r))) * 0.5;
    double change = 0;
    for (int c = 0; c < 3; ++c)
      change = std::max(change, glm::length(next[c] - r[c]));
    r = next;
    if (change < 1e-15) break;
  }
  return glm::determinant(r) < 0 ? -r : r;
}

Motion motionOf(const Mat4d& m) {
  const Mat3d rotation = nearestRotation(Mat3d(m));
  return {Vec3d(m[3]), glm::quat_cast(rotation), glm::transpose(rotation) * Mat3d(m)};
}

// Slerp by halving the angle, which needs no function that differs between CPUs.
glm::dquat turned(glm::dquat a, glm::dquat b, double t) {
  if (glm::dot(a, b) < 0) b = -b;
  for (int i = 0; i < 24; ++i) {
    const glm::dquat middle = glm::normalize(a + b);
    const bool late = t >= 0.5;
    (late ? a : b) = middle;
    t = late ? 2 * t - 1 : 2 * t;
  }
  return glm::normalize(a * (1 - t) + b * t);
}

std::vector<double> matrixBetween(const std::vector<double>& a, const std::vector<double>& b,
                                  double t) {
  const Motion from = motionOf(matrixOf(a)), to = motionOf(matrixOf(b));
  const Mat3d stretch = from.stretch * (1 - t) + to.stretch * t;
  Mat4d m(glm::mat3_cast(turned(from.rotation, to.rotation, t)) * stretch);
  for (int i = 0; i < 3; ++i)
    m[3][i] = between(from.translation[i], to.translation[i], t);
  return rowsOf(m);
}

ParamValue paramValue(ParamType type, std::vector<double> numbers) {
  if (type == ParamType::real) return numbers.front();
  return numbers;
}

}  // namespace

bool isKeyable(ParamType type) {
  return type == ParamType::real || type == ParamType::rgb || type == ParamType::vec2 ||
         type == ParamType::vec3 || type == ParamType::matrix;
}

std::vector<double> valueAt(ParamType type, const Track& track, double time) {
  const auto after =
      std::upper_bound(track.begin(), track.end(), time,
                       [](double frame, const Key& key) { return frame < key.frame; });
  if (after == track.begin()) return track.front().value;
  const Key& from = *(after - 1);
  if (after == track.end() || from.frame == time) return from.value;
  const double t = (time - from.frame) / (after->frame - from.frame);
  if (type == ParamType::matrix) return matrixBetween(from.value, after->value, t);
  std::vector<double> value;
  for (std::size_t i = 0; i < from.value.size(); ++i)
    value.push_back(between(from.value[i], after->value[i], t));
  return value;
}

std::string matrixComplaint(const Track& track) {
  int sides = 0;
  for (const Key& key : track) {
    if (key.value.size() != kMatrixNumbers) continue;
    const Mat4d m = matrixOf(key.value);
    const double volume = glm::determinant(Mat3d(m));
    if (m[0][3] != 0 || m[1][3] != 0 || m[2][3] != 0 || m[3][3] != 1 || !(std::abs(volume) > 1e-30))
      return fmt::format(
          "the key at frame {} must be affine and invertible: row-major, its last row 0, 0, 0, 1",
          key.frame);
    sides |= volume > 0 ? 1 : 2;
  }
  return sides == 3 ? "some keys mirror and some do not; nothing invertible lies between them" : "";
}

void setToTime(const Tracks& tracks, double time, ParamValues& values, const std::string& where) {
  for (const auto& [name, track] : tracks)
    for (const Param& row : values.rows())
      if (row.name == name)
        values.set(name, paramValue(row.type, valueAt(row.type, track, time)), where);
}

std::vector<double> numbersOf(const ParamValues& values, const Param& row) {
  switch (row.type) {
    case ParamType::real:
      return {values.real(row.name)};
    case ParamType::vec2:
      return {values.vec2(row.name).x, values.vec2(row.name).y};
    case ParamType::matrix:
      return rowsOf(values.matrix(row.name));
    default: {
      const Vec3d v = values.vec3(row.name);
      return {v.x, v.y, v.z};
    }
  }
}

std::string formatTrack(const Param& row, const Track& track) {
  std::vector<std::string> keys;
  for (const Key& key : track) {
    ParamValues value(std::span<const Param>(&row, 1));
    value.set(row.name, paramValue(row.type, key.value), "key");
    keys.push_back(fmt::format("{{ frame = {}, value = {} }}", key.frame, value.format(row.name)));
  }
  return fmt::format("[{}]", fmt::join(keys, ", "));
}

}  // namespace photosphere::scene
