#include <algorithm>
#include <cmath>
#include <vector>

#include "targets.h"

#include <doctest/doctest.h>

#include "sampling.h"

using namespace sppm;

namespace {

constexpr uint64_t kSamples = 1 << 16;

Caster caster(Vec3 lo, Vec3 hi, float strength = 1) {
  Caster c;
  c.bounds.add(lo), c.bounds.add(hi);
  c.strength = strength;
  return c;
}

// A flat sheet of n x n tiles, 2 m wide, at z = 0.
std::vector<Caster> sheet(int n) {
  std::vector<Caster> casters;
  const float w = 2.0f / static_cast<float>(n);
  for (int i = 0; i < n * n; ++i) {
    const float x = static_cast<float>(i / n) * w - 1, y = static_cast<float>(i % n) * w - 1;
    casters.push_back(caster({x, y, 0}, {x + w, y + w, 0}));
  }
  return casters;
}

std::vector<Caster> ball(float radius) {
  std::vector<Caster> casters;
  for (uint64_t i = 0; i < 2000; ++i) {
    const Vec3 p = sample_sphere(Sampler(1, i).next().first()) * radius;
    casters.push_back(caster(p - splat(0.01f * radius), p + splat(0.01f * radius)));
  }
  return casters;
}

Targets built(std::vector<Caster> casters) {
  Targets targets;
  targets.build(std::move(casters));
  return targets;
}

bool meets_sheet(Vec3 p, Vec3 w) {
  if (w.z == 0) return false;
  const float t = -p.z / w.z;
  return t > 0 && std::abs(p.x + t * w.x) < 1 && std::abs(p.y + t * w.y) < 1;
}

// Solid angle of the sheet within a cone, by directions drawn over the sphere and by aimed ones.
void check_solid_angle(const Targets& targets, Vec3 p, const Cone& limit) {
  double all = 0, aimed = 0;
  for (uint64_t i = 0; i < 4 * kSamples; ++i) {
    const Sample4 u = Sampler(2, i).next();
    const auto counts = [&](Vec3 w) { return meets_sheet(p, w) && dot(w, limit.axis) > limit.cos_half; };
    all += counts(sample_sphere(u.first())) ? 4 * M_PI : 0;
    const auto s = targets.sample_direction(p, 0, limit, u.first(), u[2]);
    REQUIRE(s);
    CHECK(std::abs(length(s->direction) - 1) < 1e-5f);
    if (counts(s->direction)) aimed += 1 / static_cast<double>(s->pdf_solid_angle);
  }
  CHECK(aimed == doctest::Approx(all).epsilon(0.02));
}

}  // namespace

TEST_CASE("nothing to aim at") {
  CHECK(built({}).empty());
}

TEST_CASE("a solid ball is one target, thin things are several small ones") {
  CHECK(built(ball(0.3f)).count() == 1);
  CHECK(built(sheet(16)).count() > 16);
  std::vector<Caster> two = ball(0.3f);
  for (Caster c : ball(0.1f)) {
    c.bounds.lo += {5, 0, 0}, c.bounds.hi += {5, 0, 0};
    two.push_back(c);
  }
  CHECK(built(two).count() == 2);
}

TEST_CASE("aimed directions measure the solid angle of what they are aimed at, from outside, near and inside, and within a cone") {
  const Targets targets = built(sheet(16));
  for (const Vec3 p : {Vec3{0.3f, -0.2f, 3}, Vec3{2, 2, 1}, Vec3{0.5f, 0.4f, 0.05f}})
    for (const Cone& limit : {Cone{}, Cone{normalize({-0.2f, 0.1f, -1}), 0},
                              Cone{normalize({-0.6f, -0.5f, -0.6f}), 0.8f}, Cone{{0, 0, -1}, -0.5f}})
      check_solid_angle(targets, p, limit);
}

TEST_CASE("targets behind a surface are not aimed at") {
  CHECK_FALSE(built(sheet(4)).sample_direction({0, 0, 5}, 0, {{0, 0, 1}, 0}, {0.3f, 0.4f}, 0.5f));
}

TEST_CASE("a margin widens what is aimed at by as much") {
  const Targets targets = built({caster(splat(-0.1f), splat(0.1f))});
  const float reach = std::sqrt(0.03f) + 0.5f;
  float farthest = 0;
  for (uint64_t i = 0; i < kSamples; ++i) {
    const Sample4 u = Sampler(3, i).next();
    const auto s = targets.sample_direction({0, 0, 4}, 0.5f, {}, u.first(), u[2]);
    farthest = std::max(farthest, length(cross({0, 0, 4}, s->direction)));
  }
  CHECK(farthest == doctest::Approx(static_cast<double>(reach)).epsilon(0.001));
}

TEST_CASE("aimed lines measure the projected area of what they are aimed at") {
  const Targets targets = built(sheet(8));
  for (const Vec3 direction : {Vec3{0, 0, 1}, normalize({0.5f, 0.2f, 0.6f})}) {
    double area = 0;
    for (uint64_t i = 0; i < kSamples; ++i) {
      const Sample4 u = Sampler(4, i).next();
      const auto line = targets.sample_line(direction, u.first(), u[2]);
      const Vec3 above = line.point + direction * 9;
      if (meets_sheet(above, -direction)) area += 1 / static_cast<double>(line.pdf_area);
    }
    CHECK(area / kSamples == doctest::Approx(4 * static_cast<double>(direction.z)).epsilon(0.01));
  }
}
