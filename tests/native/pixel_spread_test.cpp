#include "pixel_spread.h"

#include <cmath>

#include "seen.h"

#include <doctest/doctest.h>

using namespace sppm;

TEST_CASE("a pixel's spread is the mean and the variances of its points") {
  const Vec3 middle{5, -3, 0}, wo = normalize(Vec3{0, 1, 1});
  const PixelSpread spread = rectangle(middle, 0.01f, 0.02f, wo);
  CHECK(spread.count == 3000);
  CHECK(length(spread.mean - middle) < 1e-5f);
  const VisiblePoint vp = seen(middle + Vec3{0.002f, 0.004f, 0}, {0, 0, 1}, wo).point;
  const PixelEllipse e = spread.ellipse({vp, kFootprint});
  CHECK(e.center == spread.mean);
  CHECK(std::abs(dot(unpack_direction(e.axis), Vec3{0, 1, 0})) == doctest::Approx(1));
  CHECK(e.along == doctest::Approx(0.02 / std::sqrt(12.0)).epsilon(0.01));
  CHECK(e.across == doctest::Approx(0.01 / std::sqrt(12.0)).epsilon(0.01));
}

TEST_CASE("only points of one surface make a pixel's spread, and the majority tells which") {
  PixelSpread spread = rectangle({0, 0, 0}, 0.01f, 0.01f, {0, 0, 1}, 100);
  const auto has = [&](const CameraSample& sample) { return spread.has(sample, axes_of(sample)); };
  CHECK(has(seen({0.004f, 0, 0})));
  CHECK_FALSE(has(seen({0.004f, 0, 0.005f})));        // above it
  CHECK_FALSE(has(seen({0.001f, 0, 0}, {1, 0, 0})));  // of a wall there
  CHECK_FALSE(has(seen({0.1f, 0, 0})));               // far away
  CHECK_FALSE(PixelSpread{}.has(seen({}), axes_of(seen({}))));
  CameraSample reflected = seen({0.004f, 0, 0});
  reflected.way = 1;
  CHECK_FALSE(has(reflected));
  for (int i = 0; i < 100; ++i) add(spread, seen({0, 0, 1}));
  CHECK(has(seen({})));
  add(spread, seen({0, 0, 1}));
  CHECK_FALSE(has(seen({})));
  CHECK(has(seen({0, 0, 1})));
}

TEST_CASE("a pixel that sees much of a surface has no ellipse") {
  const auto wide = [](float size) {
    PixelSpread spread;
    for (int i = 0; i < 1000; ++i) {
      const Sample4 u = Sampler(7, static_cast<uint64_t>(i)).next();
      add(spread, seen({(u[0] - 0.5f) * size, (u[1] - 0.5f) * size, 0}));
    }
    return spread.ellipse(axes_of(seen({})));
  };
  CHECK(wide(3 * kFootprint).across == doctest::Approx(3 * 0.01 / std::sqrt(12.0)).epsilon(0.02));
  CHECK(wide(5 * kFootprint).across == 0);
}
