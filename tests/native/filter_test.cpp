// The pixel filters: which share of a pixel's samples falls how far from its middle.
#include <algorithm>
#include <cmath>
#include <vector>

#include <doctest/doctest.h>

#include "chi_square.h"
#include "sampling.h"
#include "session.h"

using namespace sppm;

namespace {

// Integral of a filter of total width 1 from its left edge, 1 in all.
double blackman_harris_integral(double t) {
  const double a = 2 * M_PI * t;
  return t - (0.48829 * std::sin(a) - 0.14128 * std::sin(2 * a) / 2 + 0.01168 * std::sin(3 * a) / 3) / (2 * M_PI * 0.35875);
}
double box_integral(double t) { return t; }

// Share of a filter of `width` pixels between two distances from a pixel's middle.
double share(double (*integral)(double), double width, double from, double to) {
  const auto below = [&](double x) { return integral(std::clamp(x / width + 0.5, 0.0, 1.0)); };
  return below(to) - below(from);
}

constexpr uint64_t kPeriod = 8, kStripes = 12;
constexpr float kStripe = 0.25f;
double stripe_begin(uint64_t k) { return static_cast<double>(k * kPeriod) + 4 + 0.1 * static_cast<double>(k); }

// One row of pixels 1 m wide, before stripes that glow with radiance 1.
std::shared_ptr<Scene> stripes() {
  auto scene = std::make_shared<Scene>();
  std::vector<float> positions;
  std::vector<uint32_t> indices;
  for (uint64_t k = 0; k < kStripes; ++k) {
    const float x0 = static_cast<float>(stripe_begin(k)), x1 = x0 + kStripe;
    const uint32_t a = static_cast<uint32_t>(4 * k);
    for (const Vec2 p : {Vec2{x0, -9}, Vec2{x1, -9}, Vec2{x1, 9}, Vec2{x0, 9}}) positions.insert(positions.end(), {p.x, p.y, 0});
    indices.insert(indices.end(), {a, a + 1, a + 2, a, a + 2, a + 3});
  }
  SppmClosureDesc glow{};
  glow.struct_size = sizeof glow;
  glow.type = SPPM_EMISSION;
  for (int c = 0; c < 3; ++c) glow.weight.value[c] = glow.color.value[c] = 1;
  SppmMaterialDesc material{};
  material.struct_size = sizeof material;
  material.closure_count = 1, material.closures = &glow;
  SppmMeshDesc mesh{};
  mesh.struct_size = sizeof mesh;
  mesh.vertex_count = positions.size() / 3, mesh.triangle_count = indices.size() / 3;
  mesh.positions = positions.data(), mesh.indices = indices.data();
  const uint32_t id = scene->materials.add(material);
  SppmInstanceDesc instance{};
  instance.struct_size = sizeof instance;
  instance.mesh = scene->add_mesh(mesh), instance.material_count = 1, instance.materials = &id;
  instance.transform[0] = instance.transform[5] = instance.transform[10] = 1;
  scene->add_instance(instance);
  SppmCameraDesc camera{};
  camera.struct_size = sizeof camera;
  camera.projection = SPPM_ORTHOGRAPHIC;
  camera.transform[0] = camera.transform[5] = camera.transform[10] = 1, camera.transform[11] = 5;
  camera.window[1] = kStripes * kPeriod, camera.window[2] = -0.5f, camera.window[3] = 0.5f;
  camera.clip_far = 100, camera.width = kStripes * kPeriod, camera.height = 1;
  scene->set_camera(camera);
  scene->commit(Threads(1));
  return scene;
}

}  // namespace

TEST_CASE("filter offsets follow the Blackman-Harris window") {
  constexpr int n = 1 << 20, bins = 100;
  std::vector<int> counts(bins, 0);
  for (int i = 0; i < n; ++i) {
    const float x = sample_blackman_harris((static_cast<float>(i) + 0.5f) / n);
    CHECK(std::abs(x) <= 0.5f);
    ++counts[static_cast<size_t>(std::min(bins - 1, static_cast<int>((x + 0.5f) * bins)))];
  }
  ChiSquare test;
  for (int b = 0; b < bins; ++b)
    test.add(n * (blackman_harris_integral((b + 1.0) / bins) - blackman_harris_integral(static_cast<double>(b) / bins)),
             counts[static_cast<size_t>(b)]);
  CHECK(test.sigmas() < kMostSigmas);
}

TEST_CASE("a pixel sees as much of what is beside its middle as its filter says") {
  constexpr int n = 2048;
  struct Case {
    SppmPixelFilter filter;
    double setting, width;  // `width`: from end to end
  };
  for (const Case& c : {Case{SPPM_BLACKMAN_HARRIS, 1.5, 3}, Case{SPPM_BLACKMAN_HARRIS, 0.5, 1}, Case{SPPM_BOX, 1, 1},
                        Case{SPPM_BOX, 3, 3}}) {
    CAPTURE(c.filter);
    CAPTURE(c.setting);
    SppmSettings settings{};
    settings.struct_size = sizeof settings;
    settings.iterations = n, settings.max_depth = 1, settings.gamma = 0.5, settings.threads = 1, settings.photons_per_iteration = 1;
    settings.pixel_filter = c.filter, settings.filter_width = c.setting, settings.passes = 1u << SPPM_PASS_DIRECT;
    Session session(stripes(), settings);
    for (int i = 0; i < n; ++i) session.step();
    std::vector<float> seen(kStripes * kPeriod * 3);
    session.read_pass(SPPM_PASS_DIRECT, seen.data(), seen.size());
    ChiSquare test;
    double farthest = 0;
    for (uint64_t x = 0; x < kStripes * kPeriod; ++x) {
      const double from = stripe_begin(x / kPeriod) - static_cast<double>(x) - 0.5, count = n * static_cast<double>(seen[3 * x]);
      const auto integral = c.filter == SPPM_BOX ? box_integral : blackman_harris_integral;
      const double expected = n * share(integral, c.width, from, from + static_cast<double>(kStripe));
      test.add(expected, count);
      farthest = std::max(farthest, std::abs(count - expected));
    }
    CHECK(test.sigmas() < kMostSigmas);
    CHECK(farthest < 3);  // 2^k samples are stratified: an interval holds its share of them but for 2
  }
}
