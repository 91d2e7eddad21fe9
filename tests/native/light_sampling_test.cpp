// Samples of lights, for direct light and for photons, against the densities that they should have.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <vector>

#include "chi_square.h"
#include "color.h"
#include "light.h"
#include "light_rig.h"

using namespace sppm;

namespace {

constexpr int kSamples = 1 << 15;

class Numbers {
 public:
  Sample4 next() { return {{uniform_(random_), uniform_(random_), uniform_(random_), uniform_(random_)}}; }

 private:
  std::mt19937 random_{17};
  std::uniform_real_distribution<float> uniform_;
};

using Density = std::function<float(Vec3)>;

// Directions from p toward a light that is within the cells, against what rays in these directions are told.
void check_directions(const Lights& lights, Vec3 p, const DirectionCells& cells, const Density& density, int steps = 24) {
  Numbers numbers;
  std::vector<int> counts(cells.size() + 1, 0);
  int delta = 0;
  for (int i = 0; i < kSamples; ++i) {
    const auto s = lights.sample_direct(p, numbers.next());
    if (!s) continue;
    if (s->delta)
      ++delta;
    else
      ++counts[cells.find(s->wi)];
  }
  ChiSquare test;
  for (size_t c = 0; c < cells.size(); ++c) test.add(kSamples * cells.integral(c, density, steps), counts[c]);
  CHECK(counts[cells.size()] == 0);
  CHECK(test.cells() > 8);
  CHECK(test.sigmas() < kMostSigmas);
}

// What the lights say of rays from p: the density of their directions. Dark directions are never given.
Density density_of_rays(const Lights& lights, Vec3 p) {
  return [&lights, p](Vec3 d) {
    float sum = 0;
    const auto add = [&](const EmittedLight& e) { sum += is_black(e.radiance) ? 0 : e.pdf_solid_angle; };
    lights.visit_lamps(p, d, 0, kInfinity, add);
    lights.visit_infinite(p, d, false, add);
    return sum;
  };
}

DirectionCells cone(Vec3 axis, float half_angle, int rows = 8, int columns = 16) {
  return {Frame(normalize(axis)), 1 - std::cos(half_angle), rows, columns};
}

// Distance along d to the triangle, infinite if missed (Moeller and Trumbore).
float distance_to(const EmissiveTriangle& t, Vec3 p, Vec3 d) {
  const Vec3 e1 = t.p[1] - t.p[0], e2 = t.p[2] - t.p[0], q = cross(d, e2), s = p - t.p[0], r = cross(s, e1);
  const float inverse = 1 / dot(e1, q), u = dot(s, q) * inverse, v = dot(d, r) * inverse, far = dot(e2, r) * inverse;
  return u >= 0 && v >= 0 && u + v <= 1 && far > 0 ? far : kInfinity;
}

// Flux of photons by position and direction. `place` tells where in the unit square a start lies, `intensity` the flux per solid angle
// of all positions together [W/sr], which share it equally.
void check_flux(const Lights& lights, const DirectionCells& cells, const Density& intensity,
                const std::function<Vec2(const PhotonStart&)>& place, int steps = 24) {
  constexpr int side = 3, n = 2 * kSamples;
  struct Sum {
    double weight = 0, square = 0;
  };
  Numbers numbers;
  std::vector<Sum> sums(cells.size() * side * side);
  int strays = 0;
  for (int i = 0; i < n; ++i) {
    const Sample4 u = numbers.next(), v = numbers.next();
    const auto start = lights.emit(u, v);
    if (!start) continue;
    const size_t direction = cells.find(start->direction);
    if (direction == cells.size()) {
      ++strays;
      continue;
    }
    Sum& sum = sums[direction * side * side + square_cell(place(*start), side)];
    const double w = static_cast<double>(start->weight.x);
    sum.weight += w, sum.square += w * w;
  }
  double flux = 0;
  std::vector<double> expected;
  for (size_t c = 0; c < cells.size(); ++c) flux += expected.emplace_back(cells.integral(c, intensity, steps));
  ChiSquare test;
  for (size_t i = 0; i < sums.size(); ++i) {
    const double e = expected[i / (side * side)] / (side * side) * n;
    test.add(sums[i].weight - e, sums[i].square - sums[i].weight * sums[i].weight / n, e / flux);
  }
  CHECK(strays == 0);
  CHECK(test.cells() > 20);
  CHECK(test.sigmas() < kMostSigmas);
}

// In the disk across the photon's way through `center`, in units of its radius.
std::function<Vec2(const PhotonStart&)> across(Vec3 center, float radius) {
  return [=](const PhotonStart& s) {
    const Vec3 local = Frame(s.direction).to_local(s.origin - center);
    return disk_to_square(local.x / radius, local.y / radius);
  };
}

// One pixel of 1e6 in a dim map.
std::vector<float> map_with_a_sun(uint64_t width, uint64_t height) {
  std::vector<float> pixels(width * height * 4, 0.1f);
  for (size_t c = 0; c < 3; ++c) pixels[(height * 3 / 4 * width + width / 3) * 4 + c] = 1e6f;
  return pixels;
}

// Cells about the middle of that pixel, u = 1/2 - phi / (2 pi) and v = 1/2 + theta / pi, as far as anything varies: two texels.
DirectionCells around_its_sun(uint64_t width, uint64_t height) {
  const float u = (static_cast<float>(width / 3) + 0.5f) / static_cast<float>(width), phi = (0.5f - u) * 2 * kPi;
  const float theta = ((static_cast<float>(height * 3 / 4) + 0.5f) / static_cast<float>(height) - 0.5f) * kPi;
  const Vec3 toward{std::cos(theta) * std::cos(phi), std::cos(theta) * std::sin(phi), std::sin(theta)};
  return cone(toward, 2.5f * kPi / static_cast<float>(height), 6, 12);
}
constexpr int kFineSteps = 64;  // for integrals over these cells

Density radiance_of_world(const Lights& lights) {
  return [&lights](Vec3 d) {
    float seen = 0;
    lights.visit_infinite({}, d, false, [&](const EmittedLight& e) { seen = luminance(e.radiance); });
    return seen;
  };
}

}  // namespace

