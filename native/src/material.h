// Materials: closures whose parameters may be textured, and the lobes they give at a surface point.
#pragma once

#include <algorithm>
#include <array>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "bsdf.h"
#include "sppm/sppm.h"
#include "texture.h"

namespace sppm {

inline constexpr int kMaxClosures = 16;

// The scattering of one surface point.
class Bsdf {
 public:
  explicit Bsdf(const ShadingPoint& point) : at(point) {}

  void add(const Lobe& lobe) { own_[static_cast<size_t>(count++)] = lobe; }
  // Takes lobes that outlive this, in place of all that were added.
  void refer_to(std::span<const Lobe> lobes) { others_ = lobes.data(), count = static_cast<int>(lobes.size()); }

  const Lobe* begin() const { return others_ ? others_ : own_.data(); }
  const Lobe* end() const { return begin() + count; }
  const Lobe& operator[](int i) const { return begin()[i]; }
  // True if some lobe scatters into more than single directions, so that lights and photons can be used here.
  bool rough() const {
    return std::any_of(begin(), end(), [](const Lobe& lobe) { return !lobe.smooth(); });
  }

  ShadingPoint at;
  int count = 0;

 private:
  const Lobe* others_ = nullptr;
  // Only those that were added exist: clearing room for all of them at every hit costs as much as a ray.
  union {
    std::array<Lobe, kMaxClosures> own_;
  };
};

class Materials {
 public:
  explicit Materials(const Textures* textures) : textures_(textures) {}
  uint32_t add(const SppmMaterialDesc& desc);  // id from 1; throws Error

  size_t count() const { return materials_.size(); }
  // Adds the lobes of `material` to an empty `bsdf` whose `at` is set.
  void lobes(uint32_t material, const SurfaceAttributes& at, Bsdf& bsdf) const;
  // Radiance that leaves toward either side, seen at this cosine to the shading normal.
  Vec3 emission(uint32_t material, const SurfaceAttributes& at, float cosine) const;
  // What goes straight through.
  Vec3 transparency(uint32_t material, const SurfaceAttributes& at) const;

  bool emits(uint32_t material) const { return materials_[material - 1].emits; }
  // True if what it emits shines through a coat, and so depends on the cosine.
  bool emits_through_coat(uint32_t material) const { return materials_[material - 1].emits_through_coat; }
  bool transparent(uint32_t material) const { return materials_[material - 1].transparent; }
  // About what share of a lamp's light photons carry on from here, at most; 0 if it throws no caustics.
  float caster_strength(uint32_t material) const { return materials_[material - 1].caster_strength; }
  bool textured(uint32_t material) const { return materials_[material - 1].textured; }
  uint32_t index(uint32_t material) const { return materials_[material - 1].index; }

 private:
  struct Closure {
    SppmClosureType type;
    uint32_t flags;
    Param weight, color, color2, roughness;
    float ior;
    const AlbedoTable* multiple_scattering = nullptr;
    const AlbedoTable* multiple_scattering_inside = nullptr;
    const AlbedoTable* cover = nullptr;        // of a coat, for what lies below
    const AlbedoTable* directional = nullptr;  // as in Lobe
  };
  struct Material {
    std::vector<Closure> closures;
    std::vector<Lobe> lobes;  // the same at every point, unless textured
    bool emits = false, emits_through_coat = false, transparent = false, textured = false;
    float caster_strength = 0;
    uint32_t index = 0;
  };
  Param param(const SppmParam& desc, const std::string& where, float largest) const;
  const AlbedoTable* table(LobeType type, float ior);
  const AlbedoTable* directional_table(const Closure& closure);
  static float caster_strength(const Closure& closure);
  // Changes what lies over the closures before `coat` into what lies over those after it.
  void lay(const Closure& coat, const SurfaceAttributes& at, Covers& covers) const;
  float roughness_of(const Closure& closure, const SurfaceAttributes& at) const;
  template <typename Add>
  void visit_lobes(const Material& material, const SurfaceAttributes& at, Add add) const;

  const Textures* textures_;
  std::vector<Material> materials_;
  std::map<std::pair<LobeType, float>, std::unique_ptr<AlbedoTable>> tables_;
  std::unique_ptr<AlbedoTable> edge_table_;
};

}  // namespace sppm
