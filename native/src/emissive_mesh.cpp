#include "emissive_mesh.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "color.h"
#include "mesh.h"

namespace sppm {
namespace {

constexpr uint64_t kMostLooks = 1 << 16;  // at the textures of one emitting mesh, to know where it is bright

// The cosine at which a point of a triangle is seen from the unit vector w, to the shading normal.
float facing(const EmissiveTriangle& t, Vec2 b, Vec3 w) {
  const Vec3 interpolated = t.normals[0] * (1 - b.x - b.y) + t.normals[1] * b.x + t.normals[2] * b.y;
  return std::abs(dot(w, shading_normal(interpolated, unit_normal(t.p[1] - t.p[0], t.p[2] - t.p[0]), w)));
}

}  // namespace

EmissiveMesh::EmissiveMesh(std::vector<EmissiveTriangle> given, const Materials* its_materials)
    : triangles(std::move(given)), materials(its_materials) {
  // A textured triangle is looked at in a few places, a coated one from a few sides, more where triangles are few; the least weight keeps
  // possible what they missed of a texture.
  const uint64_t looks = std::clamp<uint64_t>(kMostLooks / std::max<size_t>(triangles.size(), 1), 4, 4096);
  std::vector<double> weights;
  for (EmissiveTriangle& t : triangles) {
    for (const Vec3 p : t.p) t.reach = std::max(t.reach, max_component(abs(p)));
    t.area = area_of(t.p);
    const uint64_t n = materials->textured(t.material) || materials->emits_through_coat(t.material) ? looks : 1;
    const Frame frame(unit_normal(t.p[1] - t.p[0], t.p[2] - t.p[0]));
    double brightness = 0;  // the mean over area and directions
    for (uint64_t k = 0; k < n; ++k) {
      const Sample4 u = Sampler(0, k).next();
      const Vec3 w = frame.to_world(sample_cosine_hemisphere(u.second()));
      brightness += static_cast<double>(luminance(radiance(t, sample_triangle(u.first()), w)));
    }
    weights.push_back(t.area * brightness / static_cast<double>(n));
  }
  double total_area = 0, total = 0;
  for (size_t i = 0; i < triangles.size(); ++i) total_area += triangles[i].area, total += weights[i];
  if (total > 0)
    for (size_t i = 0; i < triangles.size(); ++i)
      if (materials->textured(triangles[i].material)) weights[i] += 0.01 * total * triangles[i].area / total_area;
  choice = Distribution(weights);
}

LightBounds EmissiveMesh::bounds() const {
  Bounds box;
  for (const EmissiveTriangle& t : triangles)
    for (const Vec3 p : t.p) box.add(p);
  LightBounds b;
  b.center = box.center(), b.radius = box.radius();
  b.intensity = static_cast<float>(choice.total());
  return b;
}

Vec3 EmissiveMesh::radiance(const EmissiveTriangle& t, Vec2 b, Vec3 w) const {
  const float a = 1 - b.x - b.y;
  SurfaceAttributes at;
  at.uv = {t.attributes[0].uv.x * a + t.attributes[1].uv.x * b.x + t.attributes[2].uv.x * b.y,
           t.attributes[0].uv.y * a + t.attributes[1].uv.y * b.x + t.attributes[2].uv.y * b.y};
  at.color = t.attributes[0].color * a + t.attributes[1].color * b.x + t.attributes[2].color * b.y;
  return materials->emission(t.material, at, materials->emits_through_coat(t.material) ? facing(t, b, w) : 1.0f);
}

std::optional<DirectSample> EmissiveMesh::sample_direct(Vec3 p, Vec2 u, float pick) const {
  const size_t i = choice.sample(pick);
  const EmissiveTriangle& t = triangles[i];
  const Vec2 b = sample_triangle(u);
  const Vec3 point = t.at(b), to_point = point - p;
  const float distance2 = length_squared(to_point);
  const Vec3 e1 = t.p[1] - t.p[0], e2 = t.p[2] - t.p[0], normal = unit_normal(e1, e2);
  if (distance2 <= 0) return std::nullopt;
  DirectSample s;
  s.distance = std::sqrt(distance2);
  s.wi = to_point / s.distance;
  const float cosine = std::abs(dot(s.wi, normal));
  if (!(cosine > 0)) return std::nullopt;
  s.pdf = choice.probability(i) * distance2 / (cosine * static_cast<float>(t.area));
  s.radiance = radiance(t, b, -s.wi);
  // The rounding of p, where the ray begins, is carried along to its end.
  const float short_of = clearance(std::max(t.reach, max_component(abs(p))), e1, e2);
  s.end = point + face_toward(normal, -to_point) * short_of;
  return s;
}

float EmissiveMesh::pdf_area(uint32_t triangle, float probability) const {
  return probability * choice.probability(triangle) / static_cast<float>(triangles[triangle].area);
}

}  // namespace sppm
