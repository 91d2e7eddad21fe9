// Where the surface that a pixel sees ends, told by its neighbours' visible points: at another one, or before what lies behind it.
//
// A kernel that reaches over such an end finds no photons beyond, so its area must not count there.
#pragma once

#include <array>
#include <cmath>
#include <optional>

#include "gatherer.h"
#include "kernel.h"
#include "outline.h"
#include "pixel_spread.h"
#include "vecmath.h"

namespace sppm {

// Lines in a tangent plane, on whose inner sides the surface lies.
class Creases {
 public:
  // Adds the line in which the surface of a pixel near by meets the own one, if they look like two sides of a crease.
  //   pixels: distance of both pixels in the picture.
  void add(const PixelSpread& own, const TangentAxes& axes, const PixelSpread& other, const TangentAxes& other_axes, float pixels) {
    const float turn = dot(axes.normal, other_axes.normal);
    if (turn > Gatherer::kSameSurface || turn < kFolded) return;
    const Vec3 d = other.mean - own.mean;
    const float before_other = -dot(d, other_axes.normal), before_own = dot(d, axes.normal);
    // Inner edges have each in front of the other, outer ones behind; else one hides the other.
    if (before_other * before_own <= 0) return;
    const float sine = std::sqrt(1 - turn * turn);
    const Vec3 across = (other_axes.normal - axes.normal * turn) / sine;  // unit, in the own plane
    const Vec3 outward = before_other > 0 ? -across : across;
    // Only straight across: the other surface may not go on along the line.
    if (std::abs(dot(d, cross(axes.normal, outward))) > axes.footprint / std::min(axes.cosine, other_axes.cosine)) return;
    // The line is seen between both, or else the nearer surface hides that they do not meet.
    const float to_line = std::abs(before_other) / sine;
    const Vec3 sight = axes.sight();
    const auto seen = [&](Vec3 v) { return length(v - sight * dot(v, sight)); };
    const float apart = seen(d);
    if (apart > (pixels + 1) * axes.footprint) return;
    if (seen(outward * to_line) + seen(d - outward * to_line) > apart + axes.footprint) return;
    const Line found{own.mean + outward * to_line, outward, pixels};
    for (int i = 0; i < count_; ++i)
      if (dot(lines_[i].outward, outward) > kSameLine) {
        if (found.pixels < lines_[i].pixels) lines_[i] = found;
        return;
      }
    if (count_ < kMost) lines_[count_++] = found;
  }

  bool any() const { return count_ > 0; }
  // Takes back the lines beyond which a pixel near by still sees the own plane: what seemed to end it there only hides a part.
  void check(const PixelSpread& own, const TangentAxes& axes, const PixelSpread& other) {
    if (std::abs(dot(other.mean - own.mean, axes.normal)) > kMargin * axes.footprint) return;
    for (int i = 0; i < count_;)
      if (dot(other.mean - lines_[i].point, lines_[i].outward) > kMargin * axes.footprint) {
        lines_[i] = lines_[--count_];
      } else {
        ++i;
      }
  }

  // Share of a kernel's weight that lies on the surface.
  float share(const Kernel& kernel) const {
    float share = 1;
    for (int i = 0; i < count_; ++i) share *= kernel.share_before(lines_[i].point, lines_[i].outward);
    return outline ? share * outline->share(kernel, [&](Vec3 p) { return before_lines(p); }) : share;
  }
  // Whether a point of the plane belongs to the surface: beyond a thin wall the same floor goes on.
  bool hold(Vec3 p) const { return before_lines(p) && (!outline || outline->holds(p)); }

  std::optional<Outline> outline;  // where the surface ends before what lies behind

 private:
  static constexpr float kFolded = -0.99f;  // sheets back to back, which no line tells
  static constexpr float kSameLine = 0.8f;
  static constexpr float kMargin = 0.25f;   // in footprints
  static constexpr int kMost = 2;           // as in the corner of a room

  struct Line {
    Vec3 point, outward;
    float pixels;
  };

  bool before_lines(Vec3 p) const {
    for (int i = 0; i < count_; ++i)
      if (dot(p - lines_[i].point, lines_[i].outward) > 0) return false;
    return true;
  }

  std::array<Line, kMost> lines_;
  int count_ = 0;
};

}  // namespace sppm
