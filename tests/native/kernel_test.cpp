#include "kernel.h"

#include <cmath>

#include "seen.h"

#include <doctest/doctest.h>

using namespace sppm;

namespace {

// Calls visit(d, weight) for places at d from the kernel's center in the plane z = 0; the weights are shares of its area.
template <typename Visit>
void integrate(const Kernel& kernel, Visit visit) {
  constexpr int kSteps = 400;
  const float step = 2 * kernel.region().along / kSteps;
  for (int y = 0; y < kSteps; ++y)
    for (int x = 0; x < kSteps; ++x) {
      const Vec3 d = Vec3{static_cast<float>(x) + 0.5f - kSteps / 2, static_cast<float>(y) + 0.5f - kSteps / 2, 0} * step;
      const Vec3 p = kernel.region().center + d;
      if (kernel.region().level(p) < 1) visit(d, static_cast<double>(kernel.weight(p) * step * step) / kernel.area());
    }
}

}  // namespace

TEST_CASE("a kernel's weights have the mean 1 over its area, and the variances it was made for") {
  const VisiblePoint vp = seen({1, 2, 3}).point;
  const PixelEllipse tilted{{1, 2, 3}, pack_direction(normalize(Vec3{3, 4, 0})), 0.03f, 0.01f};
  struct Case {
    PixelEllipse ellipse;
    float radius;
    double along, across;
  };
  for (const Case& c : {Case{{}, 0.02f, 0.01, 0.01},
                        Case{tilted, 0, 0.02, 0.01}, Case{tilted, 0.04f, 0.03, 0.02}, Case{tilted, 0.1f, 0.05, 0.05}}) {
    const Kernel kernel(vp, c.ellipse, c.radius);
    double sum = 0, along = 0, across = 0;
    integrate(kernel, [&](Vec3 d, double weight) {
      sum += weight;
      along += weight * static_cast<double>(square(0.6f * d.x + 0.8f * d.y));
      across += weight * static_cast<double>(square(0.8f * d.x - 0.6f * d.y));
    });
    CHECK(sum == doctest::Approx(1).epsilon(0.002));
    CHECK(std::sqrt(along) == doctest::Approx(c.along).epsilon(0.002));
    CHECK(std::sqrt(across) == doctest::Approx(c.across).epsilon(0.002));
  }
}

TEST_CASE("toward the horizon kernel and camera samples together cover the pixel") {
  const Vec3 wo = normalize(Vec3{0, 1, 0.05f});
  const PixelSpread spread = rectangle({0, 0, 0}, 0.01f, 0.1f, wo);
  for (const float radius : {0.001f, 0.02f}) {
    double centers = 0, kernel_variance = 0;
    constexpr int kPoints = 1000;
    for (int i = 0; i < kPoints; ++i) {
      const VisiblePoint vp = seen({0, (static_cast<float>(i) + 0.5f) * 0.1f / kPoints - 0.05f, 0}, {0, 0, 1}, wo).point;
      const Kernel kernel(vp, spread.ellipse({vp, kFootprint}), radius);
      centers += static_cast<double>(square(kernel.region().center.y)) / kPoints;
      if (i > 0) continue;
      integrate(kernel, [&](Vec3 d, double weight) { kernel_variance += weight * static_cast<double>(square(d.y)); });
    }
    CHECK(std::sqrt(centers + kernel_variance) == doctest::Approx(0.1 / std::sqrt(12.0)).epsilon(0.03));
  }
}
