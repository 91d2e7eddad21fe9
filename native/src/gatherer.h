// Sums beta f over the photons within the kernel of one visible point.
#pragma once

#include "kernel.h"
#include "photon_map.h"
#include "visible_point.h"

namespace sppm {

class Gatherer {
 public:
  Gatherer(const VisiblePoint& vp, const Kernel& kernel, const Lobe* lobe)
      : vp_(vp), kernel_(kernel), lobe_(lobe), wo_(unpack_direction(vp.wo)),
        at_{unpack_direction(vp.ng), Frame(unpack_direction(vp.ns))}, flat_(vp.ng == vp.ns) {}

  // Neighbouring photons belong to the same surface if its normal has turned by less than 45 degrees.
  static constexpr float kSameSurface = 0.7f;

  // `holds(p)` tells whether a place in the kernel counts.
  template <typename Holds>
  void add(const PhotonGroup& group, uint32_t lanes, Holds holds) {
    for (; lanes != 0; lanes &= lanes - 1) {
      const auto lane = static_cast<uint32_t>(__builtin_ctz(lanes));
      if (holds(group.position(lane))) add_one(group, lane);
    }
  }

  // Of what only colours above white make so bright that the sum is no float any more nothing is kept.
  Vec3 phi() const {
    const Vec3 phi = sum_ * vp_.weight;
    return is_finite(phi) ? phi : Vec3{};
  }
  uint32_t count() const { return count_; }
  uint64_t dropped() const { return dropped_ + !is_finite(sum_ * vp_.weight); }

 private:
  void add_one(const PhotonGroup& group, uint32_t lane) {
    const PackedDirection ng = group.ng[lane];
    if (ng != vp_.ng && dot(unpack_direction(ng), at_.ng) < kSameSurface) return;
    Vec3 value = group.power(lane) * kernel_.weight(group.position(lane));
    if (!flat_ || lobe_) {
      const Vec3 n = unpack_direction(ng), wi = unpack_direction(group.wi[lane]);
      const float shading = dot(wi, at_.frame.n), geometric = dot(wi, n);
      if (shading <= 0 || geometric <= 0) return;
      // Photons measure flux through the geometric surface; f goes with the shading normal's cosine (Veach 5.3).
      value *= shading / geometric;
      if (lobe_) value *= evaluate(*lobe_, at_, wo_, wi);
    }
    const float worth = dot(value, vp_.weight);
    if (!(worth > 0 && worth < kInfinity)) {  // what adds nothing does not shrink the radius
      dropped_ += worth != 0;
      return;
    }
    sum_ += value;
    ++count_;
  }

  const VisiblePoint& vp_;
  const Kernel& kernel_;
  const Lobe* lobe_;
  Vec3 wo_;
  ShadingPoint at_;
  bool flat_;
  Vec3 sum_;
  uint32_t count_ = 0;
  uint64_t dropped_ = 0;
};

}  // namespace sppm
