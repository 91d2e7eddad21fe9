#include <cmath>

#include "progressive.h"

#include <doctest/doctest.h>

using namespace sppm;

namespace {

PhotonEstimate start(double radius) {
  PhotonEstimate e;
  e.radius = radius;
  return e;
}

RadiusRule rule(SppmRadiusRule kind, double gamma = 2.0 / 3) {
  RadiusRule r;
  r.rule = kind;
  r.gamma = gamma;
  return r;
}

const RadiusRule kSeed = rule(SPPM_RADIUS_PROGRESSIVE);

double radiance(const PhotonEstimate& e, uint64_t iterations) { return static_cast<double>(e.radiance(iterations).x); }

// An iteration with one visible point, whose disk of the estimate's radius finds `found` photons with the sum `phi`.
void update(PhotonEstimate& e, uint64_t found, Vec3 phi, uint64_t paths, RadiusRule r, double footprint, float smallest,
            uint64_t paths_before = 0) {
  r.paths = paths, r.paths_before = paths_before;
  Gathered gathered;
  gathered.add(found, phi, M_PI * e.radius * e.radius, paths);
  e.update(gathered, r, footprint, smallest);
}

}  // namespace

TEST_CASE("the progressive rule, by hand") {
  // N = 0, M = 8, gamma = 3/4: N' = 6, r'^2 / r^2 = 6/8, tau' = 16 * 6/8.
  const RadiusRule r = rule(SPPM_RADIUS_PROGRESSIVE, 0.75);
  PhotonEstimate e = start(2);
  update(e, 8, {16, 8, 0}, 1, r, 1, 0);
  CHECK(e.count == doctest::Approx(6));
  CHECK(e.radius == doctest::Approx(2 * std::sqrt(0.75)));
  CHECK(e.radiance_sum[0] == doctest::Approx(12 / (M_PI * e.radius * e.radius)));
  CHECK(e.radiance_sum[1] == doctest::Approx(6 / (M_PI * e.radius * e.radius)));
  CHECK(e.radiance_sum[2] == 0);
  // N = 6, M = 2: N' = 7.5, shrink = 7.5/8, tau' = (12 + 4) * 7.5/8.
  update(e, 2, {4, 0, 0}, 1, r, 1, 0);
  CHECK(e.count == doctest::Approx(7.5));
  CHECK(e.radius == doctest::Approx(2 * std::sqrt(0.75 * 7.5 / 8)));
  CHECK(e.radiance_sum[0] == doctest::Approx(15 / (M_PI * e.radius * e.radius)));
  CHECK(e.radiance_sum[1] == doctest::Approx(5.625 / (M_PI * e.radius * e.radius)));
}

TEST_CASE("with gamma 2/3 the first photons leave two thirds of the area") {
  PhotonEstimate e = start(1);
  update(e, 9, {}, 1, kSeed, 1, 0);
  CHECK(e.count == doctest::Approx(6));
  CHECK(e.radius * e.radius == doctest::Approx(2.0 / 3));
}

TEST_CASE("under the progressive rule an iteration that finds nothing changes nothing") {
  PhotonEstimate e = start(0.5);
  update(e, 3, {1, 2, 3}, 1, kSeed, 1, 0);
  const PhotonEstimate before = e;
  update(e, 0, {}, 1, kSeed, 1, 0);
  CHECK(e.radius == before.radius);
  CHECK(e.count == before.count);
  CHECK(e.radiance_sum[1] == before.radiance_sum[1]);
}

TEST_CASE("no rule takes the radius below the smallest, and photons still add up there") {
  for (const auto kind : {SPPM_RADIUS_PROGRESSIVE, SPPM_RADIUS_DENSITY, SPPM_RADIUS_PASS_INDEXED}) {
    RadiusRule r = rule(kind);
    r.shrink = 1e-9;
    PhotonEstimate e = start(0.3);
    for (int i = 0; i < 100; ++i) update(e, 1000, {1, 1, 1}, 1, r, 0.01, 0.2f);
    CHECK(e.radius == doctest::Approx(static_cast<double>(0.2f)));
    CHECK(radiance(e, 100) > 1 / (M_PI * 0.09));
  }
}

TEST_CASE("the pass-indexed rule follows Knaus and Zwicker, whatever is found") {
  const double gamma = 0.7;
  RadiusRule r = rule(SPPM_RADIUS_PASS_INDEXED, gamma);
  PhotonEstimate e = start(kFirstRadius * 0.5);
  double expected = square(static_cast<float>(kFirstRadius * 0.5));
  for (uint64_t i = 1; i <= 50; ++i) {
    r.shrink *= RadiusRule::step(i, gamma);
    update(e, i % 7, {}, 1, r, 0.5, 0);
    expected *= (static_cast<double>(i) + gamma) / (static_cast<double>(i) + 1);
    CHECK(e.radius * e.radius == doctest::Approx(expected));
  }
}

TEST_CASE("the density rule aims at its count, within its limits, by what was found before") {
  RadiusRule r = rule(SPPM_RADIUS_DENSITY);
  r.wanted = 10, r.pixels = 1000;
  const double footprint = 0.01, first = kFirstRadius * footprint;
  // As many paths as pixels, 40 photons in the first disk: the next one is to hold 10.
  PhotonEstimate e = start(first);
  update(e, 40, {}, 1000, r, footprint, 0);
  CHECK(e.radius == doctest::Approx(first / 2));
  // Half the paths find half the photons: the same radius.
  PhotonEstimate half = start(first);
  update(half, 20, {}, 500, r, footprint, 0);
  CHECK(half.radius == doctest::Approx(first / 2));
  PhotonEstimate crowded = start(first), lonely = start(first);
  update(crowded, 1000000, {}, 1000, r, footprint, 0);
  update(lonely, 0, {}, 1000, r, footprint, 0);
  CHECK(crowded.radius == doctest::Approx(r.narrowest * footprint));
  CHECK(lonely.radius == doctest::Approx(first));
}

