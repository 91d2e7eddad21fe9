#include "motion.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "sampling.h"

namespace sppm {
namespace {

using Matrix = std::array<double, 9>;

double determinant(const Matrix& m) {
  return m[0] * (m[4] * m[8] - m[5] * m[7]) - m[1] * (m[3] * m[8] - m[5] * m[6]) + m[2] * (m[3] * m[7] - m[4] * m[6]);
}

// The transposed inverse times the determinant.
Matrix cofactors(const Matrix& m) {
  return {m[4] * m[8] - m[5] * m[7], m[5] * m[6] - m[3] * m[8], m[3] * m[7] - m[4] * m[6],
          m[2] * m[7] - m[1] * m[8], m[0] * m[8] - m[2] * m[6], m[1] * m[6] - m[0] * m[7],
          m[1] * m[5] - m[2] * m[4], m[2] * m[3] - m[0] * m[5], m[0] * m[4] - m[1] * m[3]};
}

// a transposed, times b.
Matrix transposed_times(const Matrix& a, const Matrix& b) {
  Matrix product{};
  for (size_t i = 0; i < 3; ++i)
    for (size_t k = 0; k < 3; ++k)
      for (size_t j = 0; j < 3; ++j) product[3 * i + k] += a[3 * j + i] * b[3 * j + k];
  return product;
}

double largest(const Matrix& m) {
  double most = 0;
  for (const double x : m) most = std::max(most, std::abs(x));
  return most;
}

// The rotation nearest to m, by averaging m with its transposed inverse, both first brought to one size: then ten steps do even where the
// axes differ by all that a float can hold (Higham 1986). The identity where m is flat and has no inverse.
Matrix nearest_rotation(const Matrix& m) {
  constexpr int kMostSteps = 30;
  constexpr double kClose = 1e-14;
  constexpr Matrix kIdentity{1, 0, 0, 0, 1, 0, 0, 0, 1};
  Matrix r = m;
  for (int step = 0; step < kMostSteps; ++step) {
    const double size = largest(r);
    Matrix x = r;
    for (double& component : x) component /= size;
    const double d = determinant(x);
    if (!(std::abs(d) > std::numeric_limits<double>::min())) return kIdentity;
    const Matrix c = cofactors(x);
    const double scale = std::sqrt(largest(c) / std::abs(d));
    double change = 0;
    for (size_t i = 0; i < 9; ++i) {
      const double next = 0.5 * (x[i] * scale + c[i] / (d * scale));
      change = std::max(change, std::abs(next - r[i]));
      r[i] = next;
    }
    if (change > kClose) continue;
    if (determinant(r) < 0)  // the stretch mirrors, not the rotation
      for (double& component : r) component = -component;
    return r;
  }
  return kIdentity;
}

// Of a rotation, by its largest component (Shepperd 1978).
std::array<double, 4> quaternion(const Matrix& m) {
  const double trace = m[0] + m[4] + m[8];
  std::array<double, 4> q{};
  if (trace > 0) {
    const double s = 2 * std::sqrt(1 + trace);
    q = {s / 4, (m[7] - m[5]) / s, (m[2] - m[6]) / s, (m[3] - m[1]) / s};
  } else {
    const size_t i = m[0] >= m[4] && m[0] >= m[8] ? 0 : m[4] >= m[8] ? 1 : 2, j = (i + 1) % 3, k = (i + 2) % 3;
    const double s = 2 * std::sqrt(std::max(1 + m[4 * i] - m[4 * j] - m[4 * k], 0.0));
    q[0] = (m[3 * k + j] - m[3 * j + k]) / s;
    q[1 + i] = s / 4;
    q[1 + j] = (m[3 * j + i] + m[3 * i + j]) / s;
    q[1 + k] = (m[3 * k + i] + m[3 * i + k]) / s;
  }
  return q;
}

Matrix rotation_of(const std::array<double, 4>& q) {
  const auto [w, x, y, z] = q;
  return {1 - 2 * (y * y + z * z), 2 * (x * y - w * z),     2 * (x * z + w * y),
          2 * (x * y + w * z),     1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
          2 * (x * z - w * y),     2 * (y * z + w * x),     1 - 2 * (x * x + y * y)};
}

// What lies between finite places is finite too.
float to_float(double x) {
  constexpr double kLargest = std::numeric_limits<float>::max();
  return static_cast<float>(std::clamp(x, -kLargest, kLargest));
}

double dot(const std::array<double, 4>& a, const std::array<double, 4>& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3]; }

std::array<double, 4> slerp(const std::array<double, 4>& a, const std::array<double, 4>& b, double share) {
  constexpr double kNearlyEqual = 0.9999999;
  const double cosine = dot(a, b);
  double of_a = 1 - share, of_b = share;
  if (cosine < kNearlyEqual) {
    const double angle = std::acos(std::clamp(cosine, -1.0, 1.0)), sine = std::sin(angle);
    of_a = std::sin(of_a * angle) / sine, of_b = std::sin(of_b * angle) / sine;
  }
  std::array<double, 4> q{};
  for (size_t i = 0; i < 4; ++i) q[i] = of_a * a[i] + of_b * b[i];
  const double length = std::sqrt(dot(q, q));
  for (double& x : q) x /= length;
  return q;
}

template <size_t n>
std::array<double, n> linear(const std::array<double, n>& a, const std::array<double, n>& b, double share) {
  std::array<double, n> mix;
  for (size_t i = 0; i < n; ++i) mix[i] = a[i] + (b[i] - a[i]) * share;
  return mix;
}

}  // namespace

