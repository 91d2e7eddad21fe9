#include "bsdf.h"

#include <doctest/doctest.h>

#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "chi_square.h"
#include "sampling.h"

using namespace sppm;

namespace {

const ShadingPoint kAt{{0, 0, 1}, Frame({0, 0, 1})};

Lobe make_lobe(LobeType type, float roughness, float ior = 1.5f) {
  Lobe lobe;
  lobe.type = type;
  lobe.color = lobe.color2 = {1, 1, 1};
  lobe.roughness = roughness;
  lobe.alpha = lobe.diffuse() ? 0 : roughness * roughness;
  lobe.ior = ior;
  return lobe;
}

std::string name(LobeType type) {
  const char* names[] = {"diffuse", "retro", "dielectric", "refraction", "conductor", "coat"};
  return names[static_cast<int>(type)];
}

std::vector<Lobe> rough_lobes() {
  std::vector<Lobe> lobes;
  for (const float roughness : {0.1f, 0.3f, 0.6f, 1.0f}) {
    for (const LobeType type : {LobeType::kDiffuse, LobeType::kRetroDiffuse, LobeType::kConductor, LobeType::kCoat})
      lobes.push_back(make_lobe(type, roughness));
    for (const LobeType type : {LobeType::kDielectric, LobeType::kRefraction})
      for (const float ior : {1.5f, 1 / 1.5f}) lobes.push_back(make_lobe(type, roughness, ior));
    for (const LobeType type : {LobeType::kConductor, LobeType::kDielectric}) {
      lobes.push_back(make_lobe(type, roughness));
      lobes.back().separable = true;
    }
    lobes.push_back(make_lobe(LobeType::kCoat, roughness));
    lobes.back().clearcoat = true;
  }
  return lobes;
}

Vec3 direction(float cos_theta, float phi = 0.4f) {
  const float s = safe_sqrt(1 - cos_theta * cos_theta);
  return {s * std::cos(phi), s * std::sin(phi), cos_theta};
}

struct Fit {
  double integral = 0, succeeded = 0;
  ChiSquare test;
};

// Compares where samples fall with the integral of the density over each cell. No light goes where the normals disagree on the side.
Fit fit(const Lobe& lobe, const ShadingPoint& at, Vec3 given, Transport transport, int n) {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> uniform;
  const DirectionCells cells{Frame({0, 0, 1}), 2, 24, 32};
  std::vector<int> counts(cells.size(), 0);
  Fit result;
  for (int i = 0; i < n; ++i) {
    const auto s = sample(lobe, at, given, {uniform(random), uniform(random), uniform(random)}, transport);
    if (!s) continue;
    ++result.succeeded;
    ++counts[cells.find(s->direction)];
  }
  result.succeeded /= n;
  const auto density = [&](Vec3 w) { return dot(w, at.ng) * dot(w, at.frame.n) > 0 ? pdf_solid_angle(lobe, at, given, w) : 0.0f; };
  for (size_t c = 0; c < cells.size(); ++c) {
    const bool wide = lobe.alpha > 0.3f || lobe.diffuse();
    const int steps = wide ? 12 : lobe.alpha < 0.05f && counts[c] > n / 500 ? 400 : counts[c] > n / 1000 ? 64 : 16;
    const double probability = cells.integral(c, density, steps);
    result.integral += probability;
    result.test.add(probability * n, counts[c]);
  }
  return result;
}

// Share of the flux that leaves, by sampling: 1 where nothing is absorbed. Radiance is taken back from the index of either side.
double albedo(const Lobe& lobe, Vec3 given, Transport transport, int n = 1 << 14) {
  double sum = 0;
  for (int i = 0; i < n; ++i) {
    const Sample4 u = Sampler(11, static_cast<uint64_t>(i)).next();
    const auto s = sample(lobe, kAt, given, {u[0], u[1], u[2]}, transport);
    if (!s) continue;
    const bool through = s->direction.z * given.z < 0;
    const float eta = given.z > 0 ? lobe.ior : 1 / lobe.ior;
    sum += static_cast<double>(s->weight.x * (through && transport == Transport::kRadiance ? eta * eta : 1.0f));
  }
  return sum / n;
}

// Fresnel's equations as written in textbooks, by angles.
double textbook_fresnel(double cos_i, double eta) {
  const double sin_t = std::sqrt(1 - cos_i * cos_i) / eta;
  if (sin_t >= 1) return 1;
  const double cos_t = std::sqrt(1 - sin_t * sin_t);
  const double s = (cos_i - eta * cos_t) / (cos_i + eta * cos_t), p = (eta * cos_i - cos_t) / (eta * cos_i + cos_t);
  return 0.5 * (s * s + p * p);
}

}  // namespace

