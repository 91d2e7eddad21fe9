// All that shines: the choice of a light for a surface point (direct light) and for a photon, and what a ray meets by chance.
//
// Lamps, emitting meshes and the environment are each sampled from a surface point, evaluated along a ray (for what a scattered ray
// happens to meet) and sampled outward (photons); the three agree on one radiance.
#pragma once

#include <optional>
#include <vector>

#include "box_tree.h"
#include "emission.h"
#include "emissive_mesh.h"
#include "environment.h"
#include "lamp.h"
#include "light_sample.h"
#include "light_tree.h"
#include "material.h"
#include "sampling.h"
#include "sppm/sppm.h"
#include "targets.h"
#include "vecmath.h"

namespace sppm {

class Lights {
 public:
  Lights(const Textures* textures, const Materials* materials) : textures_(textures), materials_(materials) {}

  uint32_t add_lamp(const SppmLightDesc& desc);  // id from 1; throws Error
  bool has_lamp(uint32_t id) const { return id >= 1 && id <= lamps_.size(); }
  void set_lamp(uint32_t id, const Lamp& lamp) { lamps_[id - 1] = lamp; }
  void set_world(const SppmWorldDesc& desc);     // throws Error
  // One light a call; returns its index for `triangle_pdf_area`.
  uint32_t add_triangles(std::vector<EmissiveTriangle> triangles);
  void set_triangles(uint32_t light, std::vector<EmissiveTriangle> triangles);  // the same, elsewhere
  // Builds the distributions, as often as lights or places have changed; `bounds` is that of the geometry, `targets`
  // are what aimed photons are for.
  void commit(const Bounds& bounds, Targets targets);

  bool none() const { return by_power_.empty(); }
  size_t count() const { return by_power_.size(); }
  double power() const { return power_; }  // luminance [W]
  // True if a ray could meet a light by chance, so that sampling directions for direct light has a point.
  bool can_be_met() const { return met_; }
  // True if some lamp is so small beside the scene, or a sun so narrow, that scattered rays hardly ever meet it.
  bool any_small() const { return small_; }
  // True if some lamp is a point or a parallel beam.
  bool any_without_size() const { return without_size_; }

  std::optional<DirectSample> sample_direct(Vec3 p, const Sample4& u) const;
  // A photon to anywhere. [16.7]
  std::optional<PhotonStart> emit(const Sample4& u, const Sample4& v) const { return emit(by_power_, nullptr, u, v); }
  // One of those photons whose rays may meet a target.
  std::optional<PhotonStart> emit_aimed(const Sample4& u, const Sample4& v) const { return emit(by_aimed_power_, &targets_, u, v); }
  // False if nothing throws caustics, or no light reaches what does.
  bool can_aim() const { return !by_aimed_power_.empty(); }

  // Lamps crossed at a distance in (near, far] from the point that scattered the ray; calls visit(EmittedLight).
  template <typename Visit>
  void visit_lamps(Vec3 origin, Vec3 direction, float near, float far, Visit visit) const {
    lamp_boxes_.visit_along(origin, direction, far, [&](uint32_t i) {
      if (const auto found = lamp_along(sized_lamps_[i], origin, direction, near, far)) visit(*found);
    });
  }
  // What a ray that leaves the scene sees, of which `origin` scattered it: the environment, the suns' disks, and both but for camera
  // rays, which see no suns.
  template <typename Visit>
  void visit_world(Vec3 origin, Vec3 direction, bool camera_ray, Visit visit) const {
    if (world_ && !(camera_ray && world_->hidden_from_camera()))
      visit(EmittedLight{world_->radiance(direction), probability(world_entry_, origin) * world_->pdf_solid_angle(direction)});
  }
  template <typename Visit>
  void visit_suns(Vec3 origin, Vec3 direction, Visit visit) const {
    for (const uint32_t i : suns_)
      if (const auto found = lamp_along(i, origin, direction, 0, kInfinity)) visit(*found);
  }
  template <typename Visit>
  void visit_infinite(Vec3 origin, Vec3 direction, bool camera_ray, Visit visit) const {
    visit_world(origin, direction, camera_ray, visit);
    if (!camera_ray) visit_suns(origin, direction, visit);
  }
  // Density over area with which direct light of p picks a point on emissive triangle `triangle` of light `light`.
  float triangle_pdf_area(uint32_t light, uint32_t triangle, Vec3 p) const;

 private:
  enum class Kind : uint8_t { kLamp, kMesh, kWorld };
  struct Entry {
    Kind kind;
    uint32_t index;
  };

  std::vector<double> build_entries();  // their powers, each
  void build_lamp_boxes();
  void build_choice();
  // Chooses the light that a sample of p's direct light comes from, and makes u fresh again.
  std::optional<LightTree::Choice> choose(Vec3 p, float& u) const;
  float probability(uint32_t entry, Vec3 p) const;
  float near_share(Vec3 p) const;  // of what lights could bring to p, that of near_
  std::optional<EmittedLight> lamp_along(uint32_t lamp, Vec3 origin, Vec3 direction, float near, float far) const;
  // Emission, toward `targets` unless null.
  std::optional<PhotonStart> emit(const Distribution& choice, const Targets* targets, const Sample4& u, const Sample4& v) const;
  std::optional<PhotonStart> emit_entry(Entry entry, const Targets* targets, const Sample4& u, const Sample4& v) const;
  double aimed_power(Entry entry) const;

  const Textures* textures_;
  const Materials* materials_;
  std::vector<Lamp> lamps_;
  std::vector<EmissiveMesh> meshes_;
  std::optional<Environment> world_;  // empty if black
  std::vector<Entry> entries_;
  std::vector<uint32_t> lamp_entry_, mesh_entry_;
  uint32_t world_entry_ = 0;
  std::vector<uint32_t> sized_lamps_, suns_;
  BoxTree lamp_boxes_;  // of `sized_lamps_`
  double power_ = 0;
  Distribution by_power_, by_aimed_power_;
  std::vector<uint32_t> lit_entries_;
  LightTree near_;                      // all but suns and world
  Distribution far_;                    // those, by irradiance
  std::vector<uint32_t> far_entries_;
  Targets targets_;
  bool met_ = false;
  bool small_ = false, without_size_ = false;

  Vec3 center_;
  float radius_ = 0;  // of the scene's bounding sphere
};

}  // namespace sppm