TEST_CASE("direct light toward lamps follows its density, near and far") {
  for (const SppmLightDesc& d : sized_lamps())
    for (const Vec3 p : {Vec3{0.2f, 0.1f, -0.3f}, Vec3{0.3f, -0.2f, 2.4f}}) {
      CAPTURE(d.type);
      CAPTURE(p.z);
      Rig rig;
      rig.lights.add_lamp(d);
      rig.commit();
      const bool sun = d.type == SPPM_LIGHT_SUN;
      const float widest = sun ? d.angle / 2 : p.z > 0 ? 1.45f : 0.5f;  // above the lamp's horizon
      check_directions(rig.lights, p, cone(sun ? Vec3{0, 0, 1} : Vec3{0, 0, 3} - p, widest, 10), density_of_rays(rig.lights, p));
    }
}

TEST_CASE("direct light toward glowing triangles follows its density") {
  Rig rig;
  const EmissiveTriangle a = rig.triangle({-1, -1, 2}, {1, -1, 2}, {1, 1, 2.5f}, rig.glow(2));
  const EmissiveTriangle b = rig.triangle({-1, -1, 2}, {0, 2, 1}, {-1, 1, 3}, rig.glow(7));
  rig.lights.add_triangles({a, b});
  rig.commit();
  const Vec3 p{0.1f, 0.2f, 0.4f};
  const Density density = [&](Vec3 d) {
    float sum = 0;
    uint32_t i = 0;
    for (const EmissiveTriangle& t : {a, b}) {
      const float far = distance_to(t, p, d), cosine = std::abs(dot(d, normalize(cross(t.p[1] - t.p[0], t.p[2] - t.p[0]))));
      if (std::isfinite(far)) sum += rig.lights.triangle_pdf_area(0, i, p) * square(far) / cosine;
      ++i;
    }
    return sum;
  };
  check_directions(rig.lights, p, cone({0, 0, 1}, 1.5f, 16, 24), density, 32);
}

TEST_CASE("direct light toward several lights at once follows the sum of their densities") {
  Rig rig;
  float x = -2;
  for (SppmLightDesc d : sized_lamps()) {
    d.transform[3] = x += 0.8f;
    rig.lights.add_lamp(d);
  }
  rig.lights.add_lamp(lamp(SPPM_LIGHT_POINT));  // without size: takes its share of the choices
  rig.set_world(0.2f);
  rig.commit();
  check_directions(rig.lights, {}, {}, density_of_rays(rig.lights, {}), 64);
}

