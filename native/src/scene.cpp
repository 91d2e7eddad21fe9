#include "scene.h"

#include <algorithm>
#include <iterator>

#include "status.h"

namespace sppm {
namespace {

// The plane of a needle, whose edges are nearly parallel, is known worse by the ratio of their product to its area; beyond the last
// ratio it is not known at all.
constexpr float kNeedleUlps = 2 * 0x1p-23f, kLargestNeedle = 1e4f;
// A mesh is taken in the cells of a grid with so many to each axis of its box when it is looked for what throws caustics.
constexpr int kCasterCells = 16;

// Which cell of that grid holds a point of the box.
size_t caster_cell(const Bounds& box, Vec3 p) {
  size_t cell = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const float size = box.hi[axis] - box.lo[axis];
    const float place = size > 0 ? (p[axis] - box.lo[axis]) / size * kCasterCells : 0;
    cell = cell * kCasterCells + static_cast<size_t>(std::clamp(static_cast<int>(place), 0, kCasterCells - 1));
  }
  return cell;
}

// At the rims of smooth-shaded meshes the interpolated normal may face away from where the surface is seen from, and nothing would scatter
// that way: it is bent until it just faces w, as much as ng does.
Vec3 seen_from(Vec3 w, Vec3 ns, Vec3 ng) {
  constexpr float kLeast = 1e-3f;
  const float geometric = dot(ng, w), least = std::copysign(std::min(kLeast, std::abs(geometric)), geometric), shading = dot(ns, w);
  return shading * least >= square(least) ? ns : normalize(ns + w * (least - shading));
}

Bounds transformed(const Bounds& b, const Affine& transform) {
  Bounds result;
  for (int corner = 0; corner < 8; ++corner)
    result.add(transform.point({corner & 1 ? b.hi.x : b.lo.x, corner & 2 ? b.hi.y : b.lo.y, corner & 4 ? b.hi.z : b.lo.z}));
  return result;
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

uint32_t Scene::add_mesh(const SppmMeshDesc& desc) {
  meshes_.push_back(std::make_unique<Mesh>(desc));
  return static_cast<uint32_t>(meshes_.size());
}

uint32_t Scene::add_instance(const SppmInstanceDesc& desc) {
  const std::string where = std::string("instance '") + (desc.name ? desc.name : "") + "': ";
  require(desc.mesh >= 1 && desc.mesh <= meshes_.size(), where + "mesh " + std::to_string(desc.mesh) + " is not of this scene");
  require(desc.materials && desc.material_count >= meshes_[desc.mesh - 1]->slot_count,
          where + "material_count must be at least " + std::to_string(meshes_[desc.mesh - 1]->slot_count));
  Instance instance;
  instance.mesh = desc.mesh - 1;
  for (const float m : desc.transform) require(std::isfinite(m), where + "transform must be finite");
  std::copy(desc.transform, desc.transform + 12, instance.transform.m.begin());
  instance.flip = instance.transform.determinant() < 0;
  require(desc.flags <= (SPPM_INSTANCE_HOLDOUT | SPPM_INSTANCE_HIDDEN_FROM_CAMERA), where + "flags must be SppmInstanceFlags");
  instance.holdout = desc.flags & SPPM_INSTANCE_HOLDOUT, instance.hidden_from_camera = desc.flags & SPPM_INSTANCE_HIDDEN_FROM_CAMERA;
  instance.index = desc.index;
  for (uint32_t i = 0; i < desc.material_count; ++i) {
    require(desc.materials[i] >= 1 && desc.materials[i] <= materials.count(),
            where + "material " + std::to_string(desc.materials[i]) + " is not of this scene");
    instance.materials.push_back(desc.materials[i]);
  }
  instances_.push_back(std::move(instance));
  return static_cast<uint32_t>(instances_.size());
}

void Scene::set_camera(const SppmCameraDesc& desc) {
  camera = Camera(desc);
  has_camera_ = true;
}

// A mesh that one instance uses is moved to world space: a ray is then not transformed on its way. An instance that is squeezed flat,
// or nearly so, gets its own copy for that, for no ray can be transformed back into it.
void Scene::move_single_meshes() {
  std::vector<uint32_t> uses(meshes_.size(), 0);
  for (const Instance& i : instances_) ++uses[i.mesh];
  for (Instance& i : instances_) {
    if (uses[i.mesh] != 1 && can_be_instanced(i.transform)) continue;
    if (uses[i.mesh] != 1) {
      meshes_.push_back(std::make_unique<Mesh>(*meshes_[i.mesh]));
      i.mesh = static_cast<uint32_t>(meshes_.size() - 1);
    }
    meshes_[i.mesh]->transform(i.transform);
    i.transform = {};
    i.identity = true;
  }
}

void Scene::collect_emitters(Instance& instance) {
  bool emits = false;
  for (const uint32_t m : instance.materials) emits |= materials.emits(m);
  if (!emits) return;
  const Mesh& mesh = *meshes_[instance.mesh];
  std::vector<EmissiveTriangle> triangles;
  instance.light_triangles.assign(mesh.indices.size(), kNone);
  for (uint32_t t = 0; t < mesh.indices.size(); ++t) {
    const uint32_t material = instance.materials[mesh.slot(t)];
    if (!materials.emits(material)) continue;
    instance.light_triangles[t] = static_cast<uint32_t>(triangles.size());
    triangles.push_back({vertices(instance, t), {attributes(mesh, t, 0, 0), attributes(mesh, t, 1, 0), attributes(mesh, t, 0, 1)}, material,
                         reach(instance, t)});
  }
  if (!triangles.empty()) instance.light = lights.add_triangles(std::move(triangles));
}

void Scene::collect_casters(const Instance& instance, std::vector<Caster>& casters) const {
  float strongest = 0;
  for (const uint32_t m : instance.materials) strongest = std::max(strongest, materials.caster_strength(m));
  if (strongest == 0) return;
  const Mesh& mesh = *meshes_[instance.mesh];
  if (!instance.identity) {  // a whole instance is one: there may be thousands
    casters.push_back({transformed(mesh.bounds, instance.transform), strongest});
    return;
  }
  // By place and not by index: where the rows of a sheet follow each other, one end is next to the other.
  std::vector<Caster> cells(kCasterCells * kCasterCells * kCasterCells);
  for (size_t t = 0; t < mesh.indices.size(); ++t) {
    const float strength = materials.caster_strength(instance.materials[mesh.slot(static_cast<uint32_t>(t))]);
    if (strength == 0) continue;
    Bounds triangle;
    for (const uint32_t vertex : mesh.indices[t]) triangle.add(mesh.positions[vertex]);
    Caster& cell = cells[caster_cell(mesh.bounds, triangle.center())];
    cell.bounds.add(triangle);
    cell.strength = std::max(cell.strength, strength);
  }
  std::copy_if(cells.begin(), cells.end(), std::back_inserter(casters), [](const Caster& c) { return c.strength > 0; });
}

void Scene::commit(const Threads& threads) {
  if (committed_) throw Error(SPPM_INVALID_STATE, "the scene is committed already");
  if (!has_camera_) throw Error(SPPM_INVALID_STATE, "the scene has no camera");
  move_single_meshes();
  std::vector<Placement> placements;
  for (Instance& i : instances_) {
    placements.push_back({meshes_[i.mesh].get(), i.transform, i.identity, i.hidden_from_camera});
    has_attributes_ |= !meshes_[i.mesh]->uvs.empty() || !meshes_[i.mesh]->colors.empty();
    triangle_count_ += meshes_[i.mesh]->indices.size();
    for (const uint32_t m : i.materials) {
      has_transparent_ |= materials.transparent(m);
      has_specular_ |= materials.caster_strength(m) > 0;
      has_textures_ |= materials.textured(m);
    }
  }
  threads.for_each(1, [&](uint64_t) { accel_.build(placements); });
  std::vector<Caster> casters;
  for (Instance& i : instances_) {
    collect_emitters(i);
    collect_casters(i, casters);
  }
  Targets targets;
  targets.build(std::move(casters));
  lights.commit(accel_.bounds(), std::move(targets));
  committed_ = true;
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
