#pragma once

#include "vecmath.h"

namespace sppm {

// A ball drawn out along an axis, to the points at d from its center with d^2 + stretch (d axis)^2 < across^2.
struct Ellipsoid {
  Vec3 center;
  float across = 0;   // half axis [m]
  Vec3 axis;          // unit vector
  float stretch = 0;  // (across / along)^2 - 1, along being the half axis along `axis`, the longer one
  float along = 0;    // [m]

  Ellipsoid(Vec3 ball_center, float radius) : center(ball_center), across(radius), along(radius) {}
  // 0 at the center, 1 on the surface.
  float level(Vec3 p) const {
    const Vec3 d = p - center;
    return (dot(d, d) + stretch * square(dot(d, axis))) / square(across);
  }
};

}  // namespace sppm
