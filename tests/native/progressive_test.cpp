#include "progressive.h"

#include <doctest/doctest.h>

using namespace sppm;

namespace {

ProgressiveEstimate start(float radius) {
  ProgressiveEstimate e;
  e.radius = radius;
  return e;
}

}  // namespace

TEST_CASE("the update rule, by hand") {
  // N = 0, M = 8, gamma = 3/4: N' = 6, r'^2 / r^2 = 6/8, tau' = 16 * 6/8.
  ProgressiveEstimate e = start(2);
  e.update(8, {16, 8, 0}, 0.75, 0);
  CHECK(e.count == doctest::Approx(6));
  CHECK(static_cast<double>(e.radius) == doctest::Approx(2 * std::sqrt(0.75)));
  CHECK(e.flux[0] == doctest::Approx(12));
  CHECK(e.flux[1] == doctest::Approx(6));
  CHECK(e.flux[2] == 0);
  // N = 6, M = 2: N' = 7.5, shrink = 7.5/8, tau' = (12 + 4) * 7.5/8.
  e.update(2, {4, 0, 0}, 0.75, 0);
  CHECK(e.count == doctest::Approx(7.5));
  CHECK(static_cast<double>(e.radius) == doctest::Approx(2 * std::sqrt(0.75 * 7.5 / 8)));
  CHECK(e.flux[0] == doctest::Approx(15));
  CHECK(e.flux[1] == doctest::Approx(5.625));
}

TEST_CASE("with gamma 2/3 the first photons leave two thirds of the area") {
  ProgressiveEstimate e = start(1);
  e.update(9, {}, 2.0 / 3, 0);
  CHECK(e.count == doctest::Approx(6));
  CHECK(static_cast<double>(e.radius * e.radius) == doctest::Approx(2.0 / 3));
}

TEST_CASE("an iteration that finds nothing changes nothing") {
  ProgressiveEstimate e = start(0.5f);
  e.update(3, {1, 2, 3}, 2.0 / 3, 0);
  const ProgressiveEstimate before = e;
  e.update(0, {}, 2.0 / 3, 0);
  CHECK(e.radius == before.radius);
  CHECK(e.count == before.count);
  CHECK(e.flux[1] == before.flux[1]);
}

TEST_CASE("at the smallest radius photons still add up") {
  ProgressiveEstimate e = start(0.1f);
  e.update(4, {1, 1, 1}, 2.0 / 3, 0.2f);
  CHECK(e.radius == 0.1f);
  CHECK(e.count == 4);
  CHECK(e.flux[0] == 1);
}

TEST_CASE("radiance is flux over pi r^2 and the paths emitted") {
  ProgressiveEstimate e = start(0.5f);
  CHECK(is_black(e.radiance(100)));
  e.flux[0] = 3;
  CHECK(static_cast<double>(e.radiance(100).x) == doctest::Approx(3 / (M_PI * 0.25 * 100)));
  CHECK(is_black(e.radiance(0)));
  CHECK(is_black(start(0).radiance(10)));
}

TEST_CASE("uniform light gives its radiance however far the radius shrinks") {
  // Photons of flux 1 that lie with a density of 1000 per m^2 and iteration: radiance 1000 / 500 paths with f = 1.
  ProgressiveEstimate e = start(1);
  for (int i = 0; i < 2000; ++i) {
    const auto m = static_cast<uint64_t>(std::lround(1000 * M_PI * static_cast<double>(e.radius * e.radius)));
    e.update(m, splat(static_cast<float>(m)), 2.0 / 3, 0);
  }
  CHECK(static_cast<double>(e.radius) < 0.3);
  CHECK(static_cast<double>(e.radiance(2000 * 500).x) == doctest::Approx(2).epsilon(0.01));
}

TEST_CASE("a million iterations lose no digits that matter") {
  ProgressiveEstimate e = start(1);
  long double count = 0, flux = 0, area = 1;
  const long double gamma = static_cast<long double>(2.0 / 3);
  for (int i = 0; i < 1000000; ++i) {
    const uint64_t m = static_cast<uint64_t>(i) % 3;
    const float phi = static_cast<float>(m) * 0.37f;
    e.update(m, {phi, 0, 0}, 2.0 / 3, 0);
    if (m == 0) continue;
    const long double shrink = (count + gamma * m) / (count + m);
    count += gamma * m;
    flux = (flux + static_cast<long double>(phi)) * shrink;
    area *= shrink;
  }
  CHECK(e.count == doctest::Approx(static_cast<double>(count)).epsilon(1e-9));
  CHECK(e.flux[0] / static_cast<double>(flux) == doctest::Approx(1).epsilon(1e-9));
  // The radius is kept in float, and so is its error: what counts is that flux and area shrink together.
  const double measured = static_cast<double>(e.radius) * static_cast<double>(e.radius);
  CHECK(measured / static_cast<double>(area) == doctest::Approx(1).epsilon(5e-3));
}

TEST_CASE("the same million iterations in float go wrong") {
  // Why the sums of a pixel are double: a constant light, its photons and its direct part.
  ProgressiveEstimate exact = start(1);
  float radius = 1, count = 0, flux = 0, direct = 0;
  double exact_direct = 0;
  constexpr int n = 1000000;
  for (int i = 0; i < n; ++i) {
    const float m = static_cast<float>(1 + i % 3), phi = m * 0.37f, light = 0.1f;
    exact.update(static_cast<uint64_t>(m), {phi, 0, 0}, 2.0 / 3, 0);
    const float shrink = (count + 2.0f / 3 * m) / (count + m);
    count += 2.0f / 3 * m;
    flux = (flux + phi) * shrink;
    radius *= std::sqrt(shrink);
    direct += light, exact_direct += static_cast<double>(light);
  }
  const double error = static_cast<double>(flux / (radius * radius)) / (exact.flux[0] / (exact.radius * exact.radius)) - 1;
  const double direct_error = static_cast<double>(direct) / exact_direct - 1;
  MESSAGE("in float the photons' radiance is off by " << error << ", direct light by " << direct_error);
  CHECK(std::abs(direct_error) > 1e-3);
  CHECK(exact_direct / n == doctest::Approx(0.1).epsilon(1e-7));
}

TEST_CASE("counts go past 2^32") {
  ProgressiveEstimate e = start(0.5f);
  const uint64_t many = (uint64_t{1} << 32) + 1000;
  e.update(many, splat(static_cast<float>(many)), 0.75, 0);
  CHECK(e.count == doctest::Approx(0.75 * static_cast<double>(many)).epsilon(1e-12));
  e.update(1, {}, 0.75, 0);
  CHECK(e.count == doctest::Approx(0.75 * static_cast<double>(many) + 0.75).epsilon(1e-15));
  e.flux[0] = 1e12;
  const uint64_t emitted = uint64_t{5} << 40;
  CHECK(static_cast<double>(e.radiance(emitted).x) ==
        doctest::Approx(1e12 / (M_PI * e.radius * e.radius * static_cast<double>(emitted))).epsilon(1e-6));
}
