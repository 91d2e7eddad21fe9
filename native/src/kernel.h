// The weights of photons around a visible point.
#pragma once

#include <algorithm>
#include <cmath>

#include "ellipsoid.h"
#include "vecmath.h"
#include "visible_point.h"

namespace sppm {

// A disk, or where the point stands for an ellipse that the disk would not cover, a kernel over it whose variances are the ellipse's, or
// the disk's where that is wider: flat where the disk is wider than the ellipse, which then has no shape to keep, else the smooth hill
// (1 - q)^3, which is near to the pixel's filter.
class Kernel {
 public:
  Kernel(const VisiblePoint& vp, const PixelEllipse& ellipse, float disk_radius) : region_(vp.p, disk_radius) {
    if (!(ellipse.across > 0)) return;
    region_.center = ellipse.center;
    const float disk = 0.5f * disk_radius;  // its standard deviation
    if (ellipse.along <= disk) return;
    hill_ = ellipse.across > disk;
    region_.axis = unpack_direction(ellipse.axis);
    const float across = std::max(ellipse.across, disk), along = std::min(ellipse.along, kLongest * across);
    // Of a long ellipse the kernel covers a part, and camera samples the rest.
    if (along < ellipse.along)
      region_.center += region_.axis * (dot(vp.p - region_.center, region_.axis) * std::sqrt(1 - square(along / ellipse.along)));
    const float reach = hill_ ? kHillReach : 2;
    region_.across = reach * across;
    region_.along = reach * along;
    region_.stretch = square(across / along) - 1;
  }

  const Ellipsoid& region() const { return region_; }
  // [m^2] Weights have the mean 1 over it.
  double area() const { return M_PI * static_cast<double>(region_.across) * static_cast<double>(region_.along); }
  // Of the weight, before the line through `point` that `outward` is a normal of, a unit vector in the surface; at least a half, for the
  // center is on the surface.
  float share_before(Vec3 point, Vec3 outward) const {
    const float l = dot(outward, region_.axis);
    const float half_width = std::sqrt(square(region_.across) * std::max(0.0f, 1 - l * l) + square(region_.along * l));
    const float x = std::max(0.0f, dot(point - region_.center, outward)) / half_width;
    if (x >= 1) return 1;
    // Integrals of (1 - x^2)^(1/2) and, for the hill, (1 - x^2)^(7/2).
    const float y2 = 1 - x * x, y = std::sqrt(y2), flat = x * y + std::asin(x);
    if (!hill_) return 0.5f + flat / kPi;
    return 0.5f + (128.0f / 35 * x * y * y2 * (y2 * y2 / 8 + 7.0f / 48 * y2 + 35.0f / 192) + flat) / kPi;
  }
  // At a place in the region.
  float weight(Vec3 p) const {
    if (!hill_) return 1;
    const float rest = 1 - region_.level(p);
    return (kPower + 1) * rest * rest * rest;
  }

 private:
  static constexpr float kPower = 3;
  static constexpr float kHillReach = 3.1622777f;  // half axis over standard deviation: the root of 2 (kPower + 2)
  static constexpr float kLongest = 2;             // of an ellipse over its width: the ball around a longer one holds mostly other photons

  Ellipsoid region_;
  bool hill_ = false;
};

}  // namespace sppm
