#pragma once
// What a rectangle takes up of the sky of a point, and even samples of it: Urena, Fajardo & King
// 2013, "An area-preserving parametrization for spherical rectangles".

#include "trigonometry.h"

namespace photosphere::lights {

/// A rectangle that lies across z, before a point at the origin.
class SphericalRectangle {
 public:
  /// @param low, high  its corners of least and largest x and y [m]
  /// @param depth      how far its plane is, above 0 [m]
  SphericalRectangle(const Vec2d& low, const Vec2d& high, double depth)
      : m_low(low), m_high(high), m_depth(depth) {
    // Cosines from z to the planes through the origin and its sides; of the angles between those.
    const auto plane = [&](double at) { return at / std::sqrt(at * at + depth * depth); };
    const double left = plane(low.x), right = plane(high.x);
    const double below = plane(low.y), above = plane(high.y);
    m_below = -below;
    m_above = above;
    m_turn = conjugate(turnOf(left * above) * turnOf(-left * below));  // of a whole turn less both
    m_solidAngle = (turnOf(right * below) * turnOf(-right * above) * conjugate(m_turn)).angle();
    // Rounding may take next to nothing, or next to all before the point, across a whole turn.
    const bool before = std::max(low.x, low.y) < 0 && std::min(high.x, high.y) > 0;
    const bool about = std::max(low.x, low.y) < -depth && std::min(high.x, high.y) > depth;
    if (about && m_solidAngle < 1) m_solidAngle = 2 * kPi;
    if (!before && m_solidAngle > 5) m_solidAngle = 0;
  }

  /// [sr]; of a far or narrow one rounding spoils it below some 1e-10.
  double solidAngle() const { return m_solidAngle; }

  /// A point of the rectangle: its x and y [m]. Directions to such points fill the solid angle
  /// evenly.
  Vec2d sample(const Vec2f& u) const {
    const Turn turn = turnBy(static_cast<double>(u.x) * m_solidAngle) * m_turn;
    const double f = turn.sine != 0 ? (turn.cosine * m_below - m_above) / turn.sine : kInfinity;
    const double c =
        glm::clamp(std::copysign(1 / std::sqrt(f * f + m_below * m_below), f), -1.0, 1.0);
    const double across = std::sqrt(std::max(1e-300, 1 - c * c));
    const double x = glm::clamp(c * m_depth / across, m_low.x, m_high.x);
    const double distance = std::sqrt(x * x + m_depth * m_depth);
    const auto height = [&](double y) { return y / std::sqrt(distance * distance + y * y); };
    const double low = height(m_low.y), high = height(m_high.y);
    const double h = low + static_cast<double>(u.y) * (high - low);
    const double y = h * distance / std::sqrt(std::max(1e-300, 1 - h * h));
    return {x, glm::clamp(y, m_low.y, m_high.y)};
  }

 private:
  // An angle by its cosine and sine; a product adds two.
  struct Turn {
    double cosine = 1, sine = 0;

    Turn operator*(const Turn& b) const {
      return {cosine * b.cosine - sine * b.sine, sine * b.cosine + cosine * b.sine};
    }
    // [rad], in [0, 2 pi).
    double angle() const {
      const double up = std::abs(cosine) < std::abs(sine) ? exactAcos(cosine)
                        : cosine > 0                      ? exactAsin(std::abs(sine))
                                                          : kPi - exactAsin(std::abs(sine));
      return sine < 0 ? 2 * kPi - up : up;
    }
  };
  static Turn conjugate(const Turn& turn) { return {turn.cosine, -turn.sine}; }
  // Of an angle between 0 and pi.
  static Turn turnOf(double cosine) {
    return {cosine, std::sqrt(std::max(0.0, (1 - cosine) * (1 + cosine)))};
  }
  // @param angle  [rad], at most a turn
  static Turn turnBy(double angle) {
    const double sine = exactSin(angle / 8);
    Turn turn{std::sqrt(1 - sine * sine), sine};
    for (int i = 0; i < 3; ++i)
      turn = turn * turn;
    return turn;
  }

  Vec2d m_low, m_high;              // [m]
  double m_depth;                   // [m]
  double m_below = 0, m_above = 0;  // cosines from z to the planes of those sides, turned inward
  Turn m_turn;
  double m_solidAngle = 0;
};

}  // namespace photosphere::lights
