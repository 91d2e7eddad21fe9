// Whether samples follow the density that they should have: Pearson's test, and cells of directions and positions to count them in.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "vecmath.h"

namespace sppm {

// A right sampler exceeds this once in about 3.5 million tests.
inline constexpr double kMostSigmas = 5;

class ChiSquare {
 public:
  // A cell where `count` samples fell and `expected` should have. Cells where little is expected are pooled.
  void add(double expected, double count) { add(count - expected, expected, expected); }
  // The same for a sum of weights that should be 0 on average, with its variance; `expected` samples make it up.
  void add(double difference, double variance, double expected) {
    if (expected < kLeast) {
      rest_difference_ += difference, rest_variance_ += variance, rest_expected_ += expected;
    } else {
      chi2_ += difference * difference / variance;
      ++cells_;
    }
  }
  // How many standard deviations the sum is above what chance gives (Wilson and Hilferty 1931).
  double sigmas() const {
    double chi2 = chi2_, cells = cells_;
    if (rest_expected_ >= kLeast) {
      chi2 += rest_difference_ * rest_difference_ / rest_variance_, ++cells;
    } else if (rest_difference_ > 10 * std::sqrt(kLeast)) {
      return std::numeric_limits<double>::infinity();  // many samples where next to none may be
    }
    const double freedom = std::max(1.0, cells - 1), spread = 2 / (9 * freedom);
    return (std::cbrt(chi2 / freedom) - (1 - spread)) / std::sqrt(spread);
  }
  int cells() const { return cells_; }

 private:
  static constexpr double kLeast = 10;
  double chi2_ = 0, rest_difference_ = 0, rest_variance_ = 0, rest_expected_ = 0;
  int cells_ = 0;
};

// Cells of equal solid angle in a cone about frame.n; the whole sphere if `one_minus_cos` is 2.
struct DirectionCells {
  Frame frame{{0, 0, 1}};
  float one_minus_cos = 2;
  int rows = 12, columns = 24;

  size_t size() const { return static_cast<size_t>(rows * columns); }
  // size() for what is outside the cone.
  size_t find(Vec3 direction) const {
    const Vec3 d = frame.to_local(direction);
    const float h = (d.z > 0.5f ? 0.5f * length_squared(direction - frame.n) : 1 - d.z) / one_minus_cos;  // exact in narrow cones
    if (h > 1.0001f) return size();
    const int row = std::clamp(static_cast<int>(h * static_cast<float>(rows)), 0, rows - 1);
    const float turn = std::atan2(d.y, d.x) / (2 * kPi) + 0.5f;
    return static_cast<size_t>(row * columns + std::clamp(static_cast<int>(turn * static_cast<float>(columns)), 0, columns - 1));
  }
  // Integral of density(direction) over a cell, with steps^2 points.
  template <typename Density>
  double integral(size_t cell, Density density, int steps) const {
    const int row = static_cast<int>(cell) / columns, column = static_cast<int>(cell) % columns;
    double sum = 0;
    for (int i = 0; i < steps * steps; ++i) {
      const auto middle = [&](int k, int first, int count) {
        return (static_cast<float>(first) + (static_cast<float>(k) + 0.5f) / static_cast<float>(steps)) / static_cast<float>(count);
      };
      const float h = one_minus_cos * middle(i / steps, row, rows), phi = 2 * kPi * (middle(i % steps, column, columns) - 0.5f);
      const float r = std::sqrt(h * (2 - h));
      sum += static_cast<double>(density(frame.to_world({r * std::cos(phi), r * std::sin(phi), 1 - h})));
    }
    return sum / (steps * steps) * 2 * M_PI * static_cast<double>(one_minus_cos) / static_cast<double>(size());
  }
};

// Where a point of the disk of radius 1 lies in the unit square, areas kept.
inline Vec2 disk_to_square(float x, float y) { return {x * x + y * y, std::atan2(y, x) / (2 * kPi) + 0.5f}; }
// The same for barycentrics of the second and third vertex.
inline Vec2 triangle_to_square(Vec2 b) { return {square(1 - b.x), b.x < 1 ? b.y / (1 - b.x) : 0}; }

// side^2 cells of equal area in the unit square.
inline size_t square_cell(Vec2 p, int side) {
  const auto index = [side](float x) { return std::clamp(static_cast<int>(x * static_cast<float>(side)), 0, side - 1); };
  return static_cast<size_t>(index(p.x) * side + index(p.y));
}

// Samples that should be uniform in the unit square.
inline ChiSquare uniformity(const std::vector<Vec2>& points, int side) {
  std::vector<int> counts(static_cast<size_t>(side * side), 0);
  for (const Vec2 p : points) ++counts[square_cell(p, side)];
  ChiSquare test;
  for (const int c : counts) test.add(static_cast<double>(points.size()) / (side * side), c);
  return test;
}

}  // namespace sppm
