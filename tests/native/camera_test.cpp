#include "camera.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <functional>
#include <limits>
#include <random>
#include <vector>

#include "chi_square.h"
#include "status.h"

using namespace sppm;

namespace {

SppmCameraDesc basic() {  // at (0, 0, 5), looks down -z
  SppmCameraDesc d{};
  d.struct_size = sizeof d;
  d.transform[0] = d.transform[5] = d.transform[10] = 1, d.transform[11] = 5;
  d.window[0] = -1, d.window[1] = 1, d.window[2] = -0.5f, d.window[3] = 0.5f;
  d.clip_near = 0.1f, d.clip_far = 100;
  d.width = 200, d.height = 100;
  return d;
}

void check_direction(const Camera& camera, float x, float y, Vec3 expected) {
  const Vec3 d = camera.ray(x, y, {0.5f, 0.5f}).direction;
  CHECK(length(d - normalize(expected)) < 1e-5f);
}

}  // namespace

TEST_CASE("perspective rays span the window at distance 1") {
  const Camera camera(basic());
  check_direction(camera, 0, 0, {-1, -0.5f, -1});
  check_direction(camera, 200, 0, {1, -0.5f, -1});
  check_direction(camera, 0, 100, {-1, 0.5f, -1});
  check_direction(camera, 100, 50, {0, 0, -1});
  CHECK(camera.ray(3, 4, {0, 0}).origin == Vec3{0, 0, 5});
}

TEST_CASE("a shifted window looks aside") {
  SppmCameraDesc d = basic();
  d.window[0] = 0, d.window[1] = 2;
  check_direction(Camera(d), 100, 50, {1, 0, -1});
}

TEST_CASE("orthographic rays are parallel") {
  SppmCameraDesc d = basic();
  d.projection = SPPM_ORTHOGRAPHIC;
  const Camera camera(d);
  const Ray ray = camera.ray(200, 100, {});
  CHECK(ray.origin == Vec3{1, 0.5f, 5});
  CHECK(ray.direction == Vec3{0, 0, -1});
  CHECK(camera.footprint(7) == doctest::Approx(0.01));
  CHECK(Camera(basic()).footprint(7) == doctest::Approx(0.07));
}

TEST_CASE("clip distances are depths, not lengths") {
  const Camera camera(basic());
  const Ray ray = camera.ray(0, 0, {});
  CHECK(camera.depth(ray.origin + ray.direction * ray.near) == doctest::Approx(0.1));
  CHECK(camera.depth(ray.origin + ray.direction * ray.far) == doctest::Approx(100));
}

TEST_CASE("a point in focus stays where it is for every point of the lens") {
  for (const uint32_t projection : {SPPM_PERSPECTIVE, SPPM_ORTHOGRAPHIC}) {
    SppmCameraDesc d = basic();
    d.projection = projection;
    const Ray sharp = Camera(d).ray(30, 80, {});
    d.aperture_radius = 0.2f, d.focal_distance = 3;
    const Camera camera(d);
    const Vec3 focus = sharp.origin + sharp.direction * (3 / -sharp.direction.z);
    float widest = 0;
    for (int i = 0; i < 64; ++i) {
      const Ray ray = camera.ray(30, 80, {static_cast<float>(i % 8) / 7.5f, static_cast<float>(i / 8) / 7.5f});
      const Vec3 there = ray.origin + ray.direction * (3 / -ray.direction.z);
      CHECK(length(there - focus) < 1e-5f);
      CHECK(camera.depth(ray.origin) == doctest::Approx(0));
      widest = std::max(widest, length(ray.origin - sharp.origin));
    }
    CHECK(widest <= 0.2001f);
    CHECK(widest > 0.15f);
  }
}

TEST_CASE("the aperture ratio narrows the lens across") {
  SppmCameraDesc d = basic();
  d.aperture_radius = 1, d.aperture_ratio = 2, d.focal_distance = 3;
  const Camera camera(d);
  CHECK(camera.ray(0, 0, {1, 0.5f}).origin.x == doctest::Approx(0.5));
  CHECK(camera.ray(0, 0, {0.5f, 1}).origin.y == doctest::Approx(1));
}

TEST_CASE("rays leave all of the lens alike, whatever its ratio") {
  std::mt19937 random(2);
  std::uniform_real_distribution<float> uniform;
  for (const uint32_t projection : {SPPM_PERSPECTIVE, SPPM_ORTHOGRAPHIC})
    for (const float ratio : {0.0f, 0.5f, 1.0f, 3.0f}) {
      SppmCameraDesc d = basic();
      d.projection = projection, d.aperture_radius = 0.2f, d.focal_distance = 3, d.aperture_ratio = ratio;
      const Camera camera(d);
      d.aperture_radius = 0;
      const Vec3 middle = Camera(d).ray(30, 80, {}).origin;
      std::vector<Vec2> points;
      for (int i = 0; i < 20000; ++i) {
        const Vec3 from = camera.ray(30, 80, {uniform(random), uniform(random)}).origin - middle;
        const Vec2 lens{from.x / 0.2f * (ratio > 0 ? ratio : 1), from.y / 0.2f};
        CHECK(lens.x * lens.x + lens.y * lens.y < 1.0001f);
        points.push_back(disk_to_square(lens.x, lens.y));
      }
      CAPTURE(projection);
      CAPTURE(ratio);
      CHECK(uniformity(points, 12).sigmas() < kMostSigmas);
    }
}

TEST_CASE("the region is all of the image unless given") {
  SppmCameraDesc d = basic();
  CHECK(Camera(d).region_width == 200);
  d.region_x = 50, d.region_y = 20, d.region_width = 150, d.region_height = 80;
  CHECK(Camera(d).region_y == 20);
  d.region_width = 151;
  CHECK_THROWS_AS(Camera{d}, Error);
  d.region_width = 150, d.region_x = ~uint64_t{0} - 10;  // the sum would wrap
  CHECK_THROWS_AS(Camera{d}, Error);
}

TEST_CASE("bad descriptions are refused") {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const std::vector<std::function<void(SppmCameraDesc&)>> mistakes{
      [](auto& d) { d.width = 0; },          [](auto& d) { d.window[1] = -2; },      [=](auto& d) { d.window[0] = nan; },
      [=](auto& d) { d.transform[3] = nan; }, [](auto& d) { d.transform[0] = 0; },    [](auto& d) { d.clip_far = 0; },
      [](auto& d) { d.clip_near = -1; },      [](auto& d) { d.aperture_radius = 1; }, [](auto& d) { d.projection = 2; },
      [=](auto& d) { d.clip_far = nan; },     [](auto& d) { d.aperture_radius = -1; }};
  for (const auto& mistake : mistakes) {
    SppmCameraDesc d = basic();
    mistake(d);
    CHECK_THROWS_AS(Camera{d}, Error);
  }
}
