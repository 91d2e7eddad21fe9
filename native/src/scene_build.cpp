// Putting a scene together: the ray tracer, the lights and the targets follow from instances and lamps.
#include <algorithm>
#include <cmath>
#include <iterator>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "scene.h"
#include "status.h"

namespace sppm {
namespace {

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

Bounds transformed(const Bounds& b, const Affine& transform) {
  Bounds result;
  for (int corner = 0; corner < 8; ++corner)
    result.add(transform.point({corner & 1 ? b.hi.x : b.lo.x, corner & 2 ? b.hi.y : b.lo.y, corner & 4 ? b.hi.z : b.lo.z}));
  return result;
}

}  // namespace

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
  instance.mesh = instance.shape = desc.mesh - 1;
  for (const float m : desc.transform) require(std::isfinite(m), where + "transform must be finite");
  std::copy(desc.transform, desc.transform + 12, instance.placed.m.begin());
  instance.movable = desc.movable != 0 || desc.motion_count > 0;
  require(desc.flags <= (SPPM_INSTANCE_HOLDOUT | SPPM_INSTANCE_HIDDEN_FROM_CAMERA), where + "flags must be SppmInstanceFlags");
  instance.holdout = desc.flags & SPPM_INSTANCE_HOLDOUT, instance.hidden_from_camera = desc.flags & SPPM_INSTANCE_HIDDEN_FROM_CAMERA;
  instance.index = desc.index;
  for (uint32_t i = 0; i < desc.material_count; ++i) {
    require(desc.materials[i] >= 1 && desc.materials[i] <= materials.count(),
            where + "material " + std::to_string(desc.materials[i]) + " is not of this scene");
    instance.materials.push_back(desc.materials[i]);
  }
  add_motion(static_cast<uint32_t>(instances_.size()), desc, where);
  instances_.push_back(std::move(instance));
  return static_cast<uint32_t>(instances_.size());
}

void Scene::commit(const Threads& threads) {
  if (committed_) throw Error(SPPM_INVALID_STATE, "the scene is committed already");
  if (!has_camera_) throw Error(SPPM_INVALID_STATE, "the scene has no camera");
  std::vector<uint32_t> uses(meshes_.size(), 0);
  for (const Instance& i : instances_) ++uses[i.shape];
  std::vector<Placement> placements;
  for (Instance& i : instances_) {
    i.alone = uses[i.shape] == 1;
    settle(i);
  }
  for (const auto& mesh : meshes_) mesh->make_facets(threads);
  for (const Instance& i : instances_) {
    placements.push_back(placement(i));
    has_attributes_ |= !meshes_[i.mesh]->uvs.empty() || !meshes_[i.mesh]->colors.empty();
    triangle_count_ += meshes_[i.mesh]->indices.size();
    for (const uint32_t m : i.materials) {
      has_transparent_ |= materials.transparent(m);
      has_specular_ |= materials.caster_strength(m) > 0;
      has_textures_ |= materials.textured(m);
    }
  }
  threads.for_each(1, [&](uint64_t) { accel_.build(placements); });
  for (Instance& i : instances_) {
    collect_emitters(i);
    std::vector<Caster> casters = casters_of(i);
    if (i.movable)
      i.casters = std::move(casters);
    else
      still_casters_.insert(still_casters_.end(), casters.begin(), casters.end());
  }
  commit_lights();
  std::vector<bool> may_change(meshes_.size(), false);
  for (const Instance& i : instances_)
    if (i.movable) may_change[i.shape] = true;
  for (size_t m = 0; m < meshes_.size(); ++m)
    if (!may_change[m]) meshes_[m]->keep_facets_only();
  committed_ = true;
}

// A mesh that one instance uses and that never moves is moved to world space: a ray is then not transformed on its way. An instance that
// is squeezed flat, or nearly so, gets its own copy for that, for no ray can be transformed back into it.
void Scene::settle(Instance& i) {
  i.flip = i.placed.determinant() < 0;
  const bool own = i.alone && !i.movable;
  i.identity = own || !can_be_instanced(i.placed);
  if (!i.identity) {
    i.mesh = i.shape, i.transform = i.placed;
    return;
  }
  if (!own) {
    auto copy = std::make_unique<Mesh>(*meshes_[i.shape]);
    if (i.squeezed == kNone) {
      meshes_.push_back(std::move(copy));
      i.squeezed = static_cast<uint32_t>(meshes_.size() - 1);
    } else {
      meshes_[i.squeezed] = std::move(copy);
    }
    i.mesh = i.squeezed;
  }
  meshes_[i.mesh]->transform(i.placed);
  i.transform = {};
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
    EmissiveTriangle& added = triangles.emplace_back();
    added.p = vertices(instance, t);
    added.attributes = {attributes(mesh, t, 0, 0), attributes(mesh, t, 1, 0), attributes(mesh, t, 0, 1)};
    added.material = material;
    added.reach = reach(instance, t);
    if (!mesh.smooth || !materials.emits_through_coat(material)) continue;
    const Facet& facet = mesh.facets[t];
    added.normals = {normal(facet, instance, 0, 0), normal(facet, instance, 1, 0), normal(facet, instance, 0, 1)};
  }
  if (triangles.empty()) return;
  if (instance.light == kNone)
    instance.light = lights.add_triangles(std::move(triangles));
  else
    lights.set_triangles(instance.light, std::move(triangles));
}

// In world space or, of what can move, in that of its mesh.
std::vector<Caster> Scene::casters_of(const Instance& instance) const {
  float strongest = 0;
  for (const uint32_t m : instance.materials) strongest = std::max(strongest, materials.caster_strength(m));
  if (strongest == 0) return {};
  const Mesh& mesh = *meshes_[instance.movable ? instance.shape : instance.mesh];
  // A whole instance of a mesh that stands in many places is one: there may be thousands.
  if (!instance.alone && instance.movable) return {{mesh.bounds, strongest}};
  if (!instance.identity && !instance.movable) return {{transformed(mesh.bounds, instance.transform), strongest}};
  // By place and not by index: where the rows of a sheet follow each other, one end is next to the other.
  std::vector<Caster> cells(kCasterCells * kCasterCells * kCasterCells), casters;
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
  return casters;
}

void Scene::commit_lights() {
  std::vector<Caster> casters = still_casters_;
  for (const Instance& i : instances_)
    for (const Caster& c : i.casters) casters.push_back({transformed(c.bounds, i.placed), c.strength});
  Targets targets;
  targets.build(std::move(casters));
  lit_bounds_ = accel_.bounds();
  lights.commit(lit_bounds_, std::move(targets));
}

}  // namespace sppm
