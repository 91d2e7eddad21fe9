#include "light_tree.h"

#include <doctest/doctest.h>

#include <cmath>
#include <random>
#include <vector>

using namespace sppm;

namespace {

constexpr int kSamples = 1 << 17;

// Points, spots and one-sided surfaces of very different strength over a field.
std::vector<LightBounds> field(uint32_t count) {
  std::mt19937 random(5);
  std::uniform_real_distribution<float> uniform(-1, 1);
  std::vector<LightBounds> lights(count);
  for (uint32_t i = 0; i < count; ++i) {
    LightBounds& b = lights[i];
    b.center = {10 * uniform(random), 10 * uniform(random), uniform(random)};
    b.intensity = std::pow(10.0f, 3 * uniform(random));
    b.axis = normalize({uniform(random), uniform(random), uniform(random) - 0.5f});
    if (i % 3 == 1) b.spread = 0.6f;
    if (i % 3 == 2) b.spread = 0, b.fade = kPi / 2, b.radius = 0.2f;
  }
  return lights;
}

}  // namespace

TEST_CASE("no lights, no choice") {
  LightTree tree;
  float u = 0.5f;
  CHECK_FALSE(tree.sample({}, u));
  tree.build({LightBounds{}});
  CHECK_FALSE(tree.sample({}, u));
  CHECK(tree.probability(0, {}) == 0);
}

TEST_CASE("lights are chosen with the probability that is told, and what is left of u is uniform") {
  const auto lights = field(50);
  LightTree tree;
  tree.build(lights);
  for (const Vec3 p : {Vec3{0, 0, -2}, Vec3{3, -4, 0.5f}}) {
    std::vector<int> counts(lights.size(), 0);
    double sum = 0, fresh = 0;
    for (uint32_t i = 0; i < lights.size(); ++i) sum += static_cast<double>(tree.probability(i, p));
    // What is missing are halves that promise light which no light in them brings.
    CHECK(sum < 1.0001);
    CHECK(sum > 0.9);
    int drawn = 0;
    for (int i = 0; i < kSamples; ++i) {
      float u = (static_cast<float>(i) + 0.5f) / kSamples;
      const auto choice = tree.sample(p, u);
      if (!choice) continue;
      ++counts[choice->light];
      ++drawn;
      fresh += static_cast<double>(u);
      if (i % 997 == 0) CHECK(choice->probability == doctest::Approx(tree.probability(choice->light, p)));
    }
    for (uint32_t i = 0; i < lights.size(); ++i)
      CHECK(std::abs(counts[i] - kSamples * static_cast<double>(tree.probability(i, p))) < 3 + 1e-4 * kSamples);
    CHECK(drawn == doctest::Approx(kSamples * sum).epsilon(1e-3));
    CHECK(fresh / drawn == doctest::Approx(0.5).epsilon(0.01));
  }
}

TEST_CASE("a light that shines at a point can be chosen there") {
  const auto lights = field(300);
  LightTree tree;
  tree.build(lights);
  std::mt19937 random(6);
  std::uniform_real_distribution<float> uniform(-1, 1);
  int shining = 0;
  for (int k = 0; k < 200; ++k) {
    const Vec3 p{12 * uniform(random), 12 * uniform(random), 3 * uniform(random)};
    for (uint32_t i = 0; i < lights.size(); ++i) {
      const LightBounds& b = lights[i];
      const bool shines = std::acos(dot(normalize(p - b.center), b.axis)) < b.spread + 0.99f * b.fade;
      shining += shines;
      if (shines) CHECK(tree.probability(i, p) > 0);
    }
  }
  CHECK(shining > 1000);
}

TEST_CASE("near and strong lights are chosen more often") {
  LightBounds weak_near, strong_far, strong_near;
  weak_near.intensity = 1, strong_far.intensity = 100, strong_near.intensity = 100;
  weak_near.center = {1, 0, 0}, strong_far.center = {-100, 0, 0}, strong_near.center = {0, 1, 0};
  LightTree tree;
  tree.build({weak_near, strong_far, strong_near});
  CHECK(tree.probability(2, {}) > 0.9f);
  CHECK(tree.probability(0, {}) > tree.probability(1, {}));
}
