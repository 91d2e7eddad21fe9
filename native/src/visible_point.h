// What one camera path found in one iteration.
#pragma once

#include <cstdint>
#include <vector>

#include "bsdf.h"
#include "vecmath.h"

namespace sppm {

// Where a camera path waits for photons. `weight` is beta_camera times f for a Lambert lobe, else beta_camera alone.
struct VisiblePoint {
  static constexpr uint32_t kLambert = ~0u;

  Vec3 p;
  Vec3 weight;                // 0: the path made no visible point
  PackedDirection wo = 0;
  PackedDirection ng = 0;     // on wo's side
  PackedDirection ns = 0;     // on ng's side
  uint32_t lobe = kLambert;   // position in its tile's list of lobes
  float path_length = 0;      // from the camera [m]

  bool valid() const { return !is_black(weight); }
};

struct CameraSample {
  VisiblePoint point;
  Vec3 direct;        // emission, environment and direct light up to the visible point
  Vec3 indirect;      // light that paths bring to the visible point from other surfaces
  float alpha = 1;
};

}  // namespace sppm
