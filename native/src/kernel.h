// The weights of photons around a visible point.
#pragma once

#include <algorithm>
#include <cmath>

#include "vecmath.h"
#include "visible_point.h"

namespace sppm {

// A disk, or where the point stands for an ellipse that the disk would not cover, a kernel over it whose variances are the ellipse's, or the
// disk's where that is wider: flat where the disk is wider than the ellipse, which then has no shape to keep, else the smooth hill (1 - q)^3,
// which is near to the pixel's filter.
class Kernel {
 public:
  Kernel(const VisiblePoint& vp, const PixelEllipse& ellipse, float disk_radius)
      : center_(vp.p), radius_(disk_radius), across_(disk_radius), along_(disk_radius) {
    if (!(ellipse.across > 0)) return;
    center_ = ellipse.center;
    const float disk = 0.5f * disk_radius;  // its standard deviation
    if (ellipse.along <= disk) return;
    hill_ = ellipse.across > disk;
    axis_ = unpack_direction(ellipse.axis);
    const float across = std::max(ellipse.across, disk), along = std::min(ellipse.along, kLongest * across);
    // Of a long ellipse the kernel covers a part, and camera samples the rest.
    if (along < ellipse.along) center_ += axis_ * (dot(vp.p - center_, axis_) * std::sqrt(1 - square(along / ellipse.along)));
    const float reach = hill_ ? kHillReach : 2;
    across_ = reach * across;
    along_ = reach * along;
    radius_ = along_;
    inverse_ = 1 / square(across_);
    stretch_ = 1 / square(along_) - inverse_;
  }

  Vec3 center() const { return center_; }
  // Of the ball in which it lies.
  float radius() const { return radius_; }
  // [m^2] Weights have the mean 1 over it.
  double area() const { return M_PI * static_cast<double>(across_) * static_cast<double>(along_); }
  // Of the weight, where dot(x, outward) <= end; at least a half, for the center is on the surface. `outward` is a unit vector in it.
  float share_before(Vec3 outward, float end) const {
    const float l = dot(outward, axis_);
    const float half_width = std::sqrt(square(across_) * std::max(0.0f, 1 - l * l) + square(along_ * l));
    const float x = std::max(0.0f, end - dot(center_, outward)) / half_width;
    if (x >= 1) return 1;
    // Integrals of (1 - x^2)^(1/2) and, for the hill, (1 - x^2)^(7/2).
    const float y2 = 1 - x * x, y = std::sqrt(y2), disk = x * y + std::asin(x);
    if (!hill_) return 0.5f + disk / kPi;
    return 0.5f + (128.0f / 35 * x * y * y2 * (y2 * y2 / 8 + 7.0f / 48 * y2 + 35.0f / 192) + disk) / kPi;
  }
  // At d from the point, within the ball.
  float weight(Vec3 d) const {
    if (inverse_ == 0) return 1;  // within the ball is within the disk
    const float q = dot(d, d) * inverse_ + square(dot(d, axis_)) * stretch_;
    return q >= 1 ? 0 : hill_ ? (kPower + 1) * cube(1 - q) : 1;
  }

 private:
  static constexpr float kPower = 3;
  static constexpr float kHillReach = 3.1622777f;  // half axis over standard deviation: the root of 2 (kPower + 2)
  static constexpr float kLongest = 2;             // of an ellipse over its width: the ball around a longer one holds mostly other photons

  static float cube(float x) { return x * x * x; }

  Vec3 center_;
  float radius_, across_, along_;
  float inverse_ = 0, stretch_ = 0;
  Vec3 axis_;
  bool hill_ = false;
};

}  // namespace sppm
