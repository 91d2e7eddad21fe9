#include "light.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <random>
#include <vector>

#include "color.h"
#include "light_rig.h"

using namespace sppm;

namespace {

Sample4 number(uint64_t i, uint32_t group) { return Sampler(21, i).at(group); }

constexpr uint64_t kSamples = 1 << 16;

Vec3 emitted_power(const Lights& lights) {
  double sum[3] = {};
  for (uint64_t i = 0; i < kSamples; ++i)
    if (const auto start = lights.emit(number(i, 0), number(i, 1)))
      for (int c = 0; c < 3; ++c) sum[c] += static_cast<double>(start->weight[c]);
  return {static_cast<float>(sum[0] / kSamples), static_cast<float>(sum[1] / kSamples), static_cast<float>(sum[2] / kSamples)};
}

double irradiance(const Lights& lights, Vec3 p, Vec3 n) {
  double sum = 0;
  for (uint64_t i = 0; i < kSamples; ++i)
    if (const auto s = lights.sample_direct(p, number(i, 2)))
      sum += static_cast<double>(s->radiance.x * std::max(0.0f, dot(s->wi, n)) / s->pdf);
  return sum / kSamples;
}

// Mean irradiance of a square metre at height z, by direct light, by photons that cross it from above, and by photons aimed at it.
void check_photons_bring_irradiance(const Lights& lights, float z) {
  double direct = 0, photons = 0, aimed = 0;
  const auto caught = [&](const std::optional<PhotonStart>& start) {
    if (!start || start->direction.z >= 0 || start->origin.z < z) return 0.0;
    const Vec3 q = start->origin + start->direction * ((z - start->origin.z) / start->direction.z);
    return q.x >= 0 && q.x < 1 && std::abs(q.y) < 0.5f ? static_cast<double>(start->weight.x) : 0.0;
  };
  for (uint64_t i = 0; i < 4 * kSamples; ++i) {
    const Sample4 u = number(i, 3);
    const Vec3 p{u[2], u[3] - 0.5f, z};
    if (const auto s = lights.sample_direct(p, number(i, 4)))
      direct += static_cast<double>(s->radiance.x * std::max(0.0f, s->wi.z) / s->pdf);
    photons += caught(lights.emit(number(i, 5), number(i, 6)));
    aimed += caught(lights.emit_aimed(number(i, 7), number(i, 8)));
  }
  CHECK(photons == doctest::Approx(direct).epsilon(0.015).scale(0));
  CHECK(aimed == doctest::Approx(direct).epsilon(0.015).scale(0));
}

double close(double value, double other) { return std::abs(value / other - 1); }

// Of each type, without size where there may be none, and with it.
std::vector<SppmLightDesc> all_lamps() {
  std::vector<SppmLightDesc> lamps = sized_lamps();
  for (const SppmLightType type : {SPPM_LIGHT_POINT, SPPM_LIGHT_SPOT, SPPM_LIGHT_SUN}) lamps.push_back(lamp(type));
  return lamps;
}

}  // namespace

TEST_CASE("photons of each lamp carry its power") {
  struct Case {
    SppmLightDesc desc;
    double power;  // for an emission of 1
  };
  std::vector<Case> cases{{lamp(SPPM_LIGHT_POINT), 4 * M_PI},
                          {lamp(SPPM_LIGHT_SPOT), 2 * M_PI * (1 - std::cos(0.6))},
                          {lamp(SPPM_LIGHT_SUN), M_PI * static_cast<double>(kRadius * kRadius)},
                          {lamp(SPPM_LIGHT_RECTANGLE), M_PI * 2},
                          {lamp(SPPM_LIGHT_ELLIPSE), M_PI * M_PI / 2}};
  cases.push_back(cases[0]), cases.back().desc.radius = 0.5f;
  SppmLightDesc cosine = lamp(SPPM_LIGHT_SPOT);
  cosine.flags = SPPM_LIGHT_SPOT_COSINE;
  cases.push_back({cosine, M_PI * std::pow(std::sin(0.6), 2)});
  SppmLightDesc soft = lamp(SPPM_LIGHT_SPOT);
  soft.blend = 1;  // the mean of smoothstep is 1/2
  cases.push_back({soft, M_PI * (1 - std::cos(0.6))});
  SppmLightDesc scaled = lamp(SPPM_LIGHT_RECTANGLE);
  scaled.transform[0] = 3;
  cases.push_back({scaled, M_PI * 6});
  for (const Case& c : cases) {
    CAPTURE(c.desc.type);
    Rig rig;
    rig.lights.add_lamp(c.desc);
    rig.commit();
    const Vec3 power = emitted_power(rig.lights);
    CHECK(close(static_cast<double>(power.x), c.power) < 0.005);
    CHECK(close(static_cast<double>(power.y), 2 * c.power) < 0.005);
    CHECK(close(rig.lights.power(), c.power * static_cast<double>(luminance({1, 2, 4}))) < 0.005);
  }
}

