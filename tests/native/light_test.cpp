#include "light.h"

#include <doctest/doctest.h>

#include <functional>
#include <random>

#include "color.h"

using namespace sppm;

namespace {

// The square metre that photons are caught on, in tiles, and something beside it.
Targets make_targets(float z) {
  std::vector<Caster> casters;
  for (int i = 0; i < 16; ++i) {
    const float x = static_cast<float>(i / 4) / 4, y = static_cast<float>(i % 4) / 4 - 0.5f;
    Caster tile{{}, 0.3f + 0.7f * static_cast<float>(i % 3)};
    tile.bounds.add(Vec3{x, y, z}), tile.bounds.add(Vec3{x + 0.25f, y + 0.25f, z});
    casters.push_back(tile);
  }
  Caster other{{}, 1};
  other.bounds.add(Vec3{-1, -0.2f, -0.7f}), other.bounds.add(Vec3{-0.6f, 0.2f, -0.3f});
  casters.push_back(other);
  Targets targets;
  targets.build(casters);
  return targets;
}

// Lights of a scene whose bounding sphere has radius 2 around the origin.
struct Rig {
  Textures textures;
  Materials materials{&textures};
  Lights lights{&textures, &materials};

  void commit(float z = 0) {
    const float e = 2 / std::sqrt(3.0f);
    lights.commit({splat(-e), splat(e)}, make_targets(z));
  }
};

constexpr double kRadius = 2 * 1.001;  // the library's margin included

SppmLightDesc lamp(SppmLightType type) {  // 3 m above the origin, shining down
  SppmLightDesc d{};
  d.struct_size = sizeof d;
  d.type = type;
  d.transform[0] = d.transform[5] = d.transform[10] = 1, d.transform[11] = 3;
  d.emission[0] = 1, d.emission[1] = 2, d.emission[2] = 4;
  d.size_x = 2, d.size_y = 1;
  d.angle = type == SPPM_LIGHT_SPOT ? 1.2f : 0;
  return d;
}

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

std::vector<SppmLightDesc> all_lamps() {
  std::vector<SppmLightDesc> lamps;
  for (const SppmLightType type : {SPPM_LIGHT_POINT, SPPM_LIGHT_SPOT, SPPM_LIGHT_RECTANGLE, SPPM_LIGHT_ELLIPSE, SPPM_LIGHT_SUN}) {
    lamps.push_back(lamp(type));
    SppmLightDesc sized = lamp(type);
    if (type == SPPM_LIGHT_SUN)
      sized.angle = 0.3f;
    else if (type == SPPM_LIGHT_POINT || type == SPPM_LIGHT_SPOT)
      sized.radius = 0.4f, sized.blend = 0.5f;
    else
      continue;
    lamps.push_back(sized);
  }
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
                          {lamp(SPPM_LIGHT_SUN), M_PI * kRadius * kRadius},
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
  SppmLightDesc sphere = lamp(SPPM_LIGHT_POINT), spot = lamp(SPPM_LIGHT_SPOT), wide_sun = lamp(SPPM_LIGHT_SUN), disk = lamp(SPPM_LIGHT_ELLIPSE);
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
  SppmWorldDesc world{};
  world.struct_size = sizeof world;
  world.radiance[0] = world.radiance[1] = world.radiance[2] = 0.5f;
  rig.lights.set_world(world);
  rig.commit();
  CHECK(close(irradiance(rig.lights, {}, {0, 0, 1}), M_PI * 0.5) < 2e-3);
  CHECK(close(static_cast<double>(emitted_power(rig.lights).x), 4 * M_PI * M_PI * kRadius * kRadius * 0.5) < 1e-3);
  check_photons_bring_irradiance(rig.lights, 0);
}

TEST_CASE("directions of an image world follow its density, turned or not") {
  constexpr uint64_t width = 8, height = 4;
  std::mt19937 random(9);
  std::uniform_real_distribution<float> uniform;
  std::vector<float> pixels(width * height * 4);
  for (float& x : pixels) x = square(square(uniform(random)));
  for (const bool turned : {false, true}) {
    Rig rig;
    SppmImageDesc image{};
    image.struct_size = sizeof image;
    image.width = width, image.height = height, image.pixels = pixels.data();
    SppmWorldDesc world{};
    world.struct_size = sizeof world;
    world.radiance[0] = world.radiance[1] = world.radiance[2] = 1;
    world.image = rig.textures.add_image(image);
    const float rotation[9] = {0.6f, 0.8f, 0, -0.8f, 0.6f, 0, 0, 0, 1};
    if (turned) std::copy(rotation, rotation + 9, world.rotation);
    rig.lights.set_world(world);
    rig.commit();
    constexpr int rows = 12, columns = 24, n = 1 << 15;
    std::vector<int> counts(rows * columns, 0);
    double by_samples = 0, by_quadrature = 0;
    for (uint64_t i = 0; i < n; ++i) {
      const Sample4 u{{uniform(random), uniform(random), uniform(random), 0}};
      const auto s = rig.lights.sample_direct({}, u);
      if (!s) continue;
      rig.lights.visit_infinite({}, s->wi, false, [&](const EmittedLight& e) {
        if (i % 64 == 0) CHECK(close(static_cast<double>(e.pdf_solid_angle), static_cast<double>(s->pdf)) < 1e-3);
      });
      by_samples += static_cast<double>(s->radiance.x / s->pdf) / n;
      const int row = std::clamp(static_cast<int>((s->wi.z + 1) / 2 * rows), 0, rows - 1);
      const int column = std::clamp(static_cast<int>((std::atan2(s->wi.y, s->wi.x) / (2 * kPi) + 0.5f) * columns), 0, columns - 1);
      ++counts[static_cast<size_t>(row * columns + column)];
    }
    double chi2 = 0;
    int cells = 0;
    for (int row = 0; row < rows; ++row)
      for (int column = 0; column < columns; ++column) {
        double expected = 0;
        constexpr int steps = 48;
        for (int k = 0; k < steps * steps; ++k) {
          const float z = 2 * (static_cast<float>(row) + (static_cast<float>(k / steps) + 0.5f) / steps) / rows - 1;
          const float phi = 2 * kPi * ((static_cast<float>(column) + (static_cast<float>(k % steps) + 0.5f) / steps) / columns - 0.5f);
          const float r = std::sqrt(1 - z * z);
          rig.lights.visit_infinite({}, {r * std::cos(phi), r * std::sin(phi), z}, false, [&](const EmittedLight& e) {
            const double solid = 4 * M_PI / (rows * columns * steps * steps);
            expected += n * solid * static_cast<double>(e.pdf_solid_angle);
            by_quadrature += solid * static_cast<double>(e.radiance.x);
          });
        }
        if (expected < 5) continue;
        chi2 += square(static_cast<float>(counts[static_cast<size_t>(row * columns + column)] - expected)) / expected;
        ++cells;
      }
    CHECK(chi2 < cells + 5 * std::sqrt(2.0 * cells));
    CHECK(close(by_samples, by_quadrature) < 0.02);
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
  SppmImageDesc image{};
  image.struct_size = sizeof image;
  image.width = 64, image.height = 32, image.pixels = pixels.data();
  SppmWorldDesc world{};
  world.radiance[0] = world.radiance[1] = world.radiance[2] = 1;
  world.image = rig.textures.add_image(image);
  rig.lights.set_world(world);
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
  SppmClosureDesc glow{};
  glow.struct_size = sizeof glow;
  glow.type = SPPM_EMISSION;
  for (int c = 0; c < 3; ++c) glow.weight.value[c] = 1, glow.color.value[c] = 2;
  SppmMaterialDesc material{};
  material.struct_size = sizeof material;
  material.closure_count = 1, material.closures = &glow;
  const uint32_t id = rig.materials.add(material);
  EmissiveTriangle a, b;
  a.p = {Vec3{-1, -1, 2}, Vec3{1, -1, 2}, Vec3{1, 1, 2}}, b.p = {Vec3{-1, -1, 2}, Vec3{1, 1, 2}, Vec3{-1, 1, 2}};
  a.material = b.material = id;
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
