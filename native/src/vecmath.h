// Vectors, frames and affine maps in float32. Vec3 serves as point, direction and linear RGB colour alike.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

namespace sppm {

inline constexpr float kPi = 3.14159265358979323846f;
inline constexpr float kInvPi = 0.31830988618379067154f;
inline constexpr float kInfinity = std::numeric_limits<float>::infinity();

struct Vec2 {
  float x = 0, y = 0;
};

struct Vec3 {
  float x = 0, y = 0, z = 0;

  constexpr float operator[](int i) const { return i == 0 ? x : i == 1 ? y : z; }
  constexpr Vec3& operator+=(Vec3 b) { x += b.x, y += b.y, z += b.z; return *this; }
  constexpr Vec3& operator*=(Vec3 b) { x *= b.x, y *= b.y, z *= b.z; return *this; }
  constexpr Vec3& operator*=(float s) { x *= s, y *= s, z *= s; return *this; }
};

constexpr Vec3 splat(float s) { return {s, s, s}; }
constexpr Vec3 operator+(Vec3 a, Vec3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
constexpr Vec3 operator-(Vec3 a, Vec3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
constexpr Vec3 operator-(Vec3 a) { return {-a.x, -a.y, -a.z}; }
constexpr Vec3 operator*(Vec3 a, Vec3 b) { return {a.x * b.x, a.y * b.y, a.z * b.z}; }
constexpr Vec3 operator*(Vec3 a, float s) { return {a.x * s, a.y * s, a.z * s}; }
constexpr Vec3 operator*(float s, Vec3 a) { return a * s; }
constexpr Vec3 operator/(Vec3 a, float s) { return a * (1 / s); }
constexpr bool operator==(Vec3 a, Vec3 b) { return a.x == b.x && a.y == b.y && a.z == b.z; }

constexpr float dot(Vec3 a, Vec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
constexpr Vec3 cross(Vec3 a, Vec3 b) { return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }
constexpr float length_squared(Vec3 a) { return dot(a, a); }
inline float length(Vec3 a) { return std::sqrt(dot(a, a)); }
inline Vec3 normalize(Vec3 a) { return a / length(a); }
constexpr float max_component(Vec3 a) { return std::max({a.x, a.y, a.z}); }
constexpr float min_component(Vec3 a) { return std::min({a.x, a.y, a.z}); }
inline Vec3 abs(Vec3 a) { return {std::abs(a.x), std::abs(a.y), std::abs(a.z)}; }
constexpr Vec3 min(Vec3 a, Vec3 b) { return {std::min(a.x, b.x), std::min(a.y, b.y), std::min(a.z, b.z)}; }
constexpr Vec3 max(Vec3 a, Vec3 b) { return {std::max(a.x, b.x), std::max(a.y, b.y), std::max(a.z, b.z)}; }
inline bool is_finite(Vec3 a) { return std::isfinite(a.x) && std::isfinite(a.y) && std::isfinite(a.z); }
constexpr bool is_black(Vec3 a) { return a.x == 0 && a.y == 0 && a.z == 0; }
template <typename T>
constexpr T square(T x) {
  return x * x;
}
constexpr Vec3 lerp(Vec3 a, Vec3 b, float t) { return a * (1 - t) + b * t; }
// From 0 at `from` to 1 at `to`, without a kink at either.
constexpr float smooth_step(float from, float to, float x) {
  const float t = std::clamp((x - from) / (to - from), 0.0f, 1.0f);
  return t * t * (3 - 2 * t);
}
inline float safe_sqrt(float x) { return std::sqrt(std::max(x, 0.0f)); }
// Unit normal of a triangle with these edges, their size whatever it is; zero for a triangle without area.
inline Vec3 unit_normal(Vec3 e1, Vec3 e2) {
  const float size = max_component(max(abs(e1), abs(e2)));
  const Vec3 n = cross(e1 / size, e2 / size);
  const float l = length(n);
  return l > 0 ? n / l : Vec3{};
}
// v turned to the side of n that `side` is on.
constexpr Vec3 face_toward(Vec3 v, Vec3 side) { return dot(v, side) < 0 ? -v : v; }

// Orthonormal basis around the unit vector n (Duff et al. 2017), continuous but at n = -z.
struct Frame {
  Vec3 s, t, n;

  explicit Frame(Vec3 normal) : n(normal) {
    const float sign = std::copysign(1.0f, n.z);
    const float a = -1 / (sign + n.z);
    const float b = n.x * n.y * a;
    s = {1 + sign * n.x * n.x * a, sign * b, -sign * n.x};
    t = {b, sign + n.y * n.y * a, -n.y};
  }
  Vec3 to_local(Vec3 v) const { return {dot(v, s), dot(v, t), dot(v, n)}; }
  Vec3 to_world(Vec3 v) const { return s * v.x + t * v.y + n * v.z; }
};

// Row-major 3x4 affine map.
struct Affine {
  std::array<float, 12> m{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};

  Vec3 column(int i) const { return {m[i], m[4 + i], m[8 + i]}; }
  Vec3 vector(Vec3 v) const { return column(0) * v.x + column(1) * v.y + column(2) * v.z; }
  Vec3 point(Vec3 p) const { return vector(p) + column(3); }
  // The largest coordinate, in absolute value, among the terms and sums of point(p): what its rounding error is relative to.
  float reach(Vec3 p) const {
    return max_component(abs(column(0)) * std::abs(p.x) + abs(column(1)) * std::abs(p.y) + abs(column(2)) * std::abs(p.z) + abs(column(3)));
  }
  // A normal goes with the inverse transpose; here with the cofactor matrix, so up to a positive factor times the determinant's sign.
  Vec3 normal(Vec3 n) const {
    const Vec3 a = column(0), b = column(1), c = column(2);
    const float sign = determinant() < 0 ? -1.0f : 1.0f;
    return (cross(b, c) * n.x + cross(c, a) * n.y + cross(a, b) * n.z) * sign;
  }
  float determinant() const { return dot(column(0), cross(column(1), column(2))); }
};

struct Bounds {
  Vec3 lo = splat(kInfinity), hi = splat(-kInfinity);

  bool empty() const { return lo.x > hi.x; }
  constexpr bool operator==(const Bounds& b) const { return lo == b.lo && hi == b.hi; }
  void add(Vec3 p) { lo = min(lo, p), hi = max(hi, p); }
  void add(const Bounds& b) { lo = min(lo, b.lo), hi = max(hi, b.hi); }
  Vec3 center() const { return (lo + hi) * 0.5f; }
  float radius() const { return empty() ? 0.0f : 0.5f * length(hi - lo); }
};

// A unit vector in 32 bits (octahedral map); the error is below 7e-5 radians.
using PackedDirection = uint32_t;

inline PackedDirection pack_direction(Vec3 v) {
  const float norm = std::abs(v.x) + std::abs(v.y) + std::abs(v.z);
  float x = v.x / norm, y = v.y / norm;
  if (v.z < 0) {
    const float fold_x = (1 - std::abs(y)) * std::copysign(1.0f, x);
    y = (1 - std::abs(x)) * std::copysign(1.0f, y);
    x = fold_x;
  }
  const auto quantize = [](float a) { return static_cast<uint32_t>(std::lrint((std::clamp(a, -1.0f, 1.0f) + 1) * 32767)); };
  return quantize(x) | quantize(y) << 16;
}

inline Vec3 unpack_direction(PackedDirection packed) {
  const float x = static_cast<float>(packed & 0xffff) / 32767 - 1, y = static_cast<float>(packed >> 16) / 32767 - 1;
  const float z = 1 - std::abs(x) - std::abs(y);
  const float fold = std::max(-z, 0.0f);
  return normalize({x - std::copysign(fold, x), y - std::copysign(fold, y), z});
}

}  // namespace sppm