TEST_CASE("photons of several lights together carry all their power") {
  Rig rig;
  for (const auto& d : all_lamps()) rig.lights.add_lamp(d);
  rig.commit();
  CHECK(close(static_cast<double>(luminance(emitted_power(rig.lights))), rig.lights.power()) < 0.005);
}

TEST_CASE("direct light gives the irradiance known in closed form") {
  const auto at_origin = [](const SppmLightDesc& d) {
    Rig rig;
    rig.lights.add_lamp(d);
    rig.commit();
    return irradiance(rig.lights, {}, {0, 0, 1});
  };
  SppmLightDesc sphere = lamp(SPPM_LIGHT_POINT), spot = lamp(SPPM_LIGHT_SPOT), wide_sun = lamp(SPPM_LIGHT_SUN),
                disk = lamp(SPPM_LIGHT_ELLIPSE);
  sphere.radius = spot.radius = 1, wide_sun.angle = 1, disk.size_y = 2;
  CHECK(close(at_origin(lamp(SPPM_LIGHT_POINT)), 1.0 / 9) < 1e-4);
  CHECK(close(at_origin(sphere), 1.0 / 9) < 1e-3);  // as from its centre
  CHECK(close(at_origin(lamp(SPPM_LIGHT_SPOT)), 1.0 / 9) < 1e-4);
  CHECK(close(at_origin(spot), 1.0 / 9) < 1e-3);
  CHECK(close(at_origin(lamp(SPPM_LIGHT_SUN)), 1) < 1e-5);
  CHECK(close(at_origin(wide_sun), 1) < 1e-3);
  CHECK(close(at_origin(disk), M_PI / 10) < 1e-3);  // pi R^2 / (R^2 + h^2)
}

TEST_CASE("direct light of a rectangle agrees with quadrature, and its back is dark") {
  Rig rig;
  rig.lights.add_lamp(lamp(SPPM_LIGHT_RECTANGLE));
  rig.commit();
  const Vec3 p{0.7f, -1.3f, 0.5f};
  double expected = 0;
  constexpr int n = 200;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      const Vec3 to = Vec3{2 * (static_cast<float>(i) + 0.5f) / n - 1, (static_cast<float>(j) + 0.5f) / n - 0.5f, 3} - p;
      expected += static_cast<double>(square(to.z) / square(length_squared(to))) * 2 / (n * n);
    }
  CHECK(close(irradiance(rig.lights, p, {0, 0, 1}), expected) < 1e-3);
  CHECK_FALSE(rig.lights.sample_direct({0, 0, 4}, number(1, 0)));
}

TEST_CASE("a point outside the cone of a spot is dark") {
  Rig rig;
  rig.lights.add_lamp(lamp(SPPM_LIGHT_SPOT));
  rig.commit();
  CHECK_FALSE(rig.lights.sample_direct({2.2f, 0, 0}, number(1, 0)));
  CHECK(rig.lights.sample_direct({2.0f, 0, 0}, number(1, 0)));
}

TEST_CASE("photons bring to a surface what direct light says") {
  for (const auto& d : all_lamps()) {
    CAPTURE(d.type);
    CAPTURE(d.radius);
    Rig rig;
    rig.lights.add_lamp(d);
    rig.commit(-0.5f);
    check_photons_bring_irradiance(rig.lights, -0.5f);
  }
}

