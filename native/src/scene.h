// The scene: everything that is to be lit. Once committed, what is in it stays; only places, lamps and the camera may change.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "accel.h"
#include "camera.h"
#include "light.h"
#include "material.h"
#include "mesh.h"
#include "motion.h"
#include "parallel.h"
#include "texture.h"

namespace sppm {

// After this many transparent surfaces in a row light counts as stopped.
inline constexpr int kMostPasses = 256;

// Where a ray met a surface.
struct SurfacePoint {
  Vec3 p;
  Vec3 ng, ns;         // unit, outward; ns on ng's side
  float offset = 0;    // how far above or below p a ray must start to clear this surface
  uint32_t material = 0;
  uint32_t instance = 0, triangle = 0;
  SurfaceAttributes attributes;
  Touching touching;   // of the ray that came here, if it came from another surface in the same place

  // A ray that leaves along the unit vector w on the side that w is on.
  Ray spawn(Vec3 w, float far = kInfinity) const { return {.origin = start(w), .direction = w, .far = far}; }
  // A ray that ends at `end`.
  Ray spawn_to(Vec3 end) const {
    const Vec3 origin = start(end - p), way = end - origin;
    const float distance = length(way);
    return {.origin = origin, .direction = distance > 0 ? way / distance : ng, .far = distance};
  }
  // A ray along w where the one before has come from `from` and goes on through the borders of its medium: none that lies in the same
  // place as this surface is left out, as it would be by `spawn`.
  Ray spawn_at_border(Vec3 from, Vec3 w, float far = kInfinity) const;

 private:
  Vec3 start(Vec3 toward) const { return p + ng * std::copysign(offset, dot(ng, toward)); }
};

class Scene {
 public:
  Scene() : materials(&textures), lights(&textures, &materials) {}

  uint32_t add_mesh(const SppmMeshDesc& desc);
  uint32_t add_instance(const SppmInstanceDesc& desc);
  uint32_t add_lamp(const SppmLightDesc& desc);
  void set_camera(const SppmCameraDesc& desc);  // at any time
  void set_camera_motion(std::span<const SppmCameraDesc> keys);  // over the shutter
  void commit(const Threads& threads);
  bool committed() const { return committed_; }

  // Of a committed scene, for `update` to carry out. A scene is then the same as one built with everything in its new place.
  void move_instance(uint32_t id, const float transform[12]);  // throws Error unless it was added `movable`
  void set_lamp(uint32_t id, const SppmLightDesc& desc);
  void update(const Threads& threads);

  // True if anything moves while the shutter is open. Then sessions take turns: each holds `turn` while it relies on the time it has set.
  bool moves() const { return !moving_instances_.empty() || !moving_lamps_.empty() || !camera_keys_.empty(); }
  void set_time(double time, const Threads& threads);  // 0 where the shutter opens, 1 where it closes
  std::mutex turn;

  // Where the ray meets a surface, and what is there: two steps, so that many rays can be traced before the first surface is asked for,
  // whose data is then on its way from memory.
  std::optional<Hit> trace(const Ray& ray) const;
  SurfacePoint surface(const Ray& ray, const Hit& hit) const;
  std::optional<SurfacePoint> intersect(const Ray& ray) const;
  // What is left of light along the ray: 1 where nothing stands in its way, 0 behind anything opaque. Adds the rays traced.
  Vec3 transmittance(Ray ray, uint64_t& rays) const;
  // The same for a packet of rays, the faster the nearer they are to each other.
  static constexpr size_t kPacket = Accel::kPacket;
  std::array<Vec3, kPacket> transmittance(std::span<const Ray> packet, uint64_t& rays) const;
  Bsdf bsdf(const SurfacePoint& s) const;
  // Radiance that the surface emits toward a ray of direction -wo that was scattered at `from`, `distance` away, with the pdf of direct
  // light there.
  EmittedLight emitted(const SurfacePoint& s, Vec3 wo, Vec3 from, float distance) const;
  Vec3 transparency(const SurfacePoint& s) const {
    return materials.transparent(s.material) ? materials.transparency(s.material, s.attributes) : Vec3{};
  }
  SppmSceneInfo info() const;
  bool has_transparent() const { return has_transparent_; }
  bool is_holdout(const SurfacePoint& s) const { return instances_[s.instance].holdout; }
  uint32_t object_index(const SurfacePoint& s) const { return instances_[s.instance].index; }
  bool has_uv(const SurfacePoint& s) const { return !meshes_[instances_[s.instance].mesh]->uvs.empty(); }

  Textures textures;
  Materials materials;
  Lights lights;
  Camera camera;

 private:
  static constexpr uint32_t kNone = ~0u;
  struct Instance {
    uint32_t mesh;          // with `transform`, what is seen
    Affine transform;
    bool flip = false;      // it is mirrored, so the winding's normal points inward
    bool identity = false;  // the mesh was moved to world space
    bool movable = false;
    bool alone = false;     // no other instance has its shape
    uint32_t shape;            // the mesh as it was given, and where it stands
    Affine placed;
    uint32_t squeezed = kNone;  // mesh: its copy in world space while it is too flat to be an instance
    bool holdout = false, hidden_from_camera = false;
    uint32_t index = 0;
    std::vector<uint32_t> materials;
    uint32_t light = kNone;                 // set of emissive triangles
    std::vector<uint32_t> light_triangles;  // triangle -> index in that set, kNone where it does not emit
    std::vector<Caster> casters;            // of what can move, in its shape's space
  };
  struct MovingInstance {
    uint32_t index;
    Motion motion;
  };
  struct MovingLamp {
    uint32_t id;
    SppmLightDesc lamp;
    Motion motion;
  };
  void add_motion(uint32_t instance, const SppmInstanceDesc& desc, const std::string& where);
  static std::optional<MovingLamp> moving_lamp(const SppmLightDesc& desc);  // throws Error; its id is not known yet
  void move(uint32_t index, const Affine& place);
  void settle(Instance& instance);
  Placement placement(const Instance& i) const {
    return {meshes_[i.mesh].get(), i.transform, i.identity, i.movable, i.hidden_from_camera};
  }
  void collect_emitters(Instance& instance);
  std::vector<Caster> casters_of(const Instance& instance) const;
  void commit_lights();
  SurfaceAttributes attributes(const Mesh& mesh, uint32_t triangle, float u, float v) const;
  // Interpolated between the corners of a smooth mesh, in world space, of any length.
  static Vec3 normal(const Facet& facet, const Instance& instance, float u, float v);
  std::array<Vec3, 3> vertices(const Instance& instance, uint32_t triangle) const;
  float reach(const Instance& instance, uint32_t triangle) const;  // of the coordinates that `vertices` computes with

  std::vector<std::unique_ptr<Mesh>> meshes_;
  std::vector<Instance> instances_;
  Accel accel_;
  std::vector<Caster> still_casters_;
  std::vector<MovingInstance> moving_instances_;
  std::vector<MovingLamp> moving_lamps_;
  std::vector<SppmCameraDesc> camera_keys_;  // empty while it stands still
  Motion camera_motion_;
  Bounds lit_bounds_;                      // that lights were committed with
  std::vector<uint32_t> moved_instances_;  // since the last update
  std::vector<std::pair<uint32_t, Lamp>> changed_lamps_;  // by id, since the last update
  uint64_t triangle_count_ = 0;
  bool has_camera_ = false, committed_ = false, has_transparent_ = false, has_specular_ = false, has_textures_ = false;
  bool has_attributes_ = false;  // some mesh has UVs or colours: an exporter gives only those that are asked for
};

}  // namespace sppm
