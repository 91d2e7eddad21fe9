// Sums beta f over the photons within the radius of one visible point.
#pragma once

#include <immintrin.h>

#include "photon_map.h"
#include "visible_point.h"

namespace sppm {

class Gatherer {
 public:
  Gatherer(const VisiblePoint& vp, const Lobe* lobe)
      : vp_(vp), lobe_(lobe), wo_(unpack_direction(vp.wo)),
        at_{unpack_direction(vp.ng), Frame(unpack_direction(vp.ns))}, flat_(vp.ng == vp.ns) {}

  void add(const PhotonGroup& group, uint32_t lanes) {
    if (flat_ && !lobe_) lanes = add_alike(group, lanes);
    for (; lanes != 0; lanes &= lanes - 1) add_one(group, static_cast<uint32_t>(__builtin_ctz(lanes)));
  }

  // Of what only colours above white make so bright that the sum is no float any more nothing is kept.
  Vec3 phi() const {
    const Vec3 phi = sum() * vp_.weight;
    return is_finite(phi) ? phi : Vec3{};
  }
  uint32_t count() const { return count_; }
  uint64_t dropped() const { return dropped_ + !is_finite(sum() * vp_.weight); }

 private:
  // Neighbouring photons belong to the same surface if its normal has turned by less than 45 degrees.
  static constexpr float kSameSurface = 0.7f;

  // For Lambert and a flat surface: adds those of its very plane, whose f is the point's weight. Returns the others.
  uint32_t add_alike(const PhotonGroup& group, uint32_t lanes) {
    const uint32_t alike = lanes & PhotonGroup::equal(group.ng, vp_.ng);
    const __m256 red = _mm256_load_ps(group.red), green = _mm256_load_ps(group.green), blue = _mm256_load_ps(group.blue);
    const __m256 worth = _mm256_add_ps(_mm256_add_ps(_mm256_mul_ps(red, _mm256_set1_ps(vp_.weight.x)),
                                                     _mm256_mul_ps(green, _mm256_set1_ps(vp_.weight.y))),
                                       _mm256_mul_ps(blue, _mm256_set1_ps(vp_.weight.z)));
    const __m256 counts = _mm256_and_ps(_mm256_cmp_ps(worth, _mm256_setzero_ps(), _CMP_GT_OQ),
                                        _mm256_cmp_ps(worth, _mm256_set1_ps(kInfinity), _CMP_LT_OQ));
    const __m256i bits = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
    const __m256i chosen = _mm256_cmpeq_epi32(_mm256_and_si256(_mm256_set1_epi32(static_cast<int>(alike)), bits), bits);
    const __m256 added = _mm256_and_ps(counts, _mm256_castsi256_ps(chosen));
    red_ = _mm256_add_ps(red_, _mm256_and_ps(red, added));
    green_ = _mm256_add_ps(green_, _mm256_and_ps(green, added));
    blue_ = _mm256_add_ps(blue_, _mm256_and_ps(blue, added));
    const uint32_t none = alike & PhotonGroup::lanes(_mm256_cmp_ps(worth, _mm256_setzero_ps(), _CMP_EQ_OQ));
    const auto found = static_cast<uint32_t>(__builtin_popcount(PhotonGroup::lanes(added)));
    count_ += found;
    dropped_ += static_cast<uint32_t>(__builtin_popcount(alike) - __builtin_popcount(none)) - found;
    return lanes & ~alike;
  }

  void add_one(const PhotonGroup& group, uint32_t lane) {
    const PackedDirection ng = group.ng[lane];
    if (ng != vp_.ng && dot(unpack_direction(ng), at_.ng) < kSameSurface) return;
    Vec3 value = group.power(lane);
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

  Vec3 sum() const { return sum_ + Vec3{total(red_), total(green_), total(blue_)}; }
  static float total(__m256 lanes) {
    const __m128 four = _mm_add_ps(_mm256_castps256_ps128(lanes), _mm256_extractf128_ps(lanes, 1));
    const __m128 two = _mm_add_ps(four, _mm_movehl_ps(four, four));
    return _mm_cvtss_f32(_mm_add_ss(two, _mm_movehdup_ps(two)));
  }

  const VisiblePoint& vp_;
  const Lobe* lobe_;
  Vec3 wo_;
  ShadingPoint at_;
  bool flat_;
  Vec3 sum_;
  __m256 red_ = _mm256_setzero_ps(), green_ = red_, blue_ = red_;  // of those summed lane by lane
  uint32_t count_ = 0;
  uint64_t dropped_ = 0;
};

}  // namespace sppm
