#include "sampling.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace sppm {
namespace {

constexpr int kDimensions = 4;
// A number of each dimension. Loops over it become single instructions for all four.
using Word4 = std::array<uint32_t, kDimensions>;
using ByteTables = std::array<std::array<Word4, 256>, 4>;

constexpr uint32_t reverse_bits(uint32_t x) {
  x = __builtin_bswap32(x);
  x = (x & 0x0f0f0f0fu) << 4 | (x >> 4 & 0x0f0f0f0fu);
  x = (x & 0x33333333u) << 2 | (x >> 2 & 0x33333333u);
  return (x & 0x55555555u) << 1 | (x >> 1 & 0x55555555u);
}

// Direction numbers of the first four Sobol dimensions (primitive polynomials 1, x+1, x^2+x+1, x^3+x+1).
std::array<uint32_t, 32> direction_numbers(int dimension) {
  std::array<uint32_t, 32> v{};
  if (dimension == 0) {
    for (int i = 0; i < 32; ++i) v[i] = 1u << (31 - i);
    return v;
  }
  const int degree = dimension;
  const uint32_t coefficients = dimension == 1 ? 0 : 1;
  const uint32_t start[] = {1, dimension == 1 ? 0u : 3u, 1};
  for (int i = 0; i < 32; ++i) {
    if (i < degree) {
      v[i] = start[i] << (31 - i);
      continue;
    }
    v[i] = v[i - degree] ^ (v[i - degree] >> degree);
    for (int k = 1; k < degree; ++k)
      if (coefficients >> (degree - 1 - k) & 1) v[i] ^= v[i - k];
  }
  return v;
}

// By the bytes of an index whose bits are reversed, to points whose bits are: the scrambling around both works on reversed bits.
ByteTables make_tables() {
  ByteTables tables{};
  for (int d = 0; d < kDimensions; ++d) {
    const auto v = direction_numbers(d);
    for (int byte = 0; byte < 4; ++byte)
      for (int value = 0; value < 256; ++value)
        for (int bit = 0; bit < 8; ++bit)
          if (value >> bit & 1) tables[byte][value][d] ^= reverse_bits(v[31 - (8 * byte + bit)]);
  }
  return tables;
}

const ByteTables kTables = make_tables();

// Laine-Karras hash with Vegdahl's constants: scrambles each bit by a hash of the bits below it. On reversed bits it is an Owen
// scrambling.
inline uint32_t scramble_upward(uint32_t x, uint32_t seed) {
  x ^= x * 0x3d20adeau;
  x += seed;
  x *= (seed >> 16) | 1;
  x ^= x * 0x05526c56u;
  x ^= x * 0x53a22864u;
  return x;
}

// Odd multipliers that make four independent seeds of one hash (from the spectral tables of Steele and Vigna 2021).
constexpr uint64_t kSeedFactors[kDimensions] = {0xd1342543de82ef95u, 0xaf251af3b0f025b5u, 0xb564ef22ec7aece5u, 0xf7c2ebc08f67f2b5u};

// Integral of the window from its left edge to step i of its left half, the whole window's being 1. By position and not by its value,
// so that the tails, where the window is ten thousand times lower, are as fine as the middle.
struct FilterTable {
  static constexpr size_t kSteps = 512, kGuides = 512;

  std::array<float, kSteps + 1> integral;
  std::array<uint16_t, kGuides> guide;  // last step at or below k / (2 kGuides), from where a search has few steps to go

  FilterTable() {
    for (size_t i = 0; i <= kSteps; ++i) {
      const double a = M_PI * static_cast<double>(i) / kSteps;
      const double sines = 0.48829 * std::sin(a) - 0.14128 * std::sin(2 * a) / 2 + 0.01168 * std::sin(3 * a) / 3;
      integral[i] = static_cast<float>(0.5 * static_cast<double>(i) / kSteps - sines / (2 * M_PI * 0.35875));
    }
    size_t step = 0;
    for (size_t k = 0; k < kGuides; ++k) {
      while (step + 2 < kSteps && integral[step + 1] <= 0.5f * static_cast<float>(k) / kGuides) ++step;
      guide[k] = static_cast<uint16_t>(step);
    }
  }
};

}  // namespace

