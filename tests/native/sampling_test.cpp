#include "sampling.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "chi_square.h"

using namespace sppm;

namespace {

// True if the first 2^k points have exactly one in each cell of a 2^a by 2^(k-a) grid over the dimensions x and y.
bool stratified(uint64_t stream, uint32_t group, int k, int a, int x, int y) {
  const uint64_t n = uint64_t{1} << k;
  std::vector<int> seen(n, 0);
  for (uint64_t i = 0; i < n; ++i) {
    const Sample4 s = Sampler(stream, i).at(group);
    const auto column = static_cast<uint64_t>(s[x] * static_cast<float>(uint64_t{1} << a));
    const auto row = static_cast<uint64_t>(s[y] * static_cast<float>(uint64_t{1} << (k - a)));
    ++seen[(row << a) + column];
  }
  return std::all_of(seen.begin(), seen.end(), [](int count) { return count == 1; });
}

double moment(int n, double (*value)(Vec2)) {
  double sum = 0;
  for (int i = 0; i < n; ++i) sum += value(Sampler(3, static_cast<uint64_t>(i)).next().first());
  return sum / n;
}

}  // namespace

TEST_CASE("every prefix of 2^k points is stratified in each dimension") {
  for (uint64_t stream : {uint64_t{1}, uint64_t{0x123456789abcdef}})
    for (uint32_t group : {0u, 9u})
      for (int k = 0; k <= 12; ++k)
        for (int d = 0; d < 4; ++d) CHECK(stratified(stream, group, k, k, d, (d + 1) % 4));
}

TEST_CASE("the first two dimensions are a (0, 2) sequence: every elementary interval holds one point") {
  for (int k = 0; k <= 12; ++k)
    for (int a = 0; a <= k; ++a) CHECK(stratified(42, 1, k, a, 0, 1));
}

TEST_CASE("samples are in [0, 1) and groups, streams and the high half of the index tell them apart") {
  int equal = 0;
  for (uint64_t i = 0; i < 1000; ++i) {
    const float a = Sampler(1, i).at(0)[0];
    CHECK((a >= 0 && a < 1));
    equal += a == Sampler(1, i).at(1)[0];
    equal += a == Sampler(2, i).at(0)[0];
    equal += a == Sampler(1, i + (uint64_t{1} << 32)).at(0)[0];
  }
  CHECK(equal < 3);
  Sampler s(5, 6);
  s.next();
  CHECK(s.next()[2] == Sampler(5, 6).at(1)[2]);
}

TEST_CASE("a distribution picks in proportion to its weights, never zeros, and u stays uniform") {
  const std::vector<double> weights{0, 3, 0, 0, 1, 4, 0};
  const Distribution d(weights);
  std::vector<int> counts(weights.size(), 0);
  constexpr int n = 80000;
  double fresh = 0;
  for (int i = 0; i < n; ++i) {
    float u = (static_cast<float>(i) + 0.5f) / n;
    ++counts[d.sample(u)];
    CHECK((u >= 0 && u < 1));
    fresh += static_cast<double>(u);
  }
  for (size_t i = 0; i < weights.size(); ++i) {
    CHECK(counts[i] == doctest::Approx(n * weights[i] / 8).epsilon(1e-3));
    CHECK(static_cast<double>(d.probability(i)) == doctest::Approx(weights[i] / 8));
  }
  CHECK(fresh / n == doctest::Approx(0.5).epsilon(0.01));
  float least = 0, most = 0x1.fffffep-1f;
  CHECK(d.sample(least) == 1);
  CHECK(d.sample(most) == 5);
  CHECK(Distribution(std::vector<double>{0, 0}).empty());
  CHECK(Distribution().empty());
}

TEST_CASE("a distribution of a million weights finds one among zeros") {
  std::vector<double> weights(1000000, 0.0);
  weights[765432] = 1e-30;
  float u = 0.3f;
  CHECK(Distribution(weights).sample(u) == 765432);
}