TEST_CASE("directions of worlds follow their density: constant and of an image") {
  std::mt19937 random(9);
  std::uniform_real_distribution<float> uniform;
  std::vector<float> few(8 * 4 * 4);
  for (float& x : few) x = square(square(uniform(random)));
  for (const bool image : {false, true})
    for (const bool turned : {false, true}) {
      Rig rig;
      rig.set_world(1, image ? rig.image(8, 4, few) : 0, turned);
      rig.commit();
      check_directions(rig.lights, {}, {}, density_of_rays(rig.lights, {}));
    }
}

TEST_CASE("a very bright pixel is sampled as it shines") {
  for (const uint64_t width : {64u, 1536u}) {  // below and above the resolution of the sampling table
    CAPTURE(width);
    const uint64_t height = width / 2;
    Rig rig;
    rig.set_world(1, rig.image(width, height, map_with_a_sun(width, height)));
    rig.commit();
    const DirectionCells cells = around_its_sun(width, height);
    const Density density = density_of_rays(rig.lights, {});
    Numbers numbers;
    std::vector<int> counts(cells.size() + 1, 0);
    double sum = 0, squares = 0;
    for (int i = 0; i < kSamples; ++i) {
      const auto s = rig.lights.sample_direct({}, numbers.next());
      if (!s) continue;
      ++counts[cells.find(s->wi)];
      const double value = static_cast<double>(s->radiance.x / s->pdf);
      sum += value, squares += value * value;
    }
    ChiSquare test;
    double inside = 0, radiance = 0;
    for (size_t c = 0; c < cells.size(); ++c) {
      const double share = cells.integral(c, density, kFineSteps);
      inside += share;
      test.add(kSamples * share, counts[c]);
      radiance += cells.integral(c, radiance_of_world(rig.lights), kFineSteps);
    }
    test.add(kSamples * (1 - inside), counts[cells.size()]);
    CHECK(test.sigmas() < kMostSigmas);
    const double mean = sum / kSamples, deviation = std::sqrt(squares / kSamples - mean * mean);
    CHECK(mean == doctest::Approx(radiance + 0.1 * 4 * M_PI).epsilon(5 * deviation / mean / std::sqrt(kSamples) + 5e-3));
    CHECK(deviation < 2 * mean);  // what is sampled by a table of texels cannot follow the slopes within them
  }
}

TEST_CASE("photons of a lamp leave it as its light does: from everywhere, in all its directions") {
  for (const SppmLightDesc& d : sized_lamps()) {
    CAPTURE(d.type);
    CAPTURE(d.radius);
    Rig rig;
    rig.lights.add_lamp(d);
    rig.commit();
    const Vec3 at{0, 0, 3};
    const float half = d.angle / 2, h = 1 - std::cos(half);
    switch (d.type) {
      case SPPM_LIGHT_POINT: check_flux(rig.lights, {}, [](Vec3) { return 1.0f; }, across(at, d.radius)); break;
      case SPPM_LIGHT_SPOT:
        check_flux(rig.lights, cone({0, 0, -1}, half), [&](Vec3 w) {
          const float t = std::clamp((-w.z - std::cos(half)) / (h * d.blend), 0.0f, 1.0f);
          return t * t * (3 - 2 * t);
        }, across(at, d.radius));
        break;
      case SPPM_LIGHT_SUN:
        check_flux(rig.lights, cone({0, 0, -1}, half), [&](Vec3) { return square(kRadius) / square(std::sin(half)); }, across({}, kRadius));
        break;
      default: {
        const bool ellipse = d.type == SPPM_LIGHT_ELLIPSE;
        const float area = d.size_x * d.size_y * (ellipse ? kPi / 4 : 1);
        check_flux(rig.lights, cone({0, 0, -1}, kPi / 2), [&](Vec3 w) { return area * -w.z; }, [&](const PhotonStart& s) {
          const float x = 2 * s.origin.x / d.size_x, y = 2 * s.origin.y / d.size_y;
          return ellipse ? disk_to_square(x, y) : Vec2{(x + 1) / 2, (y + 1) / 2};
        });
      }
    }
  }
}

