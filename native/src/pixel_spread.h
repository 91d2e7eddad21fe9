// How the visible points of a pixel are spread over the surface that it sees.
//
// A pixel's value is the mean over its filter, which camera samples take at random. Where all of them lie on one surface, their spread is
// the filter as it lies there: a kernel of that spread around their mean asks photons for the same mean, without the noise of camera
// samples, and it does not have to shrink.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "vecmath.h"
#include "visible_point.h"

namespace sppm {

// The tangent plane of a visible point, and how it is seen; `footprint` is a pixel's size there [m].
struct TangentAxes {
  Vec3 normal, along;  // along: of the line of sight, in the plane
  float cosine;  // between normal and line of sight
  float footprint;

  TangentAxes(const VisiblePoint& vp, float footprint_there) : normal(unpack_direction(vp.ng)), footprint(footprint_there) {
    const Vec3 wo = unpack_direction(vp.wo), in_plane = wo - normal * dot(wo, normal);
    const float sine = length(in_plane);
    along = sine > 1e-3f ? in_plane / sine : Frame(normal).s;
    cosine = std::max(dot(wo, normal), 1e-3f);
  }
  // Toward the camera.
  Vec3 sight() const { return normal * cosine + along * std::sqrt(std::max(0.0f, 1 - cosine * cosine)); }
};

// Of the surface that most of the pixel's points so far lie on.
struct PixelSpread {
  Vec3 mean;                   // [m]
  PackedDirection normal = 0;  // where the first point was
  // Covariance matrix of the two coordinates that a plane with the first point's normal is best told by [m^2].
  float uu = 0, uv = 0, vv = 0;
  uint32_t count : 12 = 0;     // points on this surface, since the pixel chose it; both counts forget the oldest points in the end
  uint32_t others : 12 = 0;    // points elsewhere
  uint32_t way : 4 = 0;        // by which it is seen: `CameraSample::way`
  uint32_t dropped : 2 = 0;    // the third coordinate
  uint32_t edge : 1 = 0;       // the surface ends at a neighbour
  uint32_t near_edge : 1 = 0;  // or a few pixels away

  // Whether the sample's point belongs to the same surface and is seen by the same way; `axes` are the point's.
  bool has(const CameraSample& sample, const TangentAxes& axes) const {
    return count > 0 && sample.way == way && near_plane(sample.point.p, axes) &&
           dot(axes.normal, unpack_direction(normal)) > kSameNormal;
  }

  // Whether the surface goes on to a neighbouring pixel, seen by the same way.
  bool reaches(const PixelSpread& neighbor, const TangentAxes& axes) const {
    return neighbor.count > 0 && neighbor.way == way && near_plane(neighbor.mean, axes);
  }

  // What a point of the surface may stand for: nothing where the pixel sees more of it than edges are looked for, as out of focus.
  PixelEllipse ellipse(const TangentAxes& axes) const;

  // The majority of its points decides which surface is the pixel's (Boyer and Moore 1981).
  void add(const CameraSample& sample, const TangentAxes& axes);
  // Adds a sample that met nothing at all.
  void add_miss() {
    if (count == 0) return;
    forget();
    ++others;
  }

 private:
  static constexpr float kSameNormal = 0.9f;

  bool near_plane(Vec3 p, const TangentAxes& axes) const;
  void begin(const CameraSample& sample, const TangentAxes& axes);
  void forget();
};

}  // namespace sppm
