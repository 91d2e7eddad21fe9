#include "material.h"

#include <array>
#include <cmath>
#include <utility>

#include "color.h"
#include "status.h"

namespace sppm {
namespace {

LobeType lobe_type(SppmClosureType type, uint32_t flags) {
  switch (type) {
    case SPPM_DIFFUSE: return flags & SPPM_CLOSURE_RETRO ? LobeType::kRetroDiffuse : LobeType::kDiffuse;
    case SPPM_DIELECTRIC: return flags & SPPM_CLOSURE_REFRACTION_ONLY ? LobeType::kRefraction : LobeType::kDielectric;
    case SPPM_CONDUCTOR: return LobeType::kConductor;
    default: return LobeType::kCoat;
  }
}

// GGX width of a lobe, 0 where it is narrower than float directions resolve. Facets of glass that hardly bends light turn what they
// let through by no more than their tilt times ior - 1.
float alpha_of(const Lobe& lobe) {
  return lobe.diffuse() || Lobe::spread(lobe.type, lobe.roughness, lobe.ior) < kSmallestAlpha ? 0 : square(lobe.roughness);
}

bool scatters(SppmClosureType type) { return type != SPPM_TRANSPARENT && type != SPPM_EMISSION; }

}  // namespace

Param Materials::param(const SppmParam& desc, const std::string& where, float largest) const {
  for (const float v : desc.value)
    require(std::isfinite(v) && v >= 0 && v <= largest,
            where + " is " + std::to_string(v) + ", must be finite and from 0 to " + std::to_string(largest));
  require(desc.texture <= textures_->count(), where + ": texture " + std::to_string(desc.texture) + " is not of this scene");
  return {{desc.value[0], desc.value[1], desc.value[2]}, desc.texture};
}

const AlbedoTable* Materials::table(LobeType type, float ior) {
  auto& slot = tables_[{type, ior}];
  if (!slot) slot = std::make_unique<AlbedoTable>(type, ior);
  return slot.get();
}

const AlbedoTable* Materials::directional_table(const Closure& c) {
  if (c.flags & SPPM_CLOSURE_SMOOTH_ALBEDO) return nullptr;
  if (c.type != SPPM_CONDUCTOR || c.flags & SPPM_CLOSURE_EDGE_BY_IOR) return c.cover;
  if (!edge_table_) edge_table_ = std::make_unique<AlbedoTable>(AlbedoTable::edge());
  return edge_table_.get();
}

float Materials::caster_strength(const Closure& c) {
  if (!scatters(c.type)) return 0;
  Lobe lobe;
  lobe.type = lobe_type(c.type, c.flags);
  lobe.roughness = c.roughness.texture ? 0.0f : c.roughness.value.x;  // at least
  lobe.ior = c.ior;
  const bool one_color = c.type == SPPM_COAT || lobe.type == LobeType::kRefraction;
  const Vec3 color = one_color ? c.color.value : max(c.color.value, c.color2.value);
  const float reflected = c.type == SPPM_COAT ? fresnel_dielectric(0.5f, c.ior) : 1.0f;
  return lobe.photon_share() * luminance(c.weight.value) * luminance(color) * reflected;
}

template <typename Add>
void Materials::visit_lobes(const Material& material, const SurfaceAttributes& at, Add add) const {
  Covers covers;
  for (const Closure& c : material.closures) {
    if (!scatters(c.type)) continue;
    const Vec3 weight = max(c.weight.color(*textures_, at), {});
    if (!is_black(weight)) {
      Lobe lobe;
      lobe.type = lobe_type(c.type, c.flags);
      lobe.weight = weight;
      lobe.color = max(c.color.color(*textures_, at), {});
      lobe.color2 = max(c.color2.color(*textures_, at), {});
      lobe.roughness = roughness_of(c, at);
      lobe.ior = c.ior;
      lobe.edge_by_ior = c.flags & SPPM_CLOSURE_EDGE_BY_IOR;
      lobe.separable = c.flags & SPPM_CLOSURE_SEPARABLE;
      lobe.clearcoat = c.flags & SPPM_CLOSURE_CLEARCOAT;
      lobe.alpha = alpha_of(lobe);
      lobe.multiple_scattering = lobe.alpha > 0 ? c.multiple_scattering : nullptr;
      lobe.multiple_scattering_inside = c.multiple_scattering_inside;
      lobe.directional = lobe.alpha > 0 ? c.directional : nullptr;
      lobe.covers = covers;
      add(lobe);
    }
    if (c.cover) lay(c, at, covers);
  }
}

void Materials::lay(const Closure& coat, const SurfaceAttributes& at, Covers& covers) const {
  const bool beneath = coat.flags & SPPM_CLOSURE_UNDER_COAT;
  if (!beneath) covers = {};
  if (is_black(max(coat.weight.color(*textures_, at), {}))) return;
  covers[beneath] = {coat.cover, roughness_of(coat, at), std::clamp(luminance(coat.color2.color(*textures_, at)), 0.0f, 1.0f)};
}

float Materials::roughness_of(const Closure& c, const SurfaceAttributes& at) const {
  return std::clamp(c.roughness.scalar(*textures_, at), 0.0f, 1.0f);
}

uint32_t Materials::add(const SppmMaterialDesc& desc) {
  const std::string name = std::string("material '") + (desc.name ? desc.name : "") + "'";
  require(desc.closure_count <= kMaxClosures, name + ": closure_count must be at most 16");
  require(desc.closure_count == 0 || desc.closures, name + ": closures is null");
  Material material;
  material.index = desc.index;
  bool covered = false;
  for (uint64_t i = 0; i < desc.closure_count; ++i) {
    const SppmClosureDesc& c = desc.closures[i];
    const std::string where = name + " closure " + std::to_string(i);
    require(c.struct_size == sizeof(SppmClosureDesc), where + ": struct_size is wrong");
    require(c.type >= SPPM_DIFFUSE && c.type <= SPPM_EMISSION, where + ": type must be an SppmClosureType");
    const auto type = static_cast<SppmClosureType>(c.type);
    constexpr float kLargest = 1e30f;
    Closure closure{type, c.flags, param(c.weight, where + " weight", kLargest), param(c.color, where + " color", kLargest),
                    param(c.color2, where + " color2", kLargest), param(c.roughness, where + " roughness", 1), c.ior};
    const bool has_ior = type == SPPM_DIELECTRIC || type == SPPM_COAT || (type == SPPM_CONDUCTOR && c.flags & SPPM_CLOSURE_EDGE_BY_IOR);
    require(!has_ior || (std::isfinite(c.ior) && c.ior > 0), where + ": ior must be finite and above 0");
    if (c.flags & SPPM_CLOSURE_PRESERVE_ENERGY && type != SPPM_DIFFUSE && scatters(type))
      closure.multiple_scattering =
          type == SPPM_DIELECTRIC ? table(lobe_type(type, c.flags), c.ior) : table(LobeType::kConductor, 1);
    if (closure.multiple_scattering && type == SPPM_DIELECTRIC)
      closure.multiple_scattering_inside = table(lobe_type(type, c.flags), 1 / c.ior);
    if (type == SPPM_COAT && c.flags & SPPM_CLOSURE_ATTENUATE) closure.cover = table(LobeType::kCoat, c.ior);
    closure.directional = directional_table(closure);
    covered |= closure.cover != nullptr;
    material.emits |= type == SPPM_EMISSION;
    material.emits_through_coat |= type == SPPM_EMISSION && covered;
    material.transparent |= type == SPPM_TRANSPARENT;
    material.caster_strength += caster_strength(closure);
    material.textured |= closure.weight.texture || closure.color.texture || closure.color2.texture || closure.roughness.texture;
    material.closures.push_back(closure);
  }
  if (!material.textured) visit_lobes(material, {}, [&](const Lobe& lobe) { material.lobes.push_back(lobe); });
  materials_.push_back(std::move(material));
  return static_cast<uint32_t>(materials_.size());
}

void Materials::lobes(uint32_t id, const SurfaceAttributes& at, Bsdf& bsdf) const {
  const Material& material = materials_[id - 1];
  if (material.textured)
    visit_lobes(material, at, [&](const Lobe& lobe) { bsdf.add(lobe); });
  else
    bsdf.refer_to(material.lobes);
}

Vec3 Materials::emission(uint32_t id, const SurfaceAttributes& at, float cosine) const {
  const Material& material = materials_[id - 1];
  Vec3 sum;
  Covers covers;
  for (const Closure& c : material.closures) {
    if (c.type == SPPM_EMISSION) {
      const Vec3 emitted = max(c.weight.color(*textures_, at) * c.color.color(*textures_, at), {});
      sum += material.emits_through_coat ? emitted * under_covers(covers, cosine) : emitted;
    } else if (material.emits_through_coat && c.cover) {
      lay(c, at, covers);
    }
  }
  return sum;
}

Vec3 Materials::transparency(uint32_t id, const SurfaceAttributes& at) const {
  Vec3 sum;
  for (const Closure& c : materials_[id - 1].closures)
    if (c.type == SPPM_TRANSPARENT) sum += max(c.weight.color(*textures_, at) * c.color.color(*textures_, at), {});
  return sum;
}

}  // namespace sppm
