// Sample points from an index, and the warps that turn them into directions and choices.
//
// A sample is named by (stream, index, dimension): a stream is a pixel or the photons, the index counts iterations or photons in 64
// bits, and dimensions come in groups of four. Each group is its own Owen-scrambled Sobol sequence with its own shuffle of the index
// (Burley 2020, "Practical hash-based Owen scrambling"), so there is no last dimension to run out of.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "vecmath.h"

namespace sppm {

inline uint64_t hash64(uint64_t x) {  // splitmix64's finalizer
  x ^= x >> 30, x *= 0xbf58476d1ce4e5b9u;
  x ^= x >> 27, x *= 0x94d049bb133111ebu;
  return x ^ (x >> 31);
}
inline uint64_t hash64(uint64_t a, uint64_t b) { return hash64(hash64(a + 0x9e3779b97f4a7c15u) ^ b); }

// Four numbers in [0, 1).
struct Sample4 {
  float v[4];
  float operator[](int i) const { return v[i]; }
  Vec2 first() const { return {v[0], v[1]}; }
  Vec2 second() const { return {v[2], v[3]}; }
};

// The points of one camera path or one photon.
class Sampler {
 public:
  Sampler(uint64_t stream, uint64_t index);
  // The next four dimensions.
  Sample4 next() { return at(group_++); }
  Sample4 at(uint32_t group) const;
  // Number i of 2^bits samplers, each at the same dimensions, whose points are stratified together.
  Sampler split(uint32_t i, uint32_t bits) const;
  // Leaves out four dimensions: those of the samplers above.
  void skip() { ++group_; }

 private:
  uint64_t seed_;  // a hash
  uint32_t reversed_index_;  // its lowest bit first
  uint32_t group_ = 0;
};

// Picks index i with probability `weights[i]` / sum and makes `u` a fresh number in [0, 1). Cumulative, so ties cost nothing.
class Distribution {
 public:
  Distribution() = default;
  explicit Distribution(std::span<const double> weights);

  bool empty() const { return total_ <= 0; }
  double total() const { return total_; }
  size_t size() const { return cdf_.size(); }
  size_t sample(float& u) const;
  float probability(size_t i) const;

 private:
  std::vector<double> cdf_;  // inclusive, normalised
  double total_ = 0;
};

Vec2 sample_disk(Vec2 u);                      // unit disk, uniform (concentric map)
Vec3 sample_cosine_hemisphere(Vec2 u);         // about +z, pdf cos/pi
Vec3 sample_sphere(Vec2 u);                    // pdf 1/(4 pi)
Vec3 sample_cone(Vec2 u, float one_minus_cos); // about +z, uniform in the cone whose 1 - cos(half angle) is given
Vec2 sample_triangle(Vec2 u);                  // barycentrics of the second and third vertex, uniform
float sample_blackman_harris(float u);         // offset in [-1/2, 1/2] distributed as the window

// Weight of the sample taken with `pdf_a` where `pdf_b` could have taken it as well (power heuristic with exponent 2).
inline float mis_weight(float pdf_a, float pdf_b) {
  if (pdf_a <= 0) return 0;
  const float ratio = pdf_b / pdf_a;
  return 1 / (1 + ratio * ratio);
}

}  // namespace sppm
