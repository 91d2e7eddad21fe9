// How something moves while the shutter is open: places evenly spaced in time, and what lies between two of them.
//
// A place is taken apart into translation, rotation and what is left, its stretch (polar decomposition, Shoemake and Duff 1992), and each
// part is interpolated by itself, so that what turns does not shrink on its way.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "vecmath.h"

namespace sppm {

// Where a time falls between `count` keys evenly spaced over [0, 1]: the key before it and how far it is to the next, 0 to 1.
struct KeyTime {
  size_t key;
  double share;
  KeyTime(double time, size_t count) {
    const double scaled = time * static_cast<double>(count - 1);
    key = std::min(static_cast<size_t>(scaled), count < 2 ? 0 : count - 2);
    share = count < 2 ? 0 : scaled - static_cast<double>(key);
  }
  size_t nearest() const { return share < 0.5 ? key : key + 1; }
};

class Motion {
 public:
  Motion() = default;
  explicit Motion(std::span<const Affine> places);  // from the shutter's opening to its closing; at least one

  uint64_t memory() const { return places_.size() * sizeof(Affine) + poses_.size() * sizeof(Pose); }
  Affine at(double time) const;  // 0 where the shutter opens, 1 where it closes
  const Affine& key_near(double time) const { return places_[KeyTime(time, places_.size()).nearest()]; }

 private:
  using Matrix = std::array<double, 9>;  // row-major
  struct Pose {
    std::array<double, 3> translation;
    std::array<double, 4> rotation;  // unit quaternion, w first
    Matrix stretch;                  // before the rotation
  };
  static Pose take_apart(const Affine& place);
  static Affine put_together(const Pose& pose);
  static Pose between(const Pose& a, const Pose& b, double share);

  std::vector<Affine> places_;
  std::vector<Pose> poses_;
};

// The time of a pass: a sequence that fills the shutter evenly however many passes there are (multiples of the golden ratio), from a
// start that the seed gives. It shares no structure with the samples of pixels and photons, which are indexed by the pass too.
double pass_time(uint64_t seed, uint64_t pass);

}  // namespace sppm