TEST_CASE("what direct light finds is met by a ray in the same direction, with the same radiance and density") {
  Rig rig;
  for (auto d : all_lamps()) {
    d.transform[3] = static_cast<float>(d.type);  // side by side
    rig.lights.add_lamp(d);
  }
  rig.commit();
  const Vec3 p{0.2f, 0.1f, -0.3f};
  int samples = 0, missed = 0;
  for (uint64_t i = 0; i < 4000; ++i) {
    const auto s = rig.lights.sample_direct(p, number(i, 7));
    if (!s || s->delta) continue;
    ++samples;
    bool found = false;
    const auto visit = [&](const EmittedLight& e) {
      found |= close(static_cast<double>(e.pdf_solid_angle), static_cast<double>(s->pdf)) < 2e-3 &&
               close(static_cast<double>(e.radiance.x), static_cast<double>(s->radiance.x)) < 5e-3;
    };
    if (std::isfinite(s->distance))
      rig.lights.visit_lamps(p, s->wi, 0, s->distance * 1.001f, visit);
    else
      rig.lights.visit_infinite(p, s->wi, false, visit);
    missed += !found;
    if (std::isfinite(s->distance)) rig.lights.visit_lamps(p, s->wi, 0, s->distance * 0.1f, [&](const EmittedLight&) { CHECK(false); });
  }
  CHECK(samples > 1000);
  CHECK(missed <= samples / 200);  // rounding at the rims
}

TEST_CASE("a constant world gives pi L and photons that carry 4 pi^2 R^2 L") {
  Rig rig;
  rig.set_world(0.5f);
  rig.commit();
  CHECK(close(irradiance(rig.lights, {}, {0, 0, 1}), M_PI * 0.5) < 2e-3);
  CHECK(close(static_cast<double>(emitted_power(rig.lights).x), 4 * M_PI * M_PI * static_cast<double>(kRadius * kRadius) * 0.5) < 1e-3);
  check_photons_bring_irradiance(rig.lights, 0);
}

TEST_CASE("photons of an image world bring what direct light says, turned or not") {
  std::mt19937 random(9);
  std::uniform_real_distribution<float> uniform;
  std::vector<float> pixels(8 * 4 * 4);
  for (float& x : pixels) x = square(square(uniform(random)));
  for (const bool turned : {false, true}) {
    Rig rig;
    rig.set_world(1, rig.image(8, 4, pixels), turned);
    rig.commit();
    check_photons_bring_irradiance(rig.lights, 0);
  }
}

