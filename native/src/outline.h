// The part of a surface near a pixel, as pixels see it, where it ends before what lies behind.
//
// A kernel that reaches over such an end finds no photons beyond, so its area must not count there. A pixel that sees something behind
// the plane sees that the surface is not there; one that sees something in front of it cannot tell.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "kernel.h"
#include "vecmath.h"

namespace sppm {

class Outline {
 public:
  static constexpr int kReach = 4;  // pixels to each side that can be told

  // middle: where the own pixel sees the plane of `normal`; sides: those of a pixel there [m].
  Outline(Vec3 middle, Vec3 side_x, Vec3 side_y, Vec3 normal)
      : middle_(middle), side_x_(side_x), side_y_(side_y), to_x_(cross(side_y, normal)), to_y_(cross(normal, side_x)) {
    to_x_ = to_x_ / dot(to_x_, side_x);
    to_y_ = to_y_ / dot(to_y_, side_y);
    shares_.fill(1);
  }

  // Of a pixel's part of the plane, how much belongs to the surface.
  float& at(int dx, int dy) { return shares_[index(dx, dy)]; }
  Vec3 place(float dx, float dy) const { return middle_ + side_x_ * dx + side_y_ * dy; }

  // Whether a point near the plane may belong to the surface: one that bends away goes on where it is not seen.
  bool holds(Vec3 p) const {
    const float dx = std::round(dot(p - middle_, to_x_)), dy = std::round(dot(p - middle_, to_y_));
    return !(std::abs(dx) <= kReach && std::abs(dy) <= kReach) || shares_[index(static_cast<int>(dx), static_cast<int>(dy))] > 0;
  }

  // Share of a kernel's weight that lies on the surface, of the part where `hold(place)`; by the quarters of pixels, and so 1 for a kernel
  // that is not much wider than a pixel: half of one may be on the surface, and the kernel on that half.
  template <typename Hold>
  float share(const Kernel& kernel, Hold hold) const {
    float all = 0, on = 0;
    int places = 0;
    for (int dy = -kReach; dy <= kReach; ++dy)
      for (int dx = -kReach; dx <= kReach; ++dx)
        for (const float x : {-0.25f, 0.25f})
          for (const float y : {-0.25f, 0.25f}) {
            const Vec3 p = place(static_cast<float>(dx) + x, static_cast<float>(dy) + y);
            if (kernel.region().level(p) >= 1 || !hold(p)) continue;
            const float weight = kernel.weight(p);
            ++places, all += weight, on += weight * shares_[index(dx, dy)];
          }
    return places >= kFewestPlaces && on > 0 ? std::max(on / all, kLeast) : 1;
  }

 private:
  // Of a share that is less most may be an error.
  static constexpr float kLeast = 0.25f;
  static constexpr int kFewestPlaces = 12;  // of a disk with the radius of a pixel
  static constexpr int kSide = 2 * kReach + 1;

  static constexpr size_t index(int dx, int dy) { return static_cast<size_t>((dy + kReach) * kSide + dx + kReach); }

  Vec3 middle_, side_x_, side_y_, to_x_, to_y_;
  std::array<float, kSide * kSide> shares_;
};

}  // namespace sppm
