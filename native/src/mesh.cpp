#include "mesh.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "status.h"

namespace sppm {
namespace {

// A plane whose edges at the first corner are nearly parallel is known worse by the ratio of their product to the area; beyond the last
// ratio it is not known at all.
constexpr float kNeedleUlps = 2 * 0x1p-23f, kLargestNeedle = 1e4f;

using Triples = std::vector<std::array<uint32_t, 3>>;

Triples copy_triples(const uint32_t* data, uint64_t count, uint64_t limit, const std::string& what) {
  Triples triples(count);
  for (uint64_t i = 0; i < count; ++i)
    for (size_t k = 0; k < 3; ++k) {
      const uint32_t value = data[3 * i + k];
      require(value < limit, [&] {
        return what + " of triangle " + std::to_string(i) + " is " + std::to_string(value) + ", must be below " + std::to_string(limit);
      });
      triples[i][k] = value;
    }
  return triples;
}

// The longest edge of a triangle, which `corner` does not touch, over the height that stands on it.
struct Slenderness {
  size_t corner = 0;
  float aspect = 0;
  double area = 0;
};

Slenderness slenderness_of(const std::array<Vec3, 3>& p) {
  const auto edge = [&](size_t corner) { return p[(corner + 2) % 3] - p[(corner + 1) % 3]; };
  std::array<float, 3> lengths;
  const float size = max_component(max(abs(edge(0)), max(abs(edge(1)), abs(edge(2)))));
  if (!(size > 0 && std::isfinite(size))) return {};
  for (size_t k = 0; k < 3; ++k) lengths[k] = length(edge(k) / size);
  Slenderness found;
  found.corner = static_cast<size_t>(std::max_element(lengths.begin(), lengths.end()) - lengths.begin());
  const float doubled = length(cross(edge((found.corner + 1) % 3) / size, edge((found.corner + 2) % 3) / size));
  found.aspect = square(lengths[found.corner]) / doubled;
  found.area = 0.5 * static_cast<double>(doubled) * static_cast<double>(size) * static_cast<double>(size);
  return found;
}

// A plane is computed from the two edges at the first corner, by the ray tracer as here, with an error of a few roundings times the
// product of their lengths over the area: between a needle's long sides that is its aspect, where its short side meets them it is 1.
// What is less slender than this keeps its order, and so the bits of its pictures.
constexpr float kTurned = 256;
// A ray may slip between two triangles so slender. Where such make up more than this share of a mesh they are seen.
constexpr float kLeaking = 1e4f;
constexpr double kSeenShare = 1e-3;

// A zero or non-finite normal cannot be used; (0, 0, 1) with the consistency test of shading is no worse than what was given.
PackedDirection pack_safely(const float* n) {
  const Vec3 v{n[0], n[1], n[2]};
  const float l = length(v);
  return pack_direction(std::isfinite(l) && l > 0 ? v / l : Vec3{0, 0, 1});
}

}  // namespace

double area_of(const std::array<Vec3, 3>& p) {
  using Double3 = std::array<double, 3>;
  const auto edge = [&](size_t to) -> Double3 {
    return {static_cast<double>(p[to].x) - static_cast<double>(p[0].x), static_cast<double>(p[to].y) - static_cast<double>(p[0].y),
            static_cast<double>(p[to].z) - static_cast<double>(p[0].z)};
  };
  const Double3 a = edge(1), b = edge(2);
  const double area = 0.5 * std::hypot(a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]);
  return std::isfinite(static_cast<float>(area)) ? area : 0;
}

Plane plane_of(const std::array<Vec3, 3>& v) {
  const Vec3 e1 = v[1] - v[0], e2 = v[2] - v[0];
  // In units of the longer edge: products of very long or very short ones leave the range of floats.
  const float size = max_component(max(abs(e1), abs(e2)));
  const Vec3 a = e1 / size, b = e2 / size, normal = cross(a, b);
  const float l = length(normal), flat = clearance(0, e1, e2);
  if (!(l > 0)) return {{}, flat};
  const float needle = std::min(std::sqrt(length_squared(a) * length_squared(b)) / l, kLargestNeedle);
  return {normal / l, flat + kNeedleUlps * size * needle};
}

