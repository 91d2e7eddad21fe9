// The emitting triangles of one instance: together one light, of which each triangle is chosen by its power.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "light_sample.h"
#include "light_tree.h"
#include "material.h"
#include "sampling.h"
#include "vecmath.h"

namespace sppm {

// One triangle of an emitting mesh, in world space.
struct EmissiveTriangle {
  std::array<Vec3, 3> p;
  std::array<SurfaceAttributes, 3> attributes;
  uint32_t material = 0;
  std::array<Vec3, 3> normals;  // of the corners, of any length, where what is emitted depends on the direction; 0 if flat
  float reach = 0;  // see `clearance`
  double area = 0;

  Vec3 at(Vec2 barycentric) const {
    return p[0] * (1 - barycentric.x - barycentric.y) + p[1] * barycentric.x + p[2] * barycentric.y;
  }
};

struct EmissiveMesh {
  // Fills in the `reach` and `area` of the triangles.
  EmissiveMesh(std::vector<EmissiveTriangle> triangles, const Materials* materials);

  std::vector<EmissiveTriangle> triangles;
  Distribution choice;  // of a triangle
  const Materials* materials;

  bool dark() const { return choice.empty(); }
  double power() const { return 2 * M_PI * choice.total(); }  // luminance [W]
  LightBounds bounds() const;
  // Toward the unit vector w.
  Vec3 radiance(const EmissiveTriangle& triangle, Vec2 barycentric, Vec3 w) const;

  // Light toward p; the pdf is without the choice of this light. `pick` chooses the triangle.
  std::optional<DirectSample> sample_direct(Vec3 p, Vec2 u, float pick) const;
  // Density over area with which that picks a point on a triangle, of a light chosen with `probability`.
  float pdf_area(uint32_t triangle, float probability) const;
};

}  // namespace sppm
