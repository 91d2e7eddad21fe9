// How the visible points of a pixel are spread over the surface that it sees.
//
// A pixel's value is the mean over its filter, which camera samples take at random. Where all of them lie on one surface, their spread is
// the filter as it lies there: a kernel of that spread around their mean asks photons for the same mean, without the noise of camera samples,
// and it does not have to shrink.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "vecmath.h"
#include "visible_point.h"

namespace sppm {

// Directions in a tangent plane: `along` the line of sight and across it. The filter's image is an ellipse with these axes where what
// bends the line of sight lies as the surface does.
struct TangentAxes {
  Vec3 normal, along;
  float cosine;  // between normal and line of sight

  explicit TangentAxes(const VisiblePoint& vp) : normal(unpack_direction(vp.ng)) {
    const Vec3 wo = unpack_direction(vp.wo), in_plane = wo - normal * dot(wo, normal);
    const float sine = length(in_plane);
    along = sine > 1e-3f ? in_plane / sine : Frame(normal).s;
    cosine = std::max(dot(wo, normal), 1e-3f);
  }
};

struct PixelSpread {
  Vec3 mean;                      // [m]
  float along = 0, across = 0;    // variances [m^2]
  uint32_t count = 0;             // points on this surface, since the pixel chose it
  uint32_t others : 31 = 0;       // points elsewhere
  uint32_t edge : 1 = 0;          // the surface ends here

  // Whether the point belongs to the same surface; `footprint` is a pixel's size there [m].
  bool has(const VisiblePoint& vp, const TangentAxes& axes, float footprint) const {
    return count > 0 && on_plane(vp.p, axes, footprint, kReach);
  }

  // Whether the surface goes on to a neighbouring pixel.
  bool reaches(const PixelSpread& neighbor, const TangentAxes& axes, float footprint) const {
    return neighbor.count > 0 && on_plane(neighbor.mean, axes, footprint, kReach);
  }

  // What a point of the surface may stand for.
  PixelEllipse ellipse(const VisiblePoint& vp, const TangentAxes& axes) const {
    PixelEllipse e{mean, pack_direction(axes.along), std::sqrt(along), std::sqrt(across)};
    const float longest = kLongest * e.across;
    if (e.along <= longest) return e;
    // Towards the horizon the kernel covers a part of the pixel, and camera samples the rest.
    e.center += axes.along * (dot(vp.p - mean, axes.along) * std::sqrt(1 - square(longest / e.along)));
    e.along = longest;
    return e;
  }

  // The majority of its points decides which surface is the pixel's (Boyer and Moore 1981).
  void add(const VisiblePoint& vp, float footprint) {
    const TangentAxes axes(vp);
    if (!has(vp, axes, footprint)) {
      if (++others > count) *this = first(vp, axes, footprint);
      return;
    }
    ++count;
    const Vec3 before = vp.p - mean;
    mean += before / static_cast<float>(count);
    const Vec3 after = vp.p - mean;
    const float share = 1 / (kPriorPoints + static_cast<float>(count));
    const float b = dot(before, axes.along), a = dot(after, axes.along);
    along += (b * a - along) * share;
    across += (std::max(0.0f, dot(before, after) - b * a) - across) * share;
  }

 private:
  // A point this many footprints away, seen straight on, is another surface's, or the same surface's by another way.
  static constexpr float kReach = 6;
  static constexpr float kLongest = 4;  // of a kernel over its width
  // From the tangent plane, in footprints.
  static constexpr float kOffPlane = 0.25f;
  // Standard deviation of Blender's filter of 1.5 pixels, in footprints, and how many points it counts for.
  static constexpr float kPriorSpread = 0.4f, kPriorPoints = 3;

  static PixelSpread first(const VisiblePoint& vp, const TangentAxes& axes, float footprint) {
    const float variance = square(kPriorSpread * footprint);
    return {vp.p, variance / square(axes.cosine), variance, 1};
  }

  bool on_plane(Vec3 p, const TangentAxes& axes, float footprint, float reach) const {
    const Vec3 d = p - mean;
    return std::abs(dot(d, axes.normal)) <= kOffPlane * footprint && dot(d, d) <= square(reach * footprint / axes.cosine);
  }
};

}  // namespace sppm
