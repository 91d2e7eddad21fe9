#include "scene.h"

#include <algorithm>

namespace sppm {
namespace {

// The plane of a needle, whose edges are nearly parallel, is known worse by the ratio of their product to its area; beyond the last
// ratio it is not known at all.
constexpr float kNeedleUlps = 2 * 0x1p-23f, kLargestNeedle = 1e4f;

// At the rims of smooth-shaded meshes the interpolated normal may face away from where the surface is seen from, and nothing would scatter
// that way: it is bent until it just faces w, as much as ng does.
Vec3 seen_from(Vec3 w, Vec3 ns, Vec3 ng) {
  constexpr float kLeast = 1e-3f;
  const float geometric = dot(ng, w), least = std::copysign(std::min(kLeast, std::abs(geometric)), geometric), shading = dot(ns, w);
  return shading * least >= square(least) ? ns : normalize(ns + w * (least - shading));
}

}  // namespace

Ray SurfacePoint::spawn_at_border(Vec3 from, Vec3 w, float far) const {
  Touching there = touching;
  const Face face{instance, triangle};
  const bool through = dot(from, ng) * dot(w, ng) < 0;
  if (there.rule == Touching::Rule::kOnlyThese) {
    there.remove(face);  // on the way back; light reflected a third time between the same two faces takes the short way out
    if (!through || there.count == 0) return spawn(w, far);
  } else if (through) {
    there.rule = Touching::Rule::kNotThese;
    there.add(face);
  } else {
    if (there.count == 0) return spawn(w, far);
    there.rule = Touching::Rule::kOnlyThese;  // back through those that it has come through
  }
  const float before = offset / std::max(std::abs(dot(ng, w)), 0.1f);
  there.reach = 2 * before;
  return {.origin = p - w * before, .direction = w, .far = far + before, .touching = there};
}

std::array<Vec3, 3> Scene::vertices(const Instance& instance, uint32_t triangle) const {
  const Mesh& mesh = *meshes_[instance.mesh];
  const auto& index = mesh.indices[triangle];
  std::array<Vec3, 3> v{mesh.positions[index[0]], mesh.positions[index[1]], mesh.positions[index[2]]};
  if (!instance.identity)
    for (Vec3& p : v) p = instance.transform.point(p);
  return v;
}

float Scene::reach(const Instance& instance, uint32_t triangle) const {
  const Mesh& mesh = *meshes_[instance.mesh];
  float largest = 0;
  for (const uint32_t index : mesh.indices[triangle]) largest = std::max(largest, instance.transform.reach(mesh.positions[index]));
  return largest;
}

SurfaceAttributes Scene::attributes(const Mesh& mesh, uint32_t triangle, float u, float v) const {
  SurfaceAttributes at;
  if (mesh.uvs.empty() && mesh.colors.empty()) return at;
  const auto& c = mesh.corners[triangle];
  const float w = 1 - u - v;
  if (!mesh.uvs.empty()) {
    const Vec2 a = mesh.uvs[c[0]], b = mesh.uvs[c[1]], d = mesh.uvs[c[2]];
    at.uv = {a.x * w + b.x * u + d.x * v, a.y * w + b.y * u + d.y * v};
  }
  if (!mesh.colors.empty()) at.color = mesh.colors[c[0]] * w + mesh.colors[c[1]] * u + mesh.colors[c[2]] * v;
  return at;
}

std::optional<SurfacePoint> Scene::intersect(const Ray& ray) const {
  const auto hit = accel_.intersect(ray);
  if (!hit) return std::nullopt;
  const Instance& instance = instances_[hit->instance];
  const Mesh& mesh = *meshes_[instance.mesh];
  const auto v = vertices(instance, hit->triangle);
  const Vec3 e1 = v[1] - v[0], e2 = v[2] - v[0];
  // In units of the longer edge: products of very long or very short ones leave the range of floats.
  const float size = max_component(max(abs(e1), abs(e2)));
  const Vec3 a = e1 / size, b = e2 / size, normal = cross(a, b);
  const float l = length(normal);
  const float needle = std::min(std::sqrt(length_squared(a) * length_squared(b)) / l, kLargestNeedle);
  SurfacePoint s;
  s.p = v[0] * (1 - hit->u - hit->v) + v[1] * hit->u + v[2] * hit->v;
  s.ng = l > 0 ? normal / (instance.flip ? -l : l) : -ray.direction;
  s.offset = clearance(instance.identity ? max_component(abs(s.p)) : reach(instance, hit->triangle), e1, e2) +
             (l > 0 ? kNeedleUlps * size * needle : 0.0f);
  s.ns = s.ng;
  if (!mesh.normals.empty()) {
    const auto& c = mesh.corners[hit->triangle];
    const Vec3 n = unpack_direction(mesh.normals[c[0]]) * (1 - hit->u - hit->v) + unpack_direction(mesh.normals[c[1]]) * hit->u +
                   unpack_direction(mesh.normals[c[2]]) * hit->v;
    const Vec3 world = instance.identity ? n : instance.transform.normal(n);
    const float world_length = length(world);
    if (world_length > 0) s.ns = seen_from(-ray.direction, face_toward(world / world_length, s.ng), s.ng);
  }
  s.instance = hit->instance, s.triangle = hit->triangle;
  if (hit->t <= ray.touching.reach) s.touching = ray.touching;
  s.material = instance.materials[mesh.slot(hit->triangle)];
  if (has_attributes_) s.attributes = attributes(mesh, hit->triangle, hit->u, hit->v);
  return s;
}

Vec3 Scene::transmittance(Ray ray, uint64_t& rays) const {
  ++rays;
  if (!has_transparent_) return accel_.occluded(ray) ? Vec3{} : Vec3{1, 1, 1};
  Vec3 left{1, 1, 1};
  const Vec3 direction = ray.direction, end = ray.origin + ray.direction * ray.far;
  for (int i = 0; i < kMostPasses; ++i) {
    const auto s = intersect(ray);
    if (!s) return left;
    left *= transparency(*s);
    if (is_black(left)) return {};
    const float rest = std::isfinite(ray.far) ? dot(end - s->p, direction) : kInfinity;
    if (!(rest > 0)) return left;  // the surface is where the ray ends
    ray = s->spawn_at_border(-direction, direction, rest);
    ++rays;
  }
  return {};
}

Bsdf Scene::bsdf(const SurfacePoint& s) const {
  Bsdf bsdf(ShadingPoint{s.ng, Frame(s.ns)});
  materials.lobes(s.material, s.attributes, bsdf);
  return bsdf;
}

EmittedLight Scene::emitted(const SurfacePoint& s, Vec3 wo, Vec3 from, float distance) const {
  const Instance& instance = instances_[s.instance];
  if (instance.light == kNone || instance.light_triangles[s.triangle] == kNone) return {};
  const float cosine = std::abs(dot(wo, s.ng));
  const float pdf_area = lights.triangle_pdf_area(instance.light, instance.light_triangles[s.triangle], from);
  return {materials.emission(s.material, s.attributes), cosine > 0 ? pdf_area * square(distance) / cosine : 0.0f};
}

SppmSceneInfo Scene::info() const {
  SppmSceneInfo info{};
  info.struct_size = sizeof info;
  info.triangle_count = triangle_count_;
  info.instance_count = instances_.size();
  info.light_count = lights.count();
  info.light_power = lights.power();
  const Bounds b = accel_.bounds();
  for (int i = 0; i < 3 && !b.empty(); ++i) {
    info.bounds_min[i] = static_cast<double>(b.lo[i]);
    info.bounds_max[i] = static_cast<double>(b.hi[i]);
  }
  info.memory_bytes = accel_.memory() + textures.memory();
  for (const auto& mesh : meshes_) info.memory_bytes += mesh->memory();
  info.has_specular = has_specular_, info.has_transparent = has_transparent_, info.has_textures = has_textures_;
  return info;
}

}  // namespace sppm