TEST_CASE("warps have the moments of their densities") {
  constexpr int n = 1 << 16;
  const auto near = [](double value) { return doctest::Approx(value).epsilon(2e-3); };
  CHECK(moment(n, [](Vec2 u) { return static_cast<double>(square(sample_disk(u).x)); }) == near(0.25));
  CHECK(1 + moment(n, [](Vec2 u) { return static_cast<double>(sample_disk(u).y); }) == near(1));
  CHECK(moment(n, [](Vec2 u) { return static_cast<double>(sample_cosine_hemisphere(u).z); }) == near(2.0 / 3));
  CHECK(1 + moment(n, [](Vec2 u) { return static_cast<double>(sample_sphere(u).z); }) == near(1));
  CHECK(moment(n, [](Vec2 u) { return static_cast<double>(square(sample_sphere(u).x)); }) == near(1.0 / 3));
  CHECK(moment(n, [](Vec2 u) { return static_cast<double>(sample_cone(u, 0.5f).z); }) == near(0.75));
  CHECK(moment(n, [](Vec2 u) { return static_cast<double>(sample_triangle(u).x); }) == near(1.0 / 3));
  CHECK(moment(n, [](Vec2 u) { return static_cast<double>(sample_triangle(u).y); }) == near(1.0 / 3));
}

TEST_CASE("warps are uniform, or as dense as they should be") {
  constexpr int n = 1 << 16, side = 12;
  std::mt19937 random(1);
  std::uniform_real_distribution<float> uniform;
  std::vector<Vec2> disk, triangle, sphere, hemisphere, cone;
  for (int i = 0; i < n; ++i) {
    const Vec2 u{uniform(random), uniform(random)}, d = sample_disk(u);
    disk.push_back(disk_to_square(d.x, d.y));
    triangle.push_back(triangle_to_square(sample_triangle(u)));
    const auto turn = [](Vec3 w) { return std::atan2(w.y, w.x) / (2 * kPi) + 0.5f; };
    const Vec3 s = sample_sphere(u), h = sample_cosine_hemisphere(u), c = sample_cone(u, 0.3f);
    sphere.push_back({(s.z + 1) / 2, turn(s)});
    hemisphere.push_back({h.z * h.z, turn(h)});  // cos^2 is uniform where the density is cos / pi
    cone.push_back({(1 - c.z) / 0.3f, turn(c)});
  }
  for (const auto& points : {disk, triangle, sphere, hemisphere, cone}) CHECK(uniformity(points, side).sigmas() < kMostSigmas);
}

TEST_CASE("beyond 2^32 samples are as uniform and as different as before") {
  for (const uint64_t first : {uint64_t{0}, (uint64_t{1} << 32) - 2048, uint64_t{5} << 40}) {
    CAPTURE(first);
    std::vector<Vec2> points;
    for (uint64_t i = 0; i < 4096; ++i) points.push_back(Sampler(77, first + i).at(2).second());
    CHECK(uniformity(points, 12).sigmas() < kMostSigmas);
    std::sort(points.begin(), points.end(), [](Vec2 a, Vec2 b) { return a.x < b.x; });
    const auto equal = std::adjacent_find(points.begin(), points.end(), [](Vec2 a, Vec2 b) { return a.x == b.x && a.y == b.y; });
    CHECK(equal == points.end());
  }
}

TEST_CASE("narrow cones keep their width") {
  const float one_minus_cos = 1e-10f;  // half angle 1.4e-5
  const Vec3 edge = sample_cone({1, 0}, one_minus_cos);
  CHECK(static_cast<double>(edge.x) == doctest::Approx(std::sqrt(2e-10)).epsilon(1e-4));
}

TEST_CASE("the two weights of a pair of densities sum to 1") {
  for (float ratio : {1e-6f, 0.1f, 1.0f, 7.0f, 1e6f}) CHECK(mis_weight(1, ratio) + mis_weight(ratio, 1) == doctest::Approx(1));
  CHECK(mis_weight(0, 1) == 0);
  CHECK(mis_weight(1, 0) == 1);
}
