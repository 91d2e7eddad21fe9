// The camera: from a film position to a ray.
#pragma once

#include <cmath>

#include "ray.h"
#include "sppm/sppm.h"
#include "vecmath.h"

namespace sppm {

class Camera {
 public:
  Camera() = default;
  explicit Camera(const SppmCameraDesc& desc);  // throws Error

  // x, y in pixels of the full image from its bottom left; `lens` uniform in the unit square.
  Ray ray(float x, float y, Vec2 lens) const;
  // Width of a pixel's footprint at `distance` along a camera path [m].
  float footprint(float distance) const { return orthographic_ ? pixel_size_ : pixel_size_ * distance; }
  float depth(Vec3 p) const { return -dot(p - position_, backward_); }
  // From the camera's place, or from its plane if orthographic.
  float distance(Vec3 p) const { return orthographic_ ? std::abs(depth(p)) : length(p - position_); }
  // A vector in the frame of the camera that looks along +z.
  Vec3 in_view(Vec3 v) const { return {dot(v, right_), dot(v, up_), -dot(v, backward_)}; }

  uint64_t region_x = 0, region_y = 0, region_width = 0, region_height = 0;

 private:
  bool orthographic_ = false;
  Vec3 position_, right_, up_, backward_;
  float left_ = 0, bottom_ = 0, step_x_ = 0, step_y_ = 0, pixel_size_ = 0;
  float near_ = 0, far_ = 0, aperture_ = 0, aperture_ratio_ = 1, focus_ = 1;
};

}  // namespace sppm