TEST_CASE("photons of worlds come from where they are bright, everywhere across the scene") {
  for (const bool image : {false, true}) {
    Rig rig;
    std::mt19937 random(9);
    std::vector<float> few(8 * 4 * 4);
    for (size_t i = 0; i < few.size(); i += 4) few[i] = few[i + 1] = few[i + 2] = std::uniform_real_distribution<float>(0.1f, 1)(random);
    rig.set_world(1, image ? rig.image(8, 4, few) : 0);
    rig.commit();
    const Density radiance = radiance_of_world(rig.lights);  // of one value for all channels
    check_flux(rig.lights, {Frame({0, 0, 1}), 2, 8, 16}, [&](Vec3 w) {
      return radiance(-w) * kPi * square(kRadius);
    }, across({}, kRadius));
  }
}

TEST_CASE("photons of a glowing triangle leave it from everywhere, to both sides by the cosine") {
  Rig rig;
  const EmissiveTriangle t = rig.triangle({-1, -1, 2}, {1, -1, 2}, {1, 1, 2.5f}, rig.glow(2));
  rig.lights.add_triangles({t});
  rig.commit();
  const Vec3 e1 = t.p[1] - t.p[0], e2 = t.p[2] - t.p[0], n = cross(e1, e2), up = normalize(n);
  check_flux(rig.lights, {Frame(up), 2, 8, 12}, [&](Vec3 w) { return 2 * length(n) / 2 * std::abs(dot(w, up)); },
             [&](const PhotonStart& s) {
               const Vec3 q = s.origin - t.p[0];
               return triangle_to_square({dot(cross(q, e2), n) / length_squared(n), dot(cross(e1, q), n) / length_squared(n)});
             });
}

TEST_CASE("photons carry the power that is told, of suns with an angle, worlds of an image and textured emitters alike") {
  const auto check = [](const Lights& lights, double power, double tolerance_of_told = 1e-3) {
    Numbers numbers;
    double sum = 0;
    for (int i = 0; i < kSamples; ++i) {
      const Sample4 u = numbers.next(), v = numbers.next();
      if (const auto start = lights.emit(u, v)) sum += static_cast<double>(luminance(start->weight));
    }
    CHECK(sum / kSamples == doctest::Approx(power).epsilon(0.01).scale(0));  // noise of the textured emitter
    CHECK(lights.power() == doctest::Approx(power).epsilon(tolerance_of_told).scale(0));
  };
  const double disk = M_PI * static_cast<double>(square(kRadius));
  for (const float angle : {0.01f, 0.5f, 3.0f}) {
    CAPTURE(angle);
    Rig rig;
    SppmLightDesc sun = lamp(SPPM_LIGHT_SUN);
    sun.angle = angle;
    rig.lights.add_lamp(sun);
    rig.commit();
    // Radiance E / (pi sin^2 h) from a cone of 2 pi (1 - cos h), through the disk.
    const double c = std::cos(static_cast<double>(angle) / 2);
    check(rig.lights, static_cast<double>(luminance({1, 2, 4})) * 2 / (1 + c) * disk);
  }
  {
    Rig rig;
    rig.set_world(1, rig.image(64, 32, map_with_a_sun(64, 32)));
    rig.commit();
    const DirectionCells bright = around_its_sun(64, 32);
    double integral = 0.1 * 2 * M_PI * (2 - static_cast<double>(bright.one_minus_cos));
    for (size_t c = 0; c < bright.size(); ++c) integral += bright.integral(c, radiance_of_world(rig.lights), kFineSteps);
    check(rig.lights, integral * disk, 0.01);  // the sampling table knows a texel's mean, not how it slopes
  }
  {
    Rig rig;
    std::vector<float> checker(8 * 8 * 4, 1.0f);  // a chessboard of 5 and 0, once over a square of 1 m^2
    for (size_t i = 0; i < 64; ++i)
      for (size_t c = 0; c < 3; ++c) checker[4 * i + c] = (i / 8 + i) % 2 ? 5 : 0;
    const uint32_t glow = rig.glow(1, rig.image_texture(rig.image(8, 8, checker)));
    EmissiveTriangle a = rig.triangle({0, 0, 0}, {1, 0, 0}, {1, 1, 0}, glow), b = rig.triangle({0, 0, 0}, {1, 1, 0}, {0, 1, 0}, glow);
    a.attributes[1].uv = {1, 0}, a.attributes[2].uv = {1, 1}, b.attributes[1].uv = {1, 1}, b.attributes[2].uv = {0, 1};
    rig.lights.add_triangles({a, b});
    rig.commit();
    check(rig.lights, 2 * M_PI * 2.5, 0.02);  // a hundredth is added so that no part of a texture is overlooked
  }
}
