// Where the surface that a pixel sees ends at another one, told by its neighbours' visible points.
//
// A kernel that reaches over a crease finds no photons beyond, so its area must not count there.
#pragma once

#include <array>
#include <cmath>

#include "kernel.h"
#include "pixel_spread.h"
#include "vecmath.h"

namespace sppm {

// Lines in a tangent plane; the surface lies where dot(x, outward) <= end for each of them.
class Creases {
 public:
  // Adds the line in which the surface of a pixel near by meets the own one, if they look like two sides of a crease.
  //   pixels: distance of both pixels in the picture.
  void add(const PixelSpread& own, const TangentAxes& axes, const PixelSpread& other, const TangentAxes& other_axes, float footprint,
           float pixels) {
    const float turn = dot(axes.normal, other_axes.normal);
    if (turn > kSameSurface || turn < -0.99f) return;
    const Vec3 d = other.mean - own.mean;
    const float before_other = -dot(d, other_axes.normal), before_own = dot(d, axes.normal);
    // Inner edges have each in front of the other, outer ones behind; else one hides the other.
    if (before_other * before_own <= 0) return;
    const float pixel = footprint / std::min(axes.cosine, other_axes.cosine);
    if (dot(d, d) > square((pixels + 1) * pixel)) return;
    const float sine = std::sqrt(1 - turn * turn);
    const Vec3 across = (other_axes.normal - axes.normal * turn) / sine;  // unit, in the own plane
    const Vec3 outward = before_other > 0 ? -across : across;
    // Only straight across: the other surface may not go on along the line.
    const Vec3 line = cross(axes.normal, outward);
    if (std::abs(dot(d, line)) > pixel) return;
    const Line found{outward, dot(own.mean, outward) + std::abs(before_other) / sine, pixels};
    for (int i = 0; i < count_; ++i)
      if (dot(lines_[i].outward, outward) > kSameLine) {
        if (found.pixels < lines_[i].pixels) lines_[i] = found;
        return;
      }
    if (count_ < kMost) lines_[count_++] = found;
  }

  // Share of a kernel's weight that lies on the surface.
  float share(const Kernel& kernel) const {
    float share = 1;
    for (int i = 0; i < count_; ++i) share *= kernel.share_before(lines_[i].outward, lines_[i].end);
    return share;
  }

 private:
  static constexpr float kSameSurface = 0.7f;  // as Gatherer has it
  static constexpr float kSameLine = 0.8f;
  static constexpr int kMost = 3;

  struct Line {
    Vec3 outward;
    float end;
    float pixels;
  };

  std::array<Line, kMost> lines_;
  int count_ = 0;
};

}  // namespace sppm