TEST_CASE("directions are drawn with the density that is claimed") {
  constexpr int n = 30000;
  const ShadingPoint bent{{0, 0, 1}, Frame(normalize({0.3f, -0.1f, 1}))};
  const auto check = [](const Lobe& lobe, const ShadingPoint& at, float cos_given, Transport transport) {
    INFO(name(lobe.type));
    CAPTURE(lobe.roughness);
    CAPTURE(lobe.ior);
    CAPTURE(cos_given);
    const Fit f = fit(lobe, at, direction(cos_given), transport, n);
    CHECK(f.integral == doctest::Approx(f.succeeded).epsilon(0.015));
    CHECK(f.test.sigmas() < kMostSigmas);
  };
  for (const Lobe& lobe : rough_lobes()) {
    for (const float cos_given : {0.85f, 0.3f, -0.7f}) check(lobe, kAt, cos_given, Transport::kRadiance);
    check(lobe, bent, 0.7f, Transport::kPhoton);
  }
}

TEST_CASE("weights are f |cos| / pdf, for camera paths and for photons") {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> uniform;
  for (const Lobe& lobe : rough_lobes())
    for (const float cos_given : {0.9f, 0.2f, -0.5f})
      for (int i = 0; i < 40; ++i) {
        const Vec3 given = direction(cos_given);
        const std::array<float, 3> u{uniform(random), uniform(random), uniform(random)};
        for (const Transport t : {Transport::kRadiance, Transport::kPhoton}) {
          const auto s = sample(lobe, kAt, given, u, t);
          if (!s) continue;
          CHECK(static_cast<double>(length(s->direction)) == doctest::Approx(1).epsilon(1e-5));
          const float pdf = pdf_solid_angle(lobe, kAt, given, s->direction);
          const Vec3 f = t == Transport::kPhoton ? evaluate(lobe, kAt, s->direction, given) : evaluate(lobe, kAt, given, s->direction);
          // A narrow lobe turns the rounding of the direction into a relative error of its density.
          const double tolerance = lobe.roughness < 0.2f ? 0.05 : 5e-3;
          CHECK(static_cast<double>(s->pdf_solid_angle) == doctest::Approx(static_cast<double>(pdf)).epsilon(tolerance));
          CHECK(static_cast<double>(s->weight.x) ==
                doctest::Approx(static_cast<double>(f.x * std::abs(s->direction.z) / pdf)).epsilon(tolerance));
        }
      }
}

TEST_CASE("lobes are reciprocal, transmission after division by the squared index") {
  std::mt19937 random(5);
  std::uniform_real_distribution<float> uniform(-1, 1);
  for (const Lobe& lobe : rough_lobes()) {
    if (lobe.separable && lobe.type == LobeType::kDielectric) continue;  // its Fresnel factor is the camera side's
    if (lobe.clearcoat) continue;                                       // masked otherwise on the light's side
    for (int i = 0; i < 200; ++i) {
      const Vec3 a = direction(uniform(random), uniform(random) * kPi), b = direction(uniform(random), uniform(random) * kPi);
      if (std::abs(a.z) < 0.05f || std::abs(b.z) < 0.05f) continue;
      const auto index2 = [&](Vec3 w) { return w.z > 0 ? 1.0f : lobe.ior * lobe.ior; };
      const double ab = static_cast<double>(evaluate(lobe, kAt, a, b).x / index2(a));
      const double ba = static_cast<double>(evaluate(lobe, kAt, b, a).x / index2(b));
      INFO(name(lobe.type));
      CAPTURE(lobe.roughness);
      CHECK(ab == doctest::Approx(ba).epsilon(5e-3).scale(1e-3 + std::abs(ba)));
    }
  }
}

TEST_CASE("no lobe gives back more than it gets") {
  for (const Lobe& lobe : rough_lobes())
    for (const float c : {0.98f, 0.5f, 0.1f, -0.9f, -0.2f}) {
      if (lobe.type == LobeType::kRetroDiffuse) continue;  // Disney's diffuse gains up to a few percent at grazing angles
      INFO(name(lobe.type));
      CAPTURE(lobe.roughness);
      CHECK(albedo(lobe, direction(c), Transport::kRadiance) < 1.005);
      // Not so the glass whose Fresnel factor is the camera side's: nothing bounds what photons gain by that.
      if (!(lobe.separable && lobe.type == LobeType::kDielectric)) CHECK(albedo(lobe, direction(c), Transport::kPhoton) < 1.005);
    }
}

