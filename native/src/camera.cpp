#include "camera.h"

#include <algorithm>
#include <cmath>

#include "sampling.h"
#include "status.h"

namespace sppm {

Camera::Camera(const SppmCameraDesc& d) {
  constexpr uint64_t kLargest = 1u << 20;
  require(d.projection <= SPPM_ORTHOGRAPHIC, "camera: projection must be an SppmProjection");
  require(d.width >= 1 && d.height >= 1 && d.width <= kLargest && d.height <= kLargest, "camera: width and height must be 1 to 2^20");
  for (const float m : d.transform) require(std::isfinite(m), "camera: transform must be finite");
  for (const float w : d.window) require(std::isfinite(w), "camera: window must be finite");
  require(d.window[1] > d.window[0] && d.window[3] > d.window[2], "camera: window must be left < right, bottom < top");
  require(std::isfinite(d.clip_near) && d.clip_near >= 0 && d.clip_far > d.clip_near,
          "camera: clip_near must be at least 0 and below clip_far");
  require(std::isfinite(d.aperture_radius) && d.aperture_radius >= 0, "camera: aperture_radius must be finite and at least 0");
  require(d.aperture_radius == 0 || (std::isfinite(d.focal_distance) && d.focal_distance > 0),
          "camera: focal_distance must be above 0 when there is an aperture");
  require(std::isfinite(d.aperture_ratio) && d.aperture_ratio >= 0, "camera: aperture_ratio must be finite and at least 0");
  if (d.region_width == 0) {
    region_width = d.width, region_height = d.height;
  } else {
    require(d.region_height > 0 && d.region_width <= d.width && d.region_x <= d.width - d.region_width && d.region_height <= d.height &&
                d.region_y <= d.height - d.region_height,
            "camera: region must lie within the image");
    region_x = d.region_x, region_y = d.region_y, region_width = d.region_width, region_height = d.region_height;
  }
  Affine m;
  std::copy(d.transform, d.transform + 12, m.m.begin());
  require(m.determinant() != 0, "camera: transform must be invertible");
  orthographic_ = d.projection == SPPM_ORTHOGRAPHIC;
  position_ = m.column(3), right_ = normalize(m.column(0)), up_ = normalize(m.column(1)), backward_ = normalize(m.column(2));
  left_ = d.window[0], bottom_ = d.window[2];
  step_x_ = (d.window[1] - d.window[0]) / static_cast<float>(d.width);
  step_y_ = (d.window[3] - d.window[2]) / static_cast<float>(d.height);
  pixel_size_ = std::sqrt(step_x_ * step_y_);
  near_ = d.clip_near, far_ = d.clip_far;
  aperture_ = d.aperture_radius, aperture_ratio_ = d.aperture_ratio > 0 ? d.aperture_ratio : 1, focus_ = d.focal_distance;
}

Ray Camera::ray(float px, float py, Vec2 lens) const {
  const float x = left_ + step_x_ * px, y = bottom_ + step_y_ * py;
  Vec3 origin = position_, direction = -backward_;  // direction with depth 1
  if (orthographic_)
    origin += right_ * x + up_ * y;
  else
    direction += right_ * x + up_ * y;
  if (aperture_ > 0) {
    const Vec2 q = sample_disk(lens);
    const Vec3 offset = right_ * (q.x * aperture_ / aperture_ratio_) + up_ * (q.y * aperture_);
    direction = direction * focus_ - offset;  // toward the point in focus
    origin += offset;
    direction = direction / focus_;
  }
  const float stretch = length(direction);  // distance per unit of depth
  return {.origin = origin, .direction = direction / stretch, .near = near_ * stretch, .far = far_ * stretch, .kind = Ray::kCamera};
}

}  // namespace sppm
