#include "motion.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "sampling.h"

using namespace sppm;

namespace {

// Turned about z, stretched before and moved after.
Affine place(float angle, Vec3 scale, Vec3 at) {
  const float c = std::cos(angle), s = std::sin(angle);
  return {{c * scale.x, -s * scale.y, 0, at.x, s * scale.x, c * scale.y, 0, at.y, 0, 0, scale.z, at.z}};
}

void check_close(const Affine& found, const Affine& expected) {
  for (size_t i = 0; i < 12; ++i)
    CHECK(static_cast<double>(found.m[i]) == doctest::Approx(static_cast<double>(expected.m[i])).epsilon(1e-6));
}

}  // namespace

TEST_CASE("at its keys a motion is where they say, to the bits") {
  const std::vector<Affine> places{place(0.3f, {1, 2, 3}, {4, 5, 6}), place(1, {-1, 2, 1}, {0, 0, 1}), place(2, {1, 1, 0}, {7, 0, 0})};
  const Motion motion(places);
  CHECK(motion.at(0).m == places[0].m);
  CHECK(motion.at(0.5).m == places[1].m);
  CHECK(motion.at(1).m[3] == doctest::Approx(7));
  CHECK(Motion(std::vector<Affine>{places[1]}).at(0.7).m == places[1].m);
}

TEST_CASE("translation, turn and stretch are each interpolated by themselves") {
  struct Case {
    float turn;
    Vec3 scale;
  };
  for (const Case& c : {Case{0.5f, {1, 1, 1}}, Case{3.0f, {2, 2, 2}}, Case{-2.0f, {1, 3, 0.5f}},
                        Case{1e-4f, {1, 1, 1}}, Case{1.5f, {-1, -1, -1}}}) {
    const Motion motion(std::vector<Affine>{place(0.2f, c.scale, {0, 0, 0}), place(0.2f + c.turn, c.scale * 2, {1, -2, 4})});
    for (const float t : {0.1f, 0.25f, 0.5f, 0.9f})
      check_close(motion.at(static_cast<double>(t)), place(0.2f + t * c.turn, c.scale * (1 + t), Vec3{1, -2, 4} * t));
  }
}

TEST_CASE("a turn takes the short way around") {
  const Motion motion(std::vector<Affine>{place(0, {1, 1, 1}, {}), place(4.0f, {1, 1, 1}, {})});
  check_close(motion.at(0.5), place((4.0f - 2 * kPi) / 2, {1, 1, 1}, {}));
}

TEST_CASE("what is squeezed flat moves evenly") {
  const Motion motion(std::vector<Affine>{place(0, {1, 1, 0}, {0, 0, 0}), place(0, {1, 1, 0}, {2, 0, 0})});
  check_close(motion.at(0.25), place(0, {1, 1, 0}, {0.5f, 0, 0}));
}

TEST_CASE("huge, tiny and very unequal places turn as others do") {
  constexpr float kHuge = 1e38f, kTiny = 1e-38f;
  for (const Vec3 scale : {Vec3{kHuge, kHuge, kHuge}, Vec3{kTiny, kTiny, kTiny}, Vec3{kHuge, 1, kTiny}, Vec3{kTiny, kHuge, 1},
                           Vec3{1, 1, kTiny}, Vec3{-kHuge, -1, -kTiny}}) {
    const Affine middle = Motion(std::vector{place(0, scale, {}), place(1, scale, {kHuge, 0, -kHuge})}).at(0.5);
    const Affine expected = place(0.5f, scale, {kHuge / 2, 0, -kHuge / 2});
    for (const int column : {0, 1, 2, 3}) {
      const Vec3 found = middle.column(column), wanted = expected.column(column);
      const float size = max_component(abs(wanted));
      if (size == 0) continue;
      CAPTURE(column);
      CAPTURE(scale.x);
      CHECK(max_component(abs(found / size - wanted / size)) < 1e-5f);  // roundings of denormal floats
    }
  }
}

TEST_CASE("whatever the keys, what lies between them is finite") {
  constexpr float kLargest = std::numeric_limits<float>::max(), kLeast = std::numeric_limits<float>::denorm_min();
  const float values[] = {0, 1, -1, kLargest, -kLargest, kLeast, 1e-20f, -1e20f, 0.3f};
  for (uint32_t i = 0; i < 20000; ++i) {
    std::vector<Affine> places(2);
    for (uint32_t k = 0; k < 24; ++k) places[k / 12].m[k % 12] = values[hash64(i, k) % std::size(values)];
    const Motion motion(places);
    for (const double time : {0.01, 0.5, 0.99})
      for (const float x : motion.at(time).m) REQUIRE(std::isfinite(x));
  }
}

TEST_CASE("half turns about every axis") {
  for (int axis = 0; axis < 3; ++axis) {
    Affine turned;
    for (const int other : {(axis + 1) % 3, (axis + 2) % 3}) turned.m[static_cast<size_t>(5 * other)] = -1;
    const Affine half = Motion(std::vector<Affine>{{}, turned}).at(0.5);
    CHECK(half.m[static_cast<size_t>(5 * axis)] == doctest::Approx(1));
    CHECK(half.determinant() == doctest::Approx(1));
    CHECK(half.m[static_cast<size_t>(5 * ((axis + 1) % 3))] == doctest::Approx(0));
  }
}

TEST_CASE("any number of passes fills the shutter evenly, each seed in its own way") {
  for (const uint64_t passes : {1u, 2u, 16u, 100u, 1000u}) {
    std::vector<double> times;
    for (uint64_t i = 0; i < passes; ++i) times.push_back(pass_time(7, i));
    std::sort(times.begin(), times.end());
    CHECK((times.front() >= 0 && times.back() < 1));
    double largest = 1 + times.front() - times.back();
    for (size_t i = 1; i < times.size(); ++i) largest = std::max(largest, times[i] - times[i - 1]);
    CHECK(largest < 2.62 / static_cast<double>(passes));  // of three gap lengths the largest is at most phi^2 / n
  }
  CHECK(pass_time(1, 0) != pass_time(2, 0));
}
