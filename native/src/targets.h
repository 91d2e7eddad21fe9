// Where photons are worth sending: balls around the surfaces that throw caustics.
//
// Balls may overlap, so what is drawn carries the density of the mixture: exact, whatever the balls are, as long as they hold every
// surface that counts.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "vecmath.h"

namespace sppm {

// Directions within an angle of an axis: the light of a spot, or of one side of a surface.
struct Cone {
  Vec3 axis{0, 0, 1};
  float cos_half = -1;  // -1: all directions
};

// A piece of a surface that throws caustics, and about what share of the light on it does.
struct Caster {
  Bounds bounds;
  float strength = 0;
};

class Targets {
 public:
  static constexpr int kMost = 64;

  void build(std::vector<Caster> casters);

  bool empty() const { return radius_.empty(); }
  size_t count() const { return radius_.size(); }

  struct Direction {
    Vec3 direction;
    float pdf_solid_angle;
  };
  // A direction in which a ray from some point closer than `margin` to p may meet a target; empty if no target is within `limit`.
  std::optional<Direction> sample_direction(Vec3 p, float margin, const Cone& limit, Vec2 u, float choice) const;

  struct Line {
    Vec3 point;
    float pdf_area;  // across the direction
  };
  // A line of the given unit direction that meets a target.
  Line sample_line(Vec3 direction, Vec2 u, float choice) const;

 private:
  struct Ball {
    Vec3 center;
    float radius = 0, strength = 0;
  };
  static Ball enclose(const Caster* begin, const Caster* end);
  static std::vector<Ball> split(Caster* begin, Caster* end, int budget);

  std::vector<float> x_, y_, z_, radius_, strength_;  // a ball each
};

}  // namespace sppm
