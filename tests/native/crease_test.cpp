#include "crease.h"

#include <cmath>

#include "seen.h"

#include <doctest/doctest.h>

using namespace sppm;

namespace {

// A pixel of a surface with this normal, seen from direction wo.
struct Seen {
  PixelSpread spread;
  TangentAxes axes;

  Seen(Vec3 p, Vec3 normal, Vec3 wo) : axes(axes_of(seen(p, normal, wo))) { add(spread, seen(p, normal, wo)); }
};

Creases between(const Seen& own, const Seen& other, float pixels) {
  Creases creases;
  creases.add(own.spread, own.axes, other.spread, other.axes, pixels);
  return creases;
}

// Of a disk around the own point.
float share(const Creases& creases, const Seen& own, float radius) {
  VisiblePoint vp;
  vp.p = own.spread.mean;
  return creases.share(Kernel(vp, {}, radius));
}

const Vec3 kUp{0, 0, 1}, kSight{-1, 0, 1};

}  // namespace

TEST_CASE("a floor ends at the wall that stands on it") {
  const Seen floor({-0.01f, 0, 0}, kUp, kSight), wall({0, 0, 0.01f}, {-1, 0, 0}, kSight);
  const Creases creases = between(floor, wall, 2);
  REQUIRE(creases.any());
  CHECK(share(creases, floor, 0.009f) == 1);
  // A disk cut at half its radius keeps 2/3 + sqrt(3) / (4 pi).
  CHECK(share(creases, floor, 0.02f) == doctest::Approx(2.0 / 3 + std::sqrt(3.0) / (4 * M_PI)));
  CHECK(share(creases, floor, 100) == doctest::Approx(0.5).epsilon(1e-3));
  CHECK(creases.hold({-0.001f, 1, 0}));
  CHECK_FALSE(creases.hold({0.001f, 1, 0}));
}

TEST_CASE("a table ends where its side begins") {
  const Seen top({-0.01f, 0, 0}, kUp, {1, 0, 1}), side({0, 0, -0.01f}, {1, 0, 0}, {1, 0, 1});
  const Creases creases = between(top, side, 2);
  REQUIRE(creases.any());
  CHECK(creases.hold({-0.001f, 0, 0}));
  CHECK_FALSE(creases.hold({0.001f, 0, 0}));
}

TEST_CASE("what hides a part of a floor does not end it") {
  const Seen floor({-0.01f, 0, 0}, kUp, kSight);
  // A block's face that floats before the floor, one that turns little, one of the same plane, one beside.
  CHECK_FALSE(between(floor, Seen({-1, 0, 1.01f}, {-1, 0, 0}, kSight), 2).any());
  CHECK_FALSE(between(floor, Seen({0, 0, 0.003f}, normalize(Vec3{-1, 0, 2}), kSight), 2).any());
  CHECK_FALSE(between(floor, Seen({0.01f, 0, 0}, kUp, kSight), 2).any());
  CHECK_FALSE(between(floor, Seen({0, 0.04f, 0.01f}, {-1, 0, 0}, kSight), 5).any());
}

TEST_CASE("a floor that is seen beyond a line does not end there") {
  const Seen floor({-0.01f, 0, 0}, kUp, kSight), wall({0, 0, 0.01f}, {-1, 0, 0}, kSight);
  Creases creases = between(floor, wall, 2);
  creases.check(floor.spread, floor.axes, Seen({0.001f, 0.02f, 0}, kUp, kSight).spread);
  CHECK(creases.any());
  creases.check(floor.spread, floor.axes, Seen({0.02f, 0.02f, 0.02f}, kUp, kSight).spread);
  CHECK(creases.any());
  creases.check(floor.spread, floor.axes, Seen({0.02f, 0.02f, 0}, kUp, kSight).spread);
  CHECK_FALSE(creases.any());
}

TEST_CASE("in the corner of a room two lines cut") {
  const Vec3 sight{-1, -1, 1};
  const Seen floor({-0.01f, -0.01f, 0}, kUp, sight);
  const Seen left({0, -0.01f, 0.01f}, {-1, 0, 0}, sight), right({-0.01f, 0, 0.01f}, {0, -1, 0}, sight);
  Creases creases = between(floor, left, 2);
  creases.add(floor.spread, floor.axes, right.spread, right.axes, 2);
  CHECK(share(creases, floor, 100) == doctest::Approx(0.25).epsilon(1e-3));
}
