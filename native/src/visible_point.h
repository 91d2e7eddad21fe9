// What one camera path found in one iteration.
#pragma once

#include <cstdint>
#include <vector>

#include "bsdf.h"
#include "vecmath.h"

namespace sppm {

// Where a camera path waits for photons: at its first diffuse surface, and for caustic photons alone at glossy ones before it. `weight` is
// beta_camera times f for a Lambert lobe, else beta_camera alone.
struct VisiblePoint {
  static constexpr uint32_t kLambert = ~0u;

  Vec3 p;
  Vec3 weight;                // 0: the path made no visible point
  PackedDirection wo = 0;
  PackedDirection ng = 0;     // on wo's side
  PackedDirection ns = 0;     // on ng's side
  uint32_t lobe = kLambert;   // position in its tile's list of lobes
  float path_length = 0;      // from the camera [m]
  float caustic_share = 1;    // of caustic light; the rest was asked for at glossy surfaces before

  bool valid() const { return !is_black(weight); }
};

// The points of a surface that a visible point stands for, beside itself: an ellipse in which its pixel's points lie.
struct PixelEllipse {
  Vec3 center;
  PackedDirection axis = 0;     // unit vector in the surface
  float along = 0, across = 0;  // standard deviations along the axis and across it [m]; 0: the visible point stands for itself alone
};

// A glossy surface on the way to the visible point. Caustic photons are asked for; other light comes on the path's further way.
struct GlossyPoint {
  VisiblePoint point;
  uint64_t pixel = 0;         // of the region
};

// What the camera samples of a tile refer to.
struct TilePoints {
  std::vector<Lobe> lobes;          // of visible points that are not Lambert
  std::vector<GlossyPoint> glossy;  // pixels in the order of `visit_tile`
};

struct CameraSample {
  VisiblePoint point;
  PixelEllipse ellipse;
  Vec3 direct;        // emission, environment and direct light up to the visible point
  Vec3 indirect;      // light that paths bring to the visible point from other surfaces
  float alpha = 1;
  uint8_t dark_iterations = 0;  // without direct light, until now, of those that are done
  uint8_t way = 0;  // a hash of 4 bits of where the path to the point was reflected, where transmitted and where let through by chance
  bool escaped = false;  // the path left the scene without being scattered

  // Nothing at all, not even an emitter, which may stand in front of something.
  bool met_nothing() const { return escaped && way == 0; }
};

}  // namespace sppm