TEST_CASE("the energy that multiple scattering loses is given back") {
  const AlbedoTable conductor(LobeType::kConductor, 1);
  for (const float roughness : {0.2f, 0.5f, 0.8f, 1.0f})
    for (const float c : {0.95f, 0.6f, 0.3f}) {
      CAPTURE(roughness);
      CAPTURE(c);
      Lobe metal = make_lobe(LobeType::kConductor, roughness);
      metal.multiple_scattering = &conductor;
      CHECK(albedo(metal, direction(c), Transport::kRadiance) == doctest::Approx(1).epsilon(0.02));
      static const AlbedoTable table(LobeType::kDielectric, 1.5f);
      Lobe glass = make_lobe(LobeType::kDielectric, roughness);
      glass.multiple_scattering = &table;
      CHECK(albedo(glass, direction(c), Transport::kRadiance) == doctest::Approx(1).epsilon(0.02));
    }
}

TEST_CASE("photons take along what the camera side would gather") {
  constexpr int n = 1 << 17;
  for (const Lobe& lobe : rough_lobes()) {
    if (lobe.roughness < 0.5f) continue;
    for (const float c : {0.8f, -0.4f}) {
      const Vec3 wi = direction(c);
      double integral = 0;
      for (int i = 0; i < n; ++i) {
        const Vec3 wo = sample_sphere(Sampler(2, static_cast<uint64_t>(i)).next().first());
        integral += static_cast<double>(evaluate(lobe, kAt, wo, wi).x * std::abs(wo.z)) * 4 * M_PI / n;
      }
      INFO(name(lobe.type));
      CAPTURE(lobe.ior);
      CHECK(albedo(lobe, wi, Transport::kPhoton) == doctest::Approx(integral).epsilon(0.01));
    }
  }
}

TEST_CASE("independent masking and shadowing hide more than one height field does, and nothing where both directions are steep") {
  const Lobe joint = make_lobe(LobeType::kConductor, 1);
  Lobe separable = joint;
  separable.separable = true;
  const auto value = [](const Lobe& lobe, Vec3 a, Vec3 b) { return static_cast<double>(evaluate(lobe, kAt, a, b).x); };
  CHECK(value(separable, direction(1), direction(1)) == doctest::Approx(value(joint, direction(1), direction(1))));
  CHECK(value(separable, direction(0.2f), direction(0.2f, 3.0f)) < 0.8 * value(joint, direction(0.2f), direction(0.2f, 3.0f)));
}

TEST_CASE("a metal whose edge is that of a dielectric is that dielectric's reflection where its colour is") {
  Lobe metal = make_lobe(LobeType::kConductor, 0.4f);
  metal.color = splat(fresnel_dielectric(1, metal.ior));
  metal.edge_by_ior = true;
  const Lobe coat = make_lobe(LobeType::kCoat, 0.4f);
  for (const float c : {1.0f, 0.5f, 0.1f})
    CHECK(static_cast<double>(evaluate(metal, kAt, direction(c), direction(c, 3.5f)).x) ==
          doctest::Approx(static_cast<double>(evaluate(coat, kAt, direction(c), direction(c, 3.5f)).x)).epsilon(1e-4));
}

TEST_CASE("Fresnel reflectance agrees with the textbook") {
  for (const float eta : {1.5f, 1 / 1.5f, 1.0f, 2.4f})
    for (float c = 0.01f; c <= 1; c += 0.01f)
      CHECK(static_cast<double>(fresnel_dielectric(c, eta)) ==
            doctest::Approx(textbook_fresnel(static_cast<double>(c), static_cast<double>(eta))).epsilon(2e-4).scale(1));
  CHECK(fresnel_dielectric(1, 1.5f) == doctest::Approx(0.04));
  CHECK(fresnel_dielectric(0, 1.5f) == doctest::Approx(1));
}

TEST_CASE("a smooth interface splits light by Fresnel and Snell") {
  const Lobe glass = make_lobe(LobeType::kDielectric, 0);
  for (const float c : {0.99f, 0.6f, 0.2f, -0.95f, -0.8f}) {
    const Vec3 given = direction(c);
    const float eta = c > 0 ? 1.5f : 1 / 1.5f;
    int reflected = 0;
    for (int i = 0; i < 1000; ++i) {
      const std::array<float, 3> u{0.5f, 0.5f, (static_cast<float>(i) + 0.5f) / 1000};
      const auto photon = sample(glass, kAt, given, u, Transport::kPhoton), radiance = sample(glass, kAt, given, u, Transport::kRadiance);
      REQUIRE((photon && radiance));
      CHECK((photon->smooth && photon->pdf_solid_angle == 0));
      CHECK(photon->weight.x == doctest::Approx(1).epsilon(1e-4));
      const bool back = photon->direction.z * c > 0;
      reflected += back;
      CHECK(static_cast<double>(radiance->weight.x) == doctest::Approx(back ? 1.0 : 1.0 / static_cast<double>(eta * eta)).epsilon(1e-4));
      if (back) continue;
      CHECK(static_cast<double>(std::hypot(given.x, given.y)) ==
            doctest::Approx(static_cast<double>(eta * std::hypot(photon->direction.x, photon->direction.y))).epsilon(1e-4));
      CHECK(given.x * photon->direction.x < 0);
    }
    const double expected = textbook_fresnel(static_cast<double>(std::abs(c)), static_cast<double>(eta));
    CHECK(reflected / 1000.0 == doctest::Approx(expected).epsilon(0.002).scale(1));
  }
}