TEST_CASE("an image world shows +x in its middle, +y to the left of it and +z on top") {
  Rig rig;
  std::vector<float> pixels(64 * 32 * 4, 0.0f);
  const auto paint = [&](uint64_t x, uint64_t y, size_t channel) {
    for (uint64_t dy = 0; dy < 2; ++dy)
      for (uint64_t dx = 0; dx < 2; ++dx) pixels[((y + dy) * 64 + x + dx) * 4 + channel] = 1;
  };
  paint(31, 15, 0), paint(15, 15, 1);
  for (uint64_t x = 0; x < 64; x += 2) paint(x, 30, 2);
  rig.set_world(1, rig.image(64, 32, pixels));
  rig.commit();
  Vec3 seen[3];
  const Vec3 axes[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  for (int a = 0; a < 3; ++a) rig.lights.visit_infinite({}, axes[a], true, [&](const EmittedLight& e) { seen[a] = e.radiance; });
  CHECK(seen[0].x == doctest::Approx(1));
  CHECK(seen[1].y == doctest::Approx(1));
  CHECK(seen[2].z == doctest::Approx(1));
}

TEST_CASE("emissive triangles shine to both sides in proportion to area and emission") {
  Rig rig;
  const uint32_t glow = rig.glow(2);
  const EmissiveTriangle a = rig.triangle({-1, -1, 2}, {1, -1, 2}, {1, 1, 2}, glow),
                         b = rig.triangle({-1, -1, 2}, {1, 1, 2}, {-1, 1, 2}, glow);
  rig.lights.add_triangles({a, b});
  rig.commit();
  CHECK(close(static_cast<double>(emitted_power(rig.lights).x), 2 * M_PI * 4 * 2) < 1e-3);
  // A square seen from above its centre: E = 4 L x / sqrt(1 + x^2) atan(x / sqrt(1 + x^2)) ... with x = side / (2 h), both sides alike.
  const double x = 0.5, r = std::sqrt(1 + x * x), expected = 2 * 4 * x / r * std::atan(x / r);
  CHECK(close(irradiance(rig.lights, {}, {0, 0, 1}), expected) < 2e-3);
  CHECK(close(irradiance(rig.lights, {0, 0, 4}, {0, 0, -1}), expected) < 2e-3);
  CHECK(static_cast<double>(rig.lights.triangle_pdf_area(0, 1, {})) == doctest::Approx(0.25));
  check_photons_bring_irradiance(rig.lights, 0);
}

TEST_CASE("photons of an emitter under a coat carry what is seen of it from everywhere") {
  // The mean that the coat leaves of the light to a side, by Fresnel's formula: 2 integral of (1 - F) cos d cos.
  double left = 0;
  constexpr int n = 1000;
  for (int i = 0; i < n; ++i) {
    const double cosine = (i + 0.5) / n;
    left += 2 * (1 - static_cast<double>(fresnel_dielectric(static_cast<float>(cosine), 1.5f))) * cosine / n;
  }
  Rig rig;
  const uint32_t glow = rig.coated_glow(2);
  const EmissiveTriangle a = rig.triangle({-1, -1, 2}, {1, -1, 2}, {1, 1, 2}, glow);
  rig.lights.add_triangles({a, rig.triangle(a.p[0], a.p[2], {-1, 1, 2}, glow)});
  rig.commit(1.4f);
  const double power = 2 * M_PI * 4 * 2 * left;
  CHECK(close(static_cast<double>(emitted_power(rig.lights).x), power) < 2e-3);  // the coat's table is linear in between its cosines
  CHECK(close(rig.lights.power(), power) < 2e-3);
  check_photons_bring_irradiance(rig.lights, 1.4f);  // mostly at grazing angles
}

TEST_CASE("photons and direct light agree on a coat that is smooth between bent corners") {
  Rig rig;
  EmissiveTriangle a = rig.triangle({-1, -1, 2}, {1, -1, 2}, {1, 1, 2.5f}, rig.coated_glow(2));
  a.normals = {Vec3{-0.8f, -0.3f, 0.5f}, Vec3{1, -1, 0.2f}, Vec3{0.5f, 2, 0.7f}};
  rig.lights.add_triangles({a});
  rig.commit(1.4f);
  check_photons_bring_irradiance(rig.lights, 1.4f);
}

TEST_CASE("a lamp that scattered rays do not meet leaves all of its light to direct light") {
  for (const uint32_t flag : {SPPM_LIGHT_HIDDEN_FROM_SPECULAR, SPPM_LIGHT_NO_SHADOW})
    for (auto d : all_lamps()) {
      d.flags = flag;
      Rig rig;
      rig.lights.add_lamp(d);
      rig.commit();
      const auto s = rig.lights.sample_direct({}, number(3, 1));
      REQUIRE(s);
      CHECK(s->delta);
      // Without a shadow a mirror shows it still, but a rough surface must not count it twice.
      const auto visit = [&](const EmittedLight& e) {
        CHECK(flag == SPPM_LIGHT_NO_SHADOW);
        CHECK(mis_weight(1, e.pdf_solid_angle) == 0);
      };
      rig.lights.visit_lamps({}, s->wi, 0, kInfinity, visit);
      rig.lights.visit_infinite({}, s->wi, false, visit);
    }
}

TEST_CASE("no lights, no power, no photons") {
  Rig rig;
  SppmLightDesc dark = lamp(SPPM_LIGHT_POINT);
  dark.emission[0] = dark.emission[1] = dark.emission[2] = 0;
  rig.lights.add_lamp(dark);
  rig.commit();
  CHECK(rig.lights.none());
  CHECK_FALSE(rig.lights.emit(number(0, 0), number(0, 1)));
  CHECK_FALSE(rig.lights.can_aim());
  CHECK_FALSE(rig.lights.emit_aimed(number(0, 0), number(0, 1)));
  CHECK_FALSE(rig.lights.sample_direct({}, number(0, 0)));
}
