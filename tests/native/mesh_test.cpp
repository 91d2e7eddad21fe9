#include <cmath>
#include <limits>

#include "mesh.h"

#include <doctest/doctest.h>

#include "status.h"

using namespace sppm;

namespace {

const float kPositions[] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
const uint32_t kIndices[] = {0, 1, 2};

SppmMeshDesc triangle() {
  SppmMeshDesc d{};
  d.struct_size = sizeof d;
  d.vertex_count = 3, d.triangle_count = 1;
  d.positions = kPositions, d.indices = kIndices, d.name = "Suzanne";
  return d;
}

std::string message(const SppmMeshDesc& d) {
  try {
    Mesh mesh(d);
  } catch (const Error& e) {
    CHECK(e.status() == SPPM_INVALID_ARGUMENT);
    return e.what();
  }
  return "";
}

bool has(const std::string& text, const char* part) { return text.find(part) != std::string::npos; }

}  // namespace

TEST_CASE("a mesh keeps what it was given") {
  SppmMeshDesc d = triangle();
  const float normals[] = {0, 0, 2, 0, 1, 0, 0, 0, 0}, uvs[] = {0, 0, 1, 0, 0, 1}, colors[] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  const uint32_t slots[] = {3};
  d.corner_count = 3, d.corners = kIndices, d.corner_normals = normals, d.corner_uvs = uvs, d.corner_colors = colors;
  d.material_slots = slots;
  const Mesh mesh(d);
  CHECK(mesh.positions[1] == Vec3{1, 0, 0});
  CHECK(mesh.slot(0) == 3);
  CHECK(mesh.slot_count == 4);
  CHECK(length(unpack_direction(mesh.normals[0]) - Vec3{0, 0, 1}) < 1e-4f);  // made unit
  CHECK(is_finite(unpack_direction(mesh.normals[2])));                       // was zero
  CHECK(mesh.uvs[1].x == 1);
  CHECK(mesh.colors[2] == Vec3{0, 0, 1});
  CHECK(Mesh(triangle()).slot(0) == 0);
}

TEST_CASE("bad meshes are refused by name, array and index") {
  SppmMeshDesc d = triangle();
  const uint32_t beyond[] = {0, 1, 3};
  d.indices = beyond;
  CHECK(has(message(d), "Suzanne"));
  CHECK(has(message(d), "indices of triangle 0 is 3"));
  d = triangle(), d.corner_count = 3, d.corner_uvs = kPositions, d.corners = beyond;
  CHECK(has(message(d), "corners of triangle 0 is 3"));
  d.corners = nullptr;
  CHECK(has(message(d), "corners"));
  d = triangle(), d.triangle_count = 0;
  CHECK(has(message(d), "triangle_count"));
  d = triangle(), d.positions = nullptr;
  CHECK(has(message(d), "positions"));
  const float nan[] = {0, 0, 0, 1, std::numeric_limits<float>::quiet_NaN(), 0, 0, 1, 0};
  d = triangle(), d.positions = nan;
  CHECK(has(message(d), "vertex 1"));
  const uint32_t slot[] = {70000};
  d = triangle(), d.material_slots = slot;
  CHECK(has(message(d), "slot"));
  d = triangle(), d.vertex_count = uint64_t{1} << 40;
  CHECK(has(message(d), "2^31"));
}

TEST_CASE("packed directions are off by less than 7e-5 radians") {
  for (int i = 0; i < 20000; ++i) {
    const float z = 1 - 2 * (static_cast<float>(i) + 0.5f) / 20000, phi = static_cast<float>(i) * 2.4f, r = std::sqrt(1 - z * z);
    const Vec3 v{r * std::cos(phi), r * std::sin(phi), z};
    CHECK(length(unpack_direction(pack_direction(v)) - v) < 7e-5f);
  }
  for (const Vec3 v : {Vec3{1, 0, 0}, Vec3{0, -1, 0}, Vec3{0, 0, -1}, Vec3{0, 0, 1}})
    CHECK(length(unpack_direction(pack_direction(v)) - v) < 7e-5f);
}

TEST_CASE("slender triangles begin at their short side or their flat corner, others stay as they are") {
  constexpr float kThin = 1e-6f;
  // A needle and a cap, each from every corner, and two triangles that are no slivers.
  const float positions[] = {0, 0, 0, 1, 0, 0, 0, kThin, 0, 0.5f, kThin, 0, 0, 1, 0};
  const uint32_t indices[] = {0, 1, 2, 1, 2, 0, 2, 0, 1, 0, 1, 3, 1, 3, 0, 3, 0, 1, 0, 1, 4, 1, 4, 0};
  SppmMeshDesc d = triangle();
  d.positions = positions, d.vertex_count = 5, d.indices = indices, d.triangle_count = 8;
  std::array<float, 10> uvs{};
  d.corner_uvs = uvs.data(), d.corner_count = 5, d.corners = indices;
  Mesh mesh(d);
  mesh.make_facets(Threads(1));
  using Corners = std::array<uint32_t, 3>;
  for (size_t t = 0; t < 3; ++t) CHECK(mesh.indices[t][0] != 1);  // the short side is from 0 to 2; which of its ends, rounding decides
  for (size_t t = 3; t < 6; ++t) CHECK(mesh.indices[t] == Corners{3, 0, 1});
  CHECK(mesh.indices[6] == Corners{0, 1, 4});
  CHECK(mesh.indices[7] == Corners{1, 4, 0});
  CHECK(mesh.corners == mesh.indices);
  for (const Facet& facet : mesh.facets) CHECK(facet.plane.normal == Vec3{0, 0, 1});
}

TEST_CASE("the ray tracer takes care where needles are a part of a mesh that is seen") {
  const float positions[] = {0, 0, 0, 1, 0, 0, 0, 1e-5f, 0, 0, 1, 0, 0.5f, 0, 0};
  const uint32_t indices[] = {0, 1, 2, 0, 1, 3, 0, 1, 4};  // a needle, a triangle, and one without area
  const auto has_needles = [&](uint64_t first, uint64_t count) {
    SppmMeshDesc d = triangle();
    d.positions = positions, d.vertex_count = 5, d.indices = indices + 3 * first, d.triangle_count = count;
    Mesh mesh(d);
    mesh.make_facets(Threads(1));
    return mesh.needles;
  };
  CHECK(has_needles(0, 1));
  CHECK_FALSE(has_needles(0, 3));
  CHECK_FALSE(has_needles(1, 2));
  CHECK_FALSE(has_needles(2, 1));
}
