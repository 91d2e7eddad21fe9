#include "bsdf.h"

#include <algorithm>
#include <cmath>

#include "color.h"
#include "sampling.h"

namespace sppm {
namespace {

// Trowbridge-Reitz density of microfacet normals, isotropic, local frame.
float ggx_d(Vec3 h, float alpha) {
  const float a2 = alpha * alpha;
  const float e = h.x * h.x + h.y * h.y + a2 * h.z * h.z;  // cos^2 (alpha^2 + tan^2), without 1 - cos^2
  return a2 / (kPi * e * e);
}

float ggx_lambda(Vec3 w, float alpha) {
  const float tan2 = (w.x * w.x + w.y * w.y) / (w.z * w.z);
  return 0.5f * (std::sqrt(1 + alpha * alpha * tan2) - 1);
}

float ggx_g1(Vec3 w, float alpha) { return w.z == 0 ? 0.0f : 1 / (1 + ggx_lambda(w, alpha)); }
float ggx_g2(Vec3 a, Vec3 b, float alpha) {
  return a.z == 0 || b.z == 0 ? 0.0f : 1 / (1 + ggx_lambda(a, alpha) + ggx_lambda(b, alpha));
}

// Share of microfacets that neither direction hides.
float visible_share(const Lobe& lobe, Vec3 wo, Vec3 wi) {
  if (lobe.clearcoat) return ggx_g1(wo, lobe.alpha) * ggx_g1(wi, kClearcoatAlpha);
  return lobe.separable ? ggx_g1(wo, lobe.alpha) * ggx_g1(wi, lobe.alpha) : ggx_g2(wo, wi, lobe.alpha);
}

// Normals visible from w (w.z > 0): Dupuy and Benyoub 2023, spherical caps.
Vec3 sample_visible_normal(Vec3 w, float alpha, float u1, float u2) {
  const Vec3 stretched = normalize({w.x * alpha, w.y * alpha, w.z});
  const float phi = 2 * kPi * u1;
  const float z = (1 - u2) * (1 + stretched.z) - stretched.z;
  const float sin_theta = safe_sqrt(1 - z * z);
  const Vec3 h = Vec3{sin_theta * std::cos(phi), sin_theta * std::sin(phi), z} + stretched;
  return normalize({h.x * alpha, h.y * alpha, std::max(h.z, 1e-9f)});
}

float visible_normal_pdf(Vec3 w, Vec3 h, float alpha) {
  return ggx_g1(w, alpha) * std::max(dot(w, h), 0.0f) * ggx_d(h, alpha) / w.z;
}

Vec3 reflect(Vec3 w, Vec3 h) { return h * (2 * dot(w, h)) - w; }

// w through an interface with normal h on w's side; `eta` = index of the far side over the near side. Empty at total reflection.
std::optional<Vec3> refract(Vec3 w, Vec3 h, float eta) {
  const float cos_w = dot(w, h);
  const float sin2_t = std::max(0.0f, 1 - cos_w * cos_w) / (eta * eta);
  if (sin2_t >= 1) return std::nullopt;
  return w * (-1 / eta) + h * (cos_w / eta - std::sqrt(1 - sin2_t));
}

float schlick(float cos_theta) {
  const float m = std::clamp(1 - cos_theta, 0.0f, 1.0f);
  return m * m * m * m * m;
}

// How far a conductor is from `color` to `color2`.
float edge_share(const Lobe& lobe, float cos_theta) {
  if (!lobe.edge_by_ior) return schlick(cos_theta);
  const float f0 = fresnel_dielectric(1, lobe.ior);
  return std::max(0.0f, (fresnel_dielectric(cos_theta, lobe.ior) - f0) / (1 - f0));
}

// Reflectance per channel at a microfacet; `eta` as in fresnel_dielectric.
Vec3 reflectance(const Lobe& lobe, float cos_theta, float eta) {
  switch (lobe.type) {
    case LobeType::kConductor: return lerp(lobe.color, lobe.color2, edge_share(lobe, cos_theta));
    case LobeType::kRefraction: return {};
    default: return lobe.color * fresnel_dielectric(cos_theta, eta);
  }
}

// Fresnel reflectance of a dielectric by which light is shared, given the cosines to the shading normal and to the microfacet's.
float dielectric_share(const Lobe& lobe, float cos_normal, float cos_theta, float eta) {
  return fresnel_dielectric(lobe.separable ? std::abs(cos_normal) : cos_theta, eta);
}

// Probability of reflecting rather than transmitting at a microfacet, for the direction that is given.
float reflection_probability(const Lobe& lobe, float cos_normal, float cos_theta, float eta) {
  if (!transmits(lobe.type)) return 1;
  if (lobe.type == LobeType::kRefraction) return 0;
  float reflected = fresnel_dielectric(cos_theta, eta);
  // What the microfacet can transmit may be weighed by the other direction's share, so neither way may be left out.
  if (lobe.separable && reflected < 1) reflected = 0.5f * (reflected + dielectric_share(lobe, cos_normal, cos_theta, eta));
  const float r = reflected * luminance(lobe.color), t = (1 - reflected) * luminance(lobe.color2);
  return r + t > 0 ? r / (r + t) : 0.5f;
}

// Energy that multiple scattering between microfacets gives back, as a factor on the single-scattering value.
Vec3 energy_factor(const Lobe& lobe, float cos_theta) {
  if (!lobe.multiple_scattering) return splat(1);
  const AlbedoTable& table = transmits(lobe.type) && cos_theta < 0 ? *lobe.multiple_scattering_inside : *lobe.multiple_scattering;
  const float e = std::max(table.albedo(std::abs(cos_theta), lobe.roughness), 0.05f);
  if (transmits(lobe.type)) return splat(1 / e);
  const Vec3 f0 = lobe.type == LobeType::kConductor ? lobe.color : lobe.color * fresnel_dielectric(1, lobe.ior);
  const Vec3 edge = lobe.type == LobeType::kConductor ? lobe.color2 : lobe.color;
  const Vec3 average = f0 + (edge - f0) * (1.0f / 21);
  // What is not lost goes on to a second facet, a third ...: a geometric series (Kulla and Conty 2017).
  const float mean = lobe.multiple_scattering->average(lobe.roughness);
  // Above white it would not converge: there the facets gain as white ones do.
  const auto series = [&](float f) { return std::min(f, 1.0f) * mean / (1 - std::min(f, 1.0f) * (1 - mean)); };
  return splat(1) + Vec3{series(average.x), series(average.y), series(average.z)} * ((1 - e) / e);
}

// As Cycles has it from 4.0 on: where nothing gives back what is lost between facets, passes do not miss it either.
Vec3 rough_conductor_albedo(const Lobe& lobe, float cos_theta) {
  const Vec3 kept = lerp(lobe.color, lobe.color2, lobe.directional->albedo(cos_theta, lobe.roughness));
  if (!lobe.multiple_scattering) return kept;
  return kept * lobe.multiple_scattering->albedo(cos_theta, lobe.roughness) * energy_factor(lobe, cos_theta);
}

float under_cover(const Lobe& lobe, Vec3 wo_local) { return under_covers(lobe.covers, std::abs(wo_local.z)); }

// Disney's diffuse (Burley 2012) without sheen; local directions on the same side.
float retro_diffuse(Vec3 wo, Vec3 wi, float roughness) {
  const float fo = schlick(std::abs(wo.z)), fi = schlick(std::abs(wi.z));
  const float cos_half2 = 0.5f * (1 + dot(wo, wi));
  const float rr = 2 * roughness * cos_half2;
  return kInvPi * ((1 - 0.5f * fo) * (1 - 0.5f * fi) + rr * (fo + fi + fo * fi * (rr - 1)));
}

// f of a rough microfacet lobe in the local frame, without weight, energy and cover factors.
Vec3 microfacet(const Lobe& lobe, Vec3 wo, Vec3 wi) {
  const float side = wo.z > 0 ? 1.0f : -1.0f;
  const float eta = !transmits(lobe.type) || wo.z > 0 ? lobe.ior : 1 / lobe.ior;  // far side over wo's side
  if (wo.z * wi.z > 0) {
    const Vec3 h = normalize(wo + wi) * side;
    const float d = ggx_d(h, lobe.alpha), g = visible_share(lobe, wo, wi);
    const bool at_normal = lobe.separable && lobe.type == LobeType::kDielectric;
    return reflectance(lobe, at_normal ? std::abs(wo.z) : std::abs(dot(wo, h)), eta) * (d * g / (4 * std::abs(wo.z * wi.z)));
  }
  if (!transmits(lobe.type)) return {};
  Vec3 h = wo + wi * eta;
  if (length_squared(h) == 0) return {};
  h = normalize(h);
  if (h.z * side < 0) h = -h;
  const float cos_o = dot(wo, h), cos_i = dot(wi, h);
  if (cos_o <= 0 || cos_i >= 0) return {};
  const float f = lobe.type == LobeType::kRefraction ? 0.0f : dielectric_share(lobe, wo.z, std::abs(cos_o), eta);
  if (f >= 1) return {};
  const float denominator = square(cos_o + eta * cos_i);
  const float value = (1 - f) * ggx_d(h, lobe.alpha) * visible_share(lobe, wo, wi) * std::abs(cos_i * cos_o / (wi.z * wo.z * denominator));
  // No eta^2 here: eta belongs to wo's side, and this is what radiance toward wo takes (Veach 5.2). A photon evaluates the same f.
  return (lobe.type == LobeType::kRefraction ? lobe.color : lobe.color2) * value;
}

// Shading normals make the transport of photons asymmetric (Veach 5.3); the factor on |cos wi| f |cos wo| that restores it.
float adjoint_correction(const ShadingPoint& at, Vec3 wi_photon, Vec3 wo_sampled) {
  const float shading = std::abs(dot(wi_photon, at.frame.n) * dot(wo_sampled, at.ng));
  const float geometric = std::abs(dot(wi_photon, at.ng) * dot(wo_sampled, at.frame.n));
  return geometric > 0 ? shading / geometric : 0.0f;
}

// True where shading and geometric normal agree on which side w is; light must not leak through where they do not.
bool consistent(const ShadingPoint& at, Vec3 w) { return dot(w, at.ng) * dot(w, at.frame.n) > 0; }

float lobe_pdf(const Lobe& lobe, Vec3 given, Vec3 sampled) {
  if (lobe.smooth()) return 0;
  if (lobe.diffuse()) return given.z * sampled.z > 0 ? std::abs(sampled.z) * kInvPi : 0.0f;
  const float side = given.z > 0 ? 1.0f : -1.0f;
  const Vec3 g = given * side, s = sampled * side;
  const float eta = !transmits(lobe.type) || given.z > 0 ? lobe.ior : 1 / lobe.ior;
  if (s.z > 0) {
    const Vec3 h = normalize(g + s);
    const float cos_g = dot(g, h);
    if (cos_g <= 0) return 0;
    return reflection_probability(lobe, g.z, cos_g, eta) * visible_normal_pdf(g, h, lobe.alpha) / (4 * cos_g);
  }
  if (!transmits(lobe.type)) return 0;
  Vec3 h = g + s * eta;
  if (length_squared(h) == 0) return 0;
  h = normalize(h);
  if (h.z < 0) h = -h;
  const float cos_g = dot(g, h), cos_s = dot(s, h);
  if (cos_g <= 0 || cos_s >= 0) return 0;
  return (1 - reflection_probability(lobe, g.z, cos_g, eta)) * visible_normal_pdf(g, h, lobe.alpha) * square(eta) * std::abs(cos_s) /
         square(cos_g + eta * cos_s);
}

std::optional<BsdfSample> sample_about_normal(const Lobe& lobe, const ShadingPoint& at, Vec3 given_world, const std::array<float, 3>& u,
                                              Transport transport);

}  // namespace

float under_covers(const Covers& covers, float cosine) {
  float left = 1;
  for (const Cover& c : covers)
    if (c.table) left *= std::max(0.0f, 1 - c.share * c.table->albedo(cosine, c.roughness));
  return left;
}

float fresnel_dielectric(float cos_theta, float eta) {
  const float c = std::clamp(cos_theta, 0.0f, 1.0f);
  const float g2 = eta * eta - 1 + c * c;
  if (g2 <= 0) return 1;
  const float g = std::sqrt(g2);
  const float a = (g - c) / (g + c);
  const float b = (c * (g + c) - 1) / (c * (g - c) + 1);
  return std::min(1.0f, 0.5f * a * a * (1 + b * b));
}

Vec3 evaluate(const Lobe& lobe, const ShadingPoint& at, Vec3 wo_world, Vec3 wi_world) {
  if (lobe.smooth() || !consistent(at, wo_world) || !consistent(at, wi_world)) return {};
  const Vec3 wo = at.frame.to_local(wo_world), wi = at.frame.to_local(wi_world);
  if (lobe.diffuse()) {
    if (wo.z * wi.z <= 0) return {};
    const float f = lobe.type == LobeType::kDiffuse ? kInvPi : retro_diffuse(wo, wi, lobe.roughness);
    return lobe.weight * lobe.color * (f * under_cover(lobe, wo));
  }
  return lobe.weight * microfacet(lobe, wo, wi) * energy_factor(lobe, wo.z) * under_cover(lobe, wo);
}

float pdf_solid_angle(const Lobe& lobe, const ShadingPoint& at, Vec3 given, Vec3 sampled) {
  return lobe_pdf(lobe, at.frame.to_local(given), at.frame.to_local(sampled));
}

std::optional<BsdfSample> sample(const Lobe& lobe, const ShadingPoint& at, Vec3 given, const std::array<float, 3>& u, Transport transport) {
  auto result = sample_about_normal(lobe, at, given, u, transport);
  // The lobe that only refracts ends paths at total reflection, which is no conflict of normals.
  if (!result && lobe.smooth() && lobe.type != LobeType::kRefraction && !(at.frame.n == at.ng))
    result = sample_about_normal(lobe, {at.ng, Frame(at.ng)}, given, u, transport);
  return result;
}

namespace {

std::optional<BsdfSample> sample_about_normal(const Lobe& lobe, const ShadingPoint& at, Vec3 given_world, const std::array<float, 3>& u,
                                              Transport transport) {
  std::optional<BsdfSample> drawn;  // returned on all ways: the compiler then makes it in the caller's place
  if (!consistent(at, given_world)) return drawn;
  const Vec3 given = at.frame.to_local(given_world);
  const float side = given.z > 0 ? 1.0f : -1.0f;
  const bool photon = transport == Transport::kPhoton, lambert = lobe.type == LobeType::kDiffuse;
  BsdfSample result;
  Vec3 local;
  if (lobe.diffuse()) {
    local = sample_cosine_hemisphere({u[0], u[1]}) * side;
  } else {
    const float eta = !transmits(lobe.type) || given.z > 0 ? lobe.ior : 1 / lobe.ior;
    const Vec3 h = lobe.smooth() ? Vec3{0, 0, 1} : sample_visible_normal(given * side, lobe.alpha, u[0], u[1]);
    const float cos_h = dot(given * side, h);
    if (cos_h <= 0) return drawn;
    const float p = reflection_probability(lobe, given.z * side, cos_h, eta);
    const bool reflected = u[2] < p;
    if (reflected) {
      local = reflect(given * side, h) * side;
      if (local.z * given.z <= 0) return drawn;
    } else {
      const auto through = refract(given * side, h, eta);
      if (!through || through->z >= 0) return drawn;
      local = *through * side;
    }
    if (lobe.smooth()) {
      const float f = lobe.type == LobeType::kRefraction ? 0.0f : fresnel_dielectric(cos_h, eta);
      const Vec3 tint = lobe.type == LobeType::kRefraction ? lobe.color : lobe.color2;
      result.weight = reflected ? reflectance(lobe, cos_h, eta) / p : tint * ((1 - f) / (1 - p));
      if (!reflected && !photon) result.weight *= 1 / square(eta);
      result.weight *= lobe.weight;
      result.smooth = true;
      result.probability = reflected ? p : 1 - p;
    }
  }
  result.direction = normalize(at.frame.to_world(local));
  if (!consistent(at, result.direction)) return drawn;
  if (result.smooth) {
    result.weight *= under_cover(lobe, photon ? local : given);
  } else if (lambert) {  // drawn in proportion to what it scatters
    result.pdf_solid_angle = std::abs(local.z) * kInvPi;
    result.weight = lobe.weight * lobe.color * under_cover(lobe, photon ? local : given);
  } else {
    result.pdf_solid_angle = lobe_pdf(lobe, given, local);
    if (!(result.pdf_solid_angle > 0)) return drawn;
    const Vec3 f = photon ? evaluate(lobe, at, result.direction, given_world) : evaluate(lobe, at, given_world, result.direction);
    result.weight = f * (std::abs(local.z) / result.pdf_solid_angle);
  }
  if (photon) result.weight *= adjoint_correction(at, given_world, result.direction);
  drawn = result;
  return drawn;
}

}  // namespace

Vec3 albedo(const Lobe& lobe, const ShadingPoint& at, Vec3 given_world) {
  const Vec3 given = at.frame.to_local(given_world);
  const Vec3 weight = lobe.weight * under_cover(lobe, given);
  if (lobe.diffuse() || lobe.type == LobeType::kRefraction) return weight * lobe.color;
  const float c = std::abs(given.z);
  if (lobe.directional && lobe.type == LobeType::kConductor) return weight * rough_conductor_albedo(lobe, c);
  if (lobe.directional) return weight * lobe.color * lobe.directional->albedo(c, lobe.roughness) * energy_factor(lobe, c);
  const float eta = lobe.type == LobeType::kDielectric && given.z < 0 ? 1 / lobe.ior : lobe.ior;
  Vec3 scattered = reflectance(lobe, c, eta);
  if (lobe.type == LobeType::kDielectric) scattered += lobe.color2 * (1 - fresnel_dielectric(c, eta));
  return weight * scattered;
}

float estimated_albedo(const Lobe& lobe, const ShadingPoint& at, Vec3 given_world) {
  const float c = std::abs(dot(given_world, at.frame.n));
  const float weight = luminance(lobe.weight);
  const float cover = under_covers(lobe.covers, c);
  switch (lobe.type) {
    case LobeType::kDiffuse:
    case LobeType::kRetroDiffuse: return weight * cover * luminance(lobe.color);
    case LobeType::kCoat: return weight * cover * luminance(lobe.color) * fresnel_dielectric(c, lobe.ior);
    case LobeType::kConductor: return weight * cover * luminance(lerp(lobe.color, lobe.color2, edge_share(lobe, c)));
    case LobeType::kRefraction: return weight * cover * luminance(lobe.color);
    default: return weight * cover * 0.5f * (luminance(lobe.color) + luminance(lobe.color2));
  }
}

}  // namespace sppm