Mesh::Mesh(const SppmMeshDesc& desc) : name(desc.name ? desc.name : "") {
  const std::string where = "mesh '" + name + "': ";
  constexpr uint64_t kLimit = uint64_t{1} << 31;
  require(desc.vertex_count < kLimit && desc.triangle_count < kLimit && desc.corner_count < uint64_t{1} << 32,
          where + "more than 2^31 vertices or triangles");
  require(desc.triangle_count > 0, where + "triangle_count is 0");
  require(desc.positions && desc.indices, where + "positions or indices is null");
  positions.resize(desc.vertex_count + 1);  // Embree reads 16 bytes at each vertex: one spare at the end
  for (uint64_t i = 0; i < desc.vertex_count; ++i) {
    positions[i] = {desc.positions[3 * i], desc.positions[3 * i + 1], desc.positions[3 * i + 2]};
    require(is_finite(positions[i]), [&] { return where + "vertex " + std::to_string(i) + " is not finite"; });
    bounds.add(positions[i]);
  }
  indices = copy_triples(desc.indices, desc.triangle_count, desc.vertex_count, where + "indices");
  if (desc.corner_normals || desc.corner_uvs || desc.corner_colors) {
    require(desc.corners, where + "corner attributes need corners");
    corners = copy_triples(desc.corners, desc.triangle_count, desc.corner_count, where + "corners");
  }
  if (desc.corner_normals) {
    smooth = true;
    normals.resize(desc.corner_count);
    for (uint64_t i = 0; i < desc.corner_count; ++i) normals[i] = pack_safely(desc.corner_normals + 3 * i);
  }
  if (desc.corner_uvs) {
    uvs.resize(desc.corner_count);
    for (uint64_t i = 0; i < desc.corner_count; ++i) uvs[i] = {desc.corner_uvs[2 * i], desc.corner_uvs[2 * i + 1]};
  }
  if (desc.corner_colors) {
    colors.resize(desc.corner_count);
    for (uint64_t i = 0; i < desc.corner_count; ++i) {
      colors[i] = {desc.corner_colors[3 * i], desc.corner_colors[3 * i + 1], desc.corner_colors[3 * i + 2]};
      require(is_finite(colors[i]), [&] { return where + "colour of corner " + std::to_string(i) + " is not finite"; });
    }
  }
  if (desc.material_slots) {
    slots.resize(desc.triangle_count);
    for (uint64_t i = 0; i < desc.triangle_count; ++i) {
      require(desc.material_slots[i] <= 0xffff, [&] { return where + "a material slot is above 65535"; });
      slots[i] = static_cast<uint16_t>(desc.material_slots[i]);
      slot_count = std::max(slot_count, slots[i] + 1u);
    }
  }
}

void Mesh::transform(const Affine& to_world) {
  bounds = {};
  for (Vec3& p : positions) p = to_world.point(p);
  for (size_t i = 0; i + 1 < positions.size(); ++i) bounds.add(positions[i]);
  for (PackedDirection& n : normals) {
    const Vec3 moved = to_world.normal(unpack_direction(n));
    if (length_squared(moved) > 0) n = pack_direction(normalize(moved));
  }
}

void Mesh::make_facets(const Threads& threads) {
  constexpr uint64_t kBlock = 1 << 14;
  facets.resize(indices.size());
  std::vector<double> areas(facets.size() / kBlock + 1), leaking(areas.size());  // of each block
  threads.for_blocks(facets.size(), kBlock, [&](uint64_t begin, uint64_t end) {
    for (uint64_t t = begin; t < end; ++t) {
      const Slenderness shape = slenderness_of(corner_positions(t));
      areas[begin / kBlock] += shape.area;
      if (shape.aspect > kLeaking) leaking[begin / kBlock] += shape.area;
      if (shape.aspect > kTurned) turn(t, shape.corner);
      Facet& facet = facets[t];
      facet.p = corner_positions(t);
      if (smooth)
        for (size_t k = 0; k < 3; ++k) facet.normals[k] = normals[corners[t][k]];
      facet.plane = plane_of(facet.p);
    }
  });
  needles = std::reduce(leaking.begin(), leaking.end()) > kSeenShare * std::reduce(areas.begin(), areas.end());
}

std::array<Vec3, 3> Mesh::corner_positions(uint64_t triangle) const {
  const auto& [a, b, c] = indices[triangle];
  return {positions[a], positions[b], positions[c]};
}

void Mesh::turn(uint64_t triangle, size_t first) {
  const auto to_front = [first](std::array<uint32_t, 3>& three) {
    std::rotate(three.begin(), three.begin() + static_cast<std::ptrdiff_t>(first), three.end());
  };
  to_front(indices[triangle]);
  if (!corners.empty()) to_front(corners[triangle]);
}

void Mesh::keep_facets_only() {
  normals = {};
  if (uvs.empty() && colors.empty()) corners = {};
}

uint64_t Mesh::memory() const {
  return facets.size() * sizeof(Facet) + positions.size() * sizeof(Vec3) + (indices.size() + corners.size()) * 12 + normals.size() * 4 +
         uvs.size() * 8 + colors.size() * 12 + slots.size() * 2;
}

}  // namespace sppm