Motion::Motion(std::span<const Affine> places) : places_(places.begin(), places.end()) {
  for (const Affine& place : places_) {
    poses_.push_back(take_apart(place));
    if (poses_.size() < 2) continue;
    auto& q = poses_.back().rotation;
    if (dot(poses_[poses_.size() - 2].rotation, q) < 0)  // the short way around
      for (double& x : q) x = -x;
  }
}

Affine Motion::at(double time) const {
  const KeyTime t(time, places_.size());
  if (t.share == 0) return places_[t.key];
  return put_together(between(poses_[t.key], poses_[t.key + 1], t.share));
}

Motion::Pose Motion::take_apart(const Affine& place) {
  Matrix m;
  Pose pose{};
  for (size_t row = 0; row < 3; ++row) {
    for (size_t column = 0; column < 3; ++column) m[3 * row + column] = static_cast<double>(place.m[4 * row + column]);
    pose.translation[row] = static_cast<double>(place.m[4 * row + 3]);
  }
  const Matrix rotation = nearest_rotation(m);
  pose.rotation = quaternion(rotation);
  pose.stretch = transposed_times(rotation, m);
  return pose;
}

Affine Motion::put_together(const Pose& pose) {
  const Matrix r = rotation_of(pose.rotation), &s = pose.stretch;
  Affine place;
  for (size_t row = 0; row < 3; ++row) {
    for (size_t column = 0; column < 3; ++column)
      place.m[4 * row + column] = to_float(r[3 * row] * s[column] + r[3 * row + 1] * s[3 + column] + r[3 * row + 2] * s[6 + column]);
    place.m[4 * row + 3] = to_float(pose.translation[row]);
  }
  return place;
}

Motion::Pose Motion::between(const Pose& a, const Pose& b, double share) {
  return {linear(a.translation, b.translation, share), slerp(a.rotation, b.rotation, share), linear(a.stretch, b.stretch, share)};
}

double pass_time(uint64_t seed, uint64_t pass) {
  constexpr uint64_t kStream = 0x73687574746572, kGoldenRatio = 0x9e3779b97f4a7c15;  // 2^64 / phi
  return static_cast<double>((hash64(kStream, seed) + pass * kGoldenRatio) >> 11) * 0x1p-53;
}

}  // namespace sppm
