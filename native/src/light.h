// Emitters: lamps, emitting triangles and the environment. They are sampled from a surface point (direct light), evaluated along a
// ray (for what a scattered ray happens to meet) and sampled outward (photons); the three agree on one radiance.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "image.h"
#include "light_tree.h"
#include "material.h"
#include "sampling.h"
#include "sppm/sppm.h"
#include "targets.h"
#include "vecmath.h"

namespace sppm {

// Light toward a point. estimate = f |cos| radiance / pdf; for a lamp without size radiance stands for intensity / distance^2.
struct DirectSample {
  Vec3 wi;             // unit, from the point to the light
  float distance = 0;  // infinite for sun and environment
  Vec3 radiance;
  float pdf = 0;       // solid angle, choice of the light included; for lamps without size only the choice
  bool delta = false;  // cannot be met by chance
  bool casts_shadow = true;
  // Where the light is itself a surface that a shadow ray would meet, the ray must end here, just short of it.
  std::optional<Vec3> end;
};

// Radiance along a ray that could as well have been found by DirectSample with `pdf_solid_angle`.
struct EmittedLight {
  Vec3 radiance;
  float pdf_solid_angle = 0;
};

// The start of a photon: weight = L cos / (all pdfs).
struct PhotonStart {
  Vec3 origin, direction, weight;  // the origin is clear of the emitting triangle
};

// One triangle of an emitting mesh, in world space.
struct EmissiveTriangle {
  std::array<Vec3, 3> p;
  std::array<SurfaceAttributes, 3> attributes;
  uint32_t material = 0;
  float reach = 0;  // see `clearance`
  double area = 0;
};

class Lights {
 public:
  Lights(const Textures* textures, const Materials* materials) : textures_(textures), materials_(materials) {}

  uint32_t add_lamp(const SppmLightDesc& desc);  // id from 1; throws Error
  void set_world(const SppmWorldDesc& desc);
  // One light a call; returns its index for `triangle_pdf_area`.
  uint32_t add_triangles(std::vector<EmissiveTriangle> triangles);
  // Builds the distributions; `bounds` is that of the geometry, `targets` are what aimed photons are for.
  void commit(const Bounds& bounds, Targets targets);

  bool none() const { return by_power_.empty(); }
  size_t count() const { return by_power_.size(); }
  double power() const { return by_power_.total(); }  // luminance [W]
  // True if a ray could meet a light by chance, so that sampling directions for direct light has a point.
  bool can_be_met() const { return met_; }

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
    for (const uint32_t i : sized_lamps_)
      if (const auto found = lamp_along(i, origin, direction, near, far)) visit(*found);
  }
  // Environment, and unless a camera ray the suns' disks, that a ray which leaves the scene sees; `origin` scattered it.
  template <typename Visit>
  void visit_infinite(Vec3 origin, Vec3 direction, bool camera_ray, Visit visit) const {
    if (has_world_ && !(camera_ray && world_hidden_))
      visit(EmittedLight{world_radiance(direction), probability(world_entry_, origin) * world_direction_pdf(direction)});
    if (!camera_ray)
      for (const uint32_t i : suns_)
        if (const auto found = sun_along(i, origin, direction)) visit(*found);
  }
  // Density over area with which direct light of p picks a point on emissive triangle `triangle` of light `light`.
  float triangle_pdf_area(uint32_t light, uint32_t triangle, Vec3 p) const;

 private:
  struct Lamp {
    SppmLightType type;
    uint32_t flags;
    Vec3 position, axis, x, y;  // axis: where light goes; x, y: half extents of an area lamp
    Vec3 emission;
    float radius = 0, cos_half = -1, blend = 0, one_minus_cos = 0;
    double area = 0;
  };
  struct TriangleSet {
    std::vector<EmissiveTriangle> triangles;
    Distribution choice;
  };
  enum class Kind : uint8_t { kLamp, kTriangles, kWorld };
  struct Entry {
    Kind kind;
    uint32_t index;
  };

  double lamp_power(const Lamp& lamp) const;
  // Chooses the light that a sample of p's direct light comes from, and makes u fresh again.
  std::optional<LightTree::Choice> choose(Vec3 p, float& u) const;
  float probability(uint32_t entry, Vec3 p) const;
  void build_choice();
  LightBounds lamp_bounds(const Lamp& lamp) const;
  Vec3 spot_factor(const Lamp& lamp, float cos_theta) const;
  std::optional<EmittedLight> lamp_along(uint32_t lamp, Vec3 origin, Vec3 direction, float near, float far) const;
  std::optional<EmittedLight> sun_along(uint32_t lamp, Vec3 origin, Vec3 direction) const;
  std::optional<DirectSample> sample_lamp(const Lamp& lamp, Vec3 p, Vec2 u) const;
  std::optional<DirectSample> sample_triangles(const TriangleSet& set, Vec3 p, Vec2 u, float choice) const;
  std::optional<DirectSample> sample_world(Vec2 u) const;
  // Emission, toward `targets` unless null.
  std::optional<PhotonStart> emit(const Distribution& choice, const Targets* targets, const Sample4& u, const Sample4& v) const;
  std::optional<PhotonStart> emit_entry(Entry entry, const Targets* targets, const Sample4& u, const Sample4& v) const;
  std::optional<PhotonStart> emit_lamp(const Lamp& lamp, const Targets* targets, const Sample4& u, float target) const;
  std::optional<PhotonStart> emit_triangles(const TriangleSet& set, const Targets* targets, const Sample4& u, const Sample4& v) const;
  PhotonStart emit_from_infinity(Vec3 toward_light, Vec3 weight, const Targets* targets, Vec2 u, float target) const;
  double aimed_power(Entry entry) const;
  Vec3 triangle_emission(const EmissiveTriangle& t, Vec2 barycentric) const;

  Vec3 world_radiance(Vec3 direction) const;
  Vec3 sample_world_direction(Vec2 u, float& pdf) const;  // pdf without the choice
  float world_direction_pdf(Vec3 direction) const;
  void build_world_distribution();

  const Textures* textures_;
  const Materials* materials_;
  std::vector<Lamp> lamps_;
  std::vector<TriangleSet> triangle_sets_;
  std::vector<Entry> entries_;
  std::vector<uint32_t> lamp_entry_, set_entry_;
  std::vector<uint32_t> sized_lamps_, suns_;
  uint32_t world_entry_ = 0;
  Distribution by_power_, by_aimed_power_;
  LightTree near_;                      // all but suns and world
  Distribution far_;                    // those, by irradiance
  std::vector<uint32_t> far_entries_;
  Targets targets_;
  bool met_ = false;

  bool has_world_ = false, world_hidden_ = false;
  Vec3 world_factor_;
  uint32_t world_image_ = 0;
  std::array<float, 9> world_rotation_{};
  int map_width_ = 0, map_height_ = 0;
  Distribution map_rows_;
  std::vector<Distribution> map_columns_;
  double world_integral_ = 0;  // luminance of radiance over the sphere

  Vec3 center_;
  float radius_ = 0;  // of the scene's bounding sphere
};

}  // namespace sppm
