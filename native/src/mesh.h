// Triangle meshes with the attributes of their corners.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "large_vector.h"
#include "parallel.h"
#include "sppm/sppm.h"
#include "vecmath.h"

namespace sppm {

// How far above or below a point of a triangle a ray must start or end to clear it. A point computed from barycentrics is off its plane by
// a few roundings of the coordinates and edges it was made of, and the ray tracer's own test by a few more; this many units in the last
// place of the largest of them are beyond both. `reach` is the largest coordinate, in absolute value, that any of those sums had.
inline float clearance(float reach, Vec3 edge1 = {}, Vec3 edge2 = {}) {
  constexpr float kUlps = 16 * 0x1p-23f;
  return kUlps * (reach + max_component(max(abs(edge1), abs(edge2))));
}

struct Plane {
  Vec3 normal;      // unit, of the winding; 0 for a triangle without area
  float slack = 0;  // the part of the clearance that does not depend on where the triangle is
};
Plane plane_of(const std::array<Vec3, 3>& triangle);

// The unit shading normal on ng's side of a surface that is seen from the unit vector w, by what is interpolated between the corners. At
// the rims of smooth meshes that may face away from w, and nothing would scatter that way: it is bent until it just faces w, as much as ng
// does.
inline Vec3 shading_normal(Vec3 interpolated, Vec3 ng, Vec3 w) {
  constexpr float kLeast = 1e-3f;
  const float size = length(interpolated);
  if (!(size > 0)) return ng;
  const Vec3 ns = face_toward(interpolated / size, ng);
  const float geometric = dot(ng, w), least = std::copysign(std::min(kLeast, std::abs(geometric)), geometric), shading = dot(ns, w);
  return shading * least >= square(least) ? ns : normalize(ns + w * (least - shading));
}

// What a hit asks of a triangle, in one line of the cache: memory is what most hits wait for.
struct alignas(64) Facet {
  std::array<Vec3, 3> p;
  Plane plane;
  std::array<PackedDirection, 3> normals;  // of the corners, if the mesh is smooth
};
static_assert(sizeof(Facet) == 64);

// In double, where no product of edges leaves the range; 0 for what single precision could not place.
double area_of(const std::array<Vec3, 3>& triangle);

struct Mesh {
  explicit Mesh(const SppmMeshDesc& desc);  // copies; throws Error naming the mesh, the array and the index

  std::string name;
  std::vector<Vec3> positions;  // and one unused at the end, for readers of 16 bytes
  std::vector<std::array<uint32_t, 3>> indices;
  std::vector<std::array<uint32_t, 3>> corners;  // empty without corner attributes
  std::vector<PackedDirection> normals;          // per corner, until only facets are kept; empty: flat
  std::vector<Vec2> uvs;
  std::vector<Vec3> colors;
  std::vector<uint16_t> slots;  // empty: all 0
  uint32_t slot_count = 1;
  bool smooth = false;
  LargeVector<Facet> facets;  // see `make_facets`
  bool needles = false;       // so slender, so much of it, that the ray tracer must take care; known with the facets

  Bounds bounds;

  void transform(const Affine& to_world);
  // Before anything refers to corners by their number: those of slender triangles are put in another order.
  void make_facets(const Threads& threads);
  // Gives up what facets are made of, where they will not be made again.
  void keep_facets_only();
  uint32_t slot(uint32_t triangle) const { return slots.empty() ? 0 : slots[triangle]; }
  uint64_t memory() const;

 private:
  std::array<Vec3, 3> corner_positions(uint64_t triangle) const;
  void turn(uint64_t triangle, size_t first);  // the corner `first` becomes the first one, the winding stays
};

}  // namespace sppm
