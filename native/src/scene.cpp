#include "scene.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace sppm {

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
  std::array<Vec3, 3> v = meshes_[instance.mesh]->facets[triangle].p;
  if (!instance.identity)
    for (Vec3& p : v) p = instance.transform.point(p);
  return v;
}

float Scene::reach(const Instance& instance, uint32_t triangle) const {
  float largest = 0;
  for (const Vec3 p : meshes_[instance.mesh]->facets[triangle].p) largest = std::max(largest, instance.transform.reach(p));
  return largest;
}

Vec3 Scene::normal(const Facet& facet, const Instance& instance, float u, float v) {
  const float w = 1 - u - v;
  const Vec3 n = unpack_direction(facet.normals[0]) * w + unpack_direction(facet.normals[1]) * u + unpack_direction(facet.normals[2]) * v;
  return instance.identity ? n : instance.transform.normal(n);
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

std::optional<Hit> Scene::trace(const Ray& ray) const {
  const auto hit = accel_.intersect(ray);
  if (hit) __builtin_prefetch(&meshes_[instances_[hit->instance].mesh]->facets[hit->triangle]);
  return hit;
}

SurfacePoint Scene::surface(const Ray& ray, const Hit& hit) const {
  SurfacePoint s;
  const Instance& instance = instances_[hit.instance];
  const Mesh& mesh = *meshes_[instance.mesh];
  const Facet& facet = mesh.facets[hit.triangle];
  const float u = hit.u, v = hit.v, w = 1 - u - v;
  const std::array<Vec3, 3> p = vertices(instance, hit.triangle);
  const Plane plane = instance.identity ? facet.plane : plane_of(p);
  s.p = p[0] * w + p[1] * u + p[2] * v;
  s.ng = is_black(plane.normal) ? -ray.direction : instance.flip ? -plane.normal : plane.normal;
  s.offset = clearance(instance.identity ? max_component(abs(s.p)) : reach(instance, hit.triangle)) + plane.slack;
  s.ns = s.ng;
  if (mesh.smooth) s.ns = shading_normal(normal(facet, instance, u, v), s.ng, -ray.direction);
  s.instance = hit.instance, s.triangle = hit.triangle;
  if (hit.t <= ray.touching.reach) s.touching = ray.touching;
  s.material = instance.materials[mesh.slot(hit.triangle)];
  if (has_attributes_) s.attributes = attributes(mesh, hit.triangle, u, v);
  return s;
}

std::optional<SurfacePoint> Scene::intersect(const Ray& ray) const {
  const auto hit = accel_.intersect(ray);
  return hit ? std::optional(surface(ray, *hit)) : std::nullopt;
}

Vec3 Scene::transmittance(Ray ray, uint64_t& rays) const {
  ++rays;
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

std::array<Vec3, Scene::kPacket> Scene::transmittance(std::span<const Ray> packet, uint64_t& rays) const {
  std::array<Vec3, kPacket> left;
  if (has_transparent_) {
    for (size_t i = 0; i < packet.size(); ++i) left[i] = transmittance(packet[i], rays);
    return left;
  }
  rays += packet.size();
  const uint32_t hidden = accel_.occluded(packet);
  for (size_t i = 0; i < packet.size(); ++i) left[i] = hidden >> i & 1 ? Vec3{} : Vec3{1, 1, 1};
  return left;
}

Bsdf Scene::bsdf(const SurfacePoint& s) const {
  Bsdf bsdf(ShadingPoint{s.ng, Frame(s.ns)});
  materials.lobes(s.material, s.attributes, bsdf);
  return bsdf;
}

EmittedLight Scene::emitted(const SurfacePoint& s, Vec3 wo, Vec3 from, float distance) const {
  const Instance& instance = instances_[s.instance];
  if (instance.light == kNone || instance.light_triangles[s.triangle] == kNone) return {};
  const float cosine = std::abs(dot(wo, s.ng)), facing = std::abs(dot(wo, s.ns));
  const float pdf_area = lights.triangle_pdf_area(instance.light, instance.light_triangles[s.triangle], from);
  return {materials.emission(s.material, s.attributes, facing), cosine > 0 ? pdf_area * square(distance) / cosine : 0.0f};
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
  for (const MovingInstance& m : moving_instances_) info.memory_bytes += sizeof m + m.motion.memory();
  for (const MovingLamp& m : moving_lamps_) info.memory_bytes += sizeof m + m.motion.memory();
  info.memory_bytes += camera_keys_.size() * sizeof(SppmCameraDesc) + camera_motion_.memory();
  info.has_specular = has_specular_, info.has_transparent = has_transparent_, info.has_textures = has_textures_;
  return info;
}

}  // namespace sppm
