#pragma once
// A camera that moves while its shutter is open.

#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "photosphere/cameras/camera.h"

namespace photosphere::cameras {

/// Where a camera stands and how it is turned: world space, unit vectors [scene units].
struct Placement {
  Vec3d eye{0.0};
  Vec3d right{1.0, 0.0, 0.0}, up{0.0, 1.0, 0.0};
  Vec3d axis{0.0, 0.0, -1.0};  ///< along which the camera looks
};
Placement placementOf(const Camera& camera);

/// Cameras at some moments, and rays that change evenly between two of them. There are as many
/// moments as keep a ray between two of them within kTolerance of that of a camera built for the
/// time between, measured on the smoke, and one at every key: so a camera that looks at a target
/// does so all the time, to that tolerance.
class MovingCamera {
 public:
  /// A camera of the time [frames].
  using At = std::function<std::unique_ptr<Camera>(double time)>;
  static constexpr double kTolerance = 0.05;  ///< [pixels]

  /// @param open, close  [frames], open < close
  /// @param keys         times at which a motion may break off [frames]; others do not matter
  /// @param smoke        where it matters where rays go, world space [scene units]
  /// @throws what `at` throws
  MovingCamera(const At& at, double open, double close, std::span<const double> keys,
               const Box3d& smoke);

  /// The ray through a raster position at a time within the shutter. Thread-safe.
  /// @param u  0 = it opens, 1 = it closes
  CameraRay ray(const Vec2d& raster, double u) const;
  Placement placement(double u) const;

  /// Longest way of a point over the picture while the shutter is open [pixels], of points in the
  /// box that are in the frame; at most the frame's diagonal.
  double blur(const Box3d& box) const;
  /// Largest angle under which a point of the box sees the eye move from where it is in the middle;
  /// without an eye, by which the view turns [rad].
  double parallax(const Box3d& box) const;
  /// How many moments have cameras of their own.
  std::size_t moments() const { return m_moments.size(); }

 private:
  struct Moment {
    double u;
    std::unique_ptr<Camera> camera;
  };
  struct Between {
    const Camera &from, &to;
    double t;
  };
  Between between(double u) const;
  void refine(const At& at, double open, double close, std::vector<Moment>& out, Moment last,
              const Box3d& smoke, int depth) const;

  std::vector<Moment> m_moments;  // by time, at least two
};

}  // namespace photosphere::cameras
