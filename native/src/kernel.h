// The weights of photons around a visible point.
#pragma once

#include <algorithm>
#include <cmath>

#include "vecmath.h"
#include "visible_point.h"

namespace sppm {

// A disk, or where the point stands for an ellipse a smooth hill over it, (1 - q)^3, whose variances are the ellipse's, or the disk's where
// that is wider.
class Kernel {
 public:
  Kernel(const VisiblePoint& vp, const PixelEllipse& ellipse, float disk_radius)
      : center_(vp.p), radius_(disk_radius), across_(disk_radius), along_(disk_radius) {
    if (!(ellipse.across > 0)) return;
    const float least = 0.5f * disk_radius;  // a disk's standard deviation
    hill_ = true;
    center_ = ellipse.center;
    axis_ = unpack_direction(ellipse.axis);
    across_ = kReach * std::max(ellipse.across, least);
    along_ = kReach * std::max(ellipse.along, least);
    radius_ = std::max(across_, along_);
    inverse_ = 1 / square(across_);
    stretch_ = 1 / square(along_) - inverse_;
  }

  Vec3 center() const { return center_; }
  // Of the ball in which it lies.
  float radius() const { return radius_; }
  // [m^2] Weights have the mean 1 over it.
  double area() const { return M_PI * static_cast<double>(across_) * static_cast<double>(along_); }
  // At d from the point, within the ball.
  float weight(Vec3 d) const {
    if (!hill_) return 1;
    const float q = dot(d, d) * inverse_ + square(dot(d, axis_)) * stretch_;
    return q < 1 ? (kPower + 1) * cube(1 - q) : 0;
  }

 private:
  static constexpr float kPower = 3;
  static constexpr float kReach = 3.1622777f;  // half axis over standard deviation: the root of 2 (kPower + 2)

  static float cube(float x) { return x * x * x; }

  Vec3 center_;
  float radius_, across_, along_;
  float inverse_ = 0, stretch_ = 0;
  Vec3 axis_;
  bool hill_ = false;
};

}  // namespace sppm