TEST_CASE("light inside glass beyond the critical angle is reflected entirely") {
  for (const float roughness : {0.0f, 0.1f}) {
    const Lobe glass = make_lobe(LobeType::kDielectric, roughness);
    for (const float u : {0.0f, 0.5f, 0.999f}) {
      const auto s = sample(glass, kAt, direction(-0.3f), {0.4f, 0.8f, u}, Transport::kRadiance);
      REQUIRE(s);
      CHECK(s->direction.z < 0);
    }
  }
}

TEST_CASE("smooth lobes have no value, and black ones of any kind are never infinite") {
  const Lobe mirror = make_lobe(LobeType::kConductor, 0);
  CHECK(is_black(evaluate(mirror, kAt, direction(0.5f), direction(0.5f, 0.4f + kPi))));
  for (Lobe lobe : rough_lobes()) {
    lobe.color = lobe.color2 = {};
    for (const float u : {0.0f, 0.3f, 0.999999f})
      if (const auto s = sample(lobe, kAt, direction(0.4f), {u, u, u}, Transport::kRadiance)) CHECK(is_finite(s->weight));
  }
}

TEST_CASE("no light leaks through where shading and geometric normal disagree") {
  const ShadingPoint bent{{0, 0, 1}, Frame(normalize({0.8f, 0, 0.6f}))};
  const Vec3 above_shading_only = normalize({1, 0, -0.2f}), above_both = normalize({0.5f, 0, 1});
  for (const Lobe& lobe : rough_lobes()) {
    CHECK(is_black(evaluate(lobe, bent, above_both, above_shading_only)));
    CHECK(is_black(evaluate(lobe, bent, above_shading_only, above_both)));
  }
}

TEST_CASE("photons and camera paths see one lobe on bent normals") {
  // <camera side, photon side> must be the same by either way of sampling: sum of f |cos_s wi| |cos_g wo| over both directions.
  const ShadingPoint bent{{0, 0, 1}, Frame(normalize({0.4f, 0.1f, 1}))};
  constexpr int n = 1 << 16;
  for (const LobeType type : {LobeType::kDiffuse, LobeType::kConductor}) {
    const Lobe lobe = make_lobe(type, 0.7f);
    double camera = 0, photon = 0;
    for (int i = 0; i < n; ++i) {
      Sampler sampler(8, static_cast<uint64_t>(i));
      const Sample4 u = sampler.next(), v = sampler.next();
      const Vec3 given = sample_cosine_hemisphere(u.first());  // pdf |cos_g| / pi
      const std::array<float, 3> w{v[0], v[1], v[2]};
      // A function of both directions that is not symmetric tells them apart.
      const auto measure = [](Vec3 wo, Vec3 wi) { return static_cast<double>((1 + wo.x) * (2 + wi.y)); };
      if (const auto s = sample(lobe, bent, given, w, Transport::kRadiance))
        camera += static_cast<double>(s->weight.x) * measure(given, s->direction);
      if (const auto s = sample(lobe, bent, given, w, Transport::kPhoton))
        photon += static_cast<double>(s->weight.x) * measure(s->direction, given);
    }
    INFO(name(type));
    CHECK(camera == doctest::Approx(photon).epsilon(0.02));
  }
}

TEST_CASE("smooth glass and metal with a bent shading normal lose nothing") {
  // Seen at a grazing angle, the reflection about this normal would go below the surface.
  const ShadingPoint bent{{0, 0, 1}, Frame(normalize({0.8f, 0, 0.6f}))};
  const Vec3 grazing = normalize({-0.9f, 0.1f, 0.15f});
  for (const LobeType type : {LobeType::kDielectric, LobeType::kConductor}) {
    CAPTURE(name(type));
    for (const Transport transport : {Transport::kRadiance, Transport::kPhoton})
      for (const float u : {0.01f, 0.99f}) {
        const auto s = sample(make_lobe(type, 0), bent, grazing, {0.5f, 0.5f, u}, transport);
        REQUIRE(s.has_value());
        CHECK(s->weight.x > 0.3f);
      }
  }
}