Sampler::Sampler(uint64_t stream, uint64_t index)
    : seed_(hash64(hash64(stream, index >> 32) + 0x9e3779b97f4a7c15u)), reversed_index_(reverse_bits(static_cast<uint32_t>(index))) {}

Sampler Sampler::split(uint32_t i, uint32_t bits) const {
  Sampler part = *this;
  part.reversed_index_ = reversed_index_ >> bits | reverse_bits(i);
  return part;
}

Sample4 Sampler::at(uint32_t group) const {
  const uint64_t h = hash64(seed_ ^ group);
  const uint32_t i = scramble_upward(reversed_index_, static_cast<uint32_t>(h));
  const Word4 &a = kTables[0][i & 255], &b = kTables[1][i >> 8 & 255], &c = kTables[2][i >> 16 & 255], &e = kTables[3][i >> 24];
  Sample4 sample;
  for (int d = 0; d < kDimensions; ++d) {
    const auto seed = static_cast<uint32_t>(h * kSeedFactors[d] >> 32);
    const uint32_t point = reverse_bits(scramble_upward(a[d] ^ b[d] ^ c[d] ^ e[d], seed));
    sample.v[d] = static_cast<float>(static_cast<int32_t>(point >> 8)) * 0x1p-24f;
  }
  return sample;
}

Distribution::Distribution(std::span<const double> weights) : cdf_(weights.size()) {
  for (size_t i = 0; i < weights.size(); ++i) cdf_[i] = total_ += weights[i];
  if (total_ > 0)
    for (double& c : cdf_) c /= total_;
}

size_t Distribution::sample(float& u) const {
  const auto it = std::upper_bound(cdf_.begin(), cdf_.end(), static_cast<double>(u));
  const size_t i = std::min<size_t>(static_cast<size_t>(it - cdf_.begin()), cdf_.size() - 1);
  const double below = i == 0 ? 0.0 : cdf_[i - 1];
  u = std::clamp(static_cast<float>((u - below) / (cdf_[i] - below)), 0.0f, 0x1.fffffep-1f);
  return i;
}

float Distribution::probability(size_t i) const { return static_cast<float>(cdf_[i] - (i == 0 ? 0.0 : cdf_[i - 1])); }

Vec2 sample_disk(Vec2 u) {
  const float x = 2 * u.x - 1, y = 2 * u.y - 1;
  if (x == 0 && y == 0) return {0, 0};
  const bool wide = std::abs(x) > std::abs(y);
  const float r = wide ? x : y;
  const float phi = wide ? kPi / 4 * (y / x) : kPi / 2 - kPi / 4 * (x / y);
  return {r * std::cos(phi), r * std::sin(phi)};
}

Vec3 sample_cosine_hemisphere(Vec2 u) {
  const Vec2 d = sample_disk(u);
  return {d.x, d.y, safe_sqrt(1 - d.x * d.x - d.y * d.y)};
}

Vec3 sample_sphere(Vec2 u) { return sample_cone(u, 2.0f); }

Vec3 sample_cone(Vec2 u, float one_minus_cos) {
  const float h = u.x * one_minus_cos;  // 1 - cos, kept apart so that narrow cones lose no digits
  const float sin_theta = safe_sqrt(h * (2 - h));
  const float phi = 2 * kPi * u.y;
  return {sin_theta * std::cos(phi), sin_theta * std::sin(phi), 1 - h};
}

Vec2 sample_triangle(Vec2 u) {
  const float root = std::sqrt(u.x);
  return {1 - root, root * u.y};
}

float sample_blackman_harris(float u) {
  static const FilterTable table;
  const float v = std::min(u, 1 - u);  // the window is symmetric
  size_t step = table.guide[std::min(static_cast<size_t>(v * (2 * FilterTable::kGuides)), FilterTable::kGuides - 1)];
  while (step + 1 < FilterTable::kSteps && table.integral[step + 1] <= v) ++step;
  const float low = table.integral[step], high = table.integral[step + 1];
  const float x = 0.5f * (static_cast<float>(step) + (v - low) / (high - low)) / FilterTable::kSteps - 0.5f;
  return u < 0.5f ? x : -x;
}

}  // namespace sppm