TEST_CASE("the density rule counts each path alike, however wide the disk of its iteration was") {
  PhotonEstimate e = start(kFirstRadius);
  // One photon a path and unit of area in the first disk, then nine times as many paths with ten in a narrow one.
  const auto found = [&](double density, double paths) {
    return static_cast<uint64_t>(std::lround(density * paths * M_PI * e.radius * e.radius));
  };
  update(e, found(1, 1000), {}, 1000, rule(SPPM_RADIUS_DENSITY), 1, 0);
  e.radius = 0.5;
  update(e, found(10, 9000), {}, 9000, rule(SPPM_RADIUS_DENSITY), 1, 0, 1000);
  CHECK(e.count / e.searched == doctest::Approx(9.1).epsilon(1e-3));
}

TEST_CASE("radiance is the mean of what the iterations found over their disks") {
  PhotonEstimate e = start(0.5);
  CHECK(is_black(e.radiance(0)));
  update(e, 1, {3, 0, 0}, 1, kSeed, 1, 0);
  CHECK(radiance(e, 100) == doctest::Approx(3 / (M_PI * 0.25 * 100)));
  e.add({1, 0, 0});
  CHECK(radiance(e, 2) == doctest::Approx((3 / (M_PI * 0.25) + 1) / 2));
}

TEST_CASE("uniform light gives its radiance however far the radius shrinks, by every rule") {
  // Photons of flux 1 / 500 that lie with a density of 1000 per m^2 and iteration: radiance 2 with f = 1.
  for (const auto kind : {SPPM_RADIUS_PROGRESSIVE, SPPM_RADIUS_DENSITY, SPPM_RADIUS_PASS_INDEXED}) {
    RadiusRule r = rule(kind);
    PhotonEstimate e = start(1);
    for (uint64_t i = 1; i <= 2000; ++i) {
      const auto m = static_cast<uint64_t>(std::lround(1000 * M_PI * e.radius * e.radius));
      r.shrink *= RadiusRule::step(i, r.gamma);
      update(e, m, splat(static_cast<float>(m) / 500), 500, r, 1 / kFirstRadius, 0, 500 * (i - 1));
    }
    CHECK(e.radius < 0.4);
    CHECK(radiance(e, 2000) == doctest::Approx(2).epsilon(0.01));
  }
}

TEST_CASE("a million iterations lose no digits that matter") {
  PhotonEstimate e = start(1);
  long double count = 0, sum = 0, area = static_cast<long double>(M_PI);
  const long double gamma = static_cast<long double>(2.0 / 3);
  for (int i = 0; i < 1000000; ++i) {
    const uint64_t m = static_cast<uint64_t>(i) % 3;
    const float phi = static_cast<float>(m) * 0.37f;
    update(e, m, {phi, 0, 0}, 1, kSeed, 1, 0);
    sum += static_cast<long double>(phi) / area;
    if (m == 0) continue;
    area *= (count + gamma * m) / (count + m);
    count += gamma * m;
  }
  CHECK(e.count == doctest::Approx(static_cast<double>(count)).epsilon(1e-9));
  CHECK(e.radiance_sum[0] / static_cast<double>(sum) == doctest::Approx(1).epsilon(1e-9));
  CHECK(M_PI * e.radius * e.radius / static_cast<double>(area) == doctest::Approx(1).epsilon(1e-9));
}

TEST_CASE("the same million iterations in float go wrong") {
  // Why the sums of a pixel are double: a constant light, and photons that bring as much whatever the radius.
  PhotonEstimate exact = start(1);
  float radius = 1, count = 0, photons = 0, constant = 0;
  double exact_constant = 0;
  constexpr int n = 1000000;
  for (int i = 0; i < n; ++i) {
    const float m = static_cast<float>(1 + i % 3), phi = m * 0.37f, light = 0.1f;
    update(exact, static_cast<uint64_t>(m), {phi, 0, 0}, 1, kSeed, 1, 0);
    photons += phi / (kPi * radius * radius);
    radius *= std::sqrt((count + 2.0f / 3 * m) / (count + m));
    count += 2.0f / 3 * m;
    constant += light, exact_constant += static_cast<double>(light);
  }
  const double photons_error = static_cast<double>(photons) / exact.radiance_sum[0] - 1;
  const double constant_error = static_cast<double>(constant) / exact_constant - 1;
  MESSAGE("in float the photons' radiance is off by " << photons_error << ", a constant light by " << constant_error);
  CHECK(std::abs(constant_error) > 1e-3);
  CHECK(exact_constant / n == doctest::Approx(0.1).epsilon(1e-7));
}

TEST_CASE("counts go past 2^32") {
  PhotonEstimate e = start(0.5);
  const RadiusRule r = rule(SPPM_RADIUS_PROGRESSIVE, 0.75);
  const uint64_t many = (uint64_t{1} << 32) + 1000;
  update(e, many, {1, 0, 0}, many, r, 1, 0);
  CHECK(e.count == doctest::Approx(0.75 * static_cast<double>(many)).epsilon(1e-12));
  update(e, 1, {}, many, r, 1, 0);
  CHECK(e.count == doctest::Approx(0.75 * static_cast<double>(many) + 0.75).epsilon(1e-15));
  const uint64_t iterations = uint64_t{5} << 40;
  CHECK(radiance(e, iterations) == doctest::Approx(1 / (M_PI * 0.25 * static_cast<double>(iterations))).epsilon(1e-6));
}
