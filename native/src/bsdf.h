// The lobes that scatter light at a surface point, and how to evaluate, weigh and sample them.
//
// Frame: `wo` points toward the camera side of the path, `wi` toward the light side, both away from the surface. A photon path is
// followed with the roles exchanged: what it arrives from is wi, and `Transport::kPhoton` says that wo is sampled. A value f excludes
// the cosine. Pdfs are per solid angle of the sampled direction.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>

#include "vecmath.h"

namespace sppm {

enum class LobeType : uint8_t { kDiffuse, kRetroDiffuse, kDielectric, kRefraction, kConductor, kCoat };
enum class Transport : uint8_t { kRadiance, kPhoton };

inline bool transmits(LobeType type) { return type == LobeType::kDielectric || type == LobeType::kRefraction; }

class AlbedoTable;

// A coat: `share` of what lies below is beneath it.
struct Cover {
  const AlbedoTable* table = nullptr;
  float roughness = 0, share = 1;
};
// One over the other.
using Covers = std::array<Cover, 2>;
// What share of the light from below they let through toward the camera's side, seen at this cosine to the shading normal.
float under_covers(const Covers& covers, float cosine);

struct Lobe {
  LobeType type = LobeType::kDiffuse;
  Vec3 weight{1, 1, 1};  // of this lobe in the sum, layering included where it does not depend on direction
  Vec3 color;            // albedo, or tint or F0 of reflection
  Vec3 color2;           // tint of transmission, or reflection at grazing
  float roughness = 0;
  float alpha = 0;       // GGX; 0 is perfectly smooth
  float ior = 1;         // inside over outside
  bool edge_by_ior = false;  // conductor: color2 is reached as a dielectric of index `ior` reaches 1
  bool separable = false;    // masking and shadowing independent; Fresnel shares of glass at the shading normal
  bool clearcoat = false;    // the light's side is masked as at kClearcoatAlpha, as Cycles before 4.0 samples its clearcoat
  const AlbedoTable* multiple_scattering = nullptr;        // gives back lost energy if set
  const AlbedoTable* multiple_scattering_inside = nullptr; // the same where light is seen from inside a dielectric
  const AlbedoTable* directional = nullptr;  // for passes: what a rough coat reflects, or a conductor's edge(); else as a smooth one
  Covers covers;                                           // the coats that lie above, if any

  bool diffuse() const { return type == LobeType::kDiffuse || type == LobeType::kRetroDiffuse; }
  bool smooth() const { return !diffuse() && alpha == 0; }
  // The share of a lamp's light scattered here that photons carry on, where camera paths could find the rest. Falls smoothly with
  // roughness, so that no picture changes abruptly with it.
  float photon_share() const {
    return diffuse() ? 0 : 1 - smooth_step(0.25f, 0.5f, std::sqrt(spread(type, roughness, ior)));
  }
  // The share of the caustic light coming to a glossy lobe for which photons are asked. Camera paths find the rest: by chance, the more
  // rarely the smaller the lamp and the wider the lobe. Those of a lamp `without_size` find none: but for nearly smooth lobes, which as
  // mirrors do not show it, photons bring it all. Photons are looked for on one side of a surface, so not for what lets light through.
  float asked_share(bool without_size) const {
    if (diffuse() || transmits(type)) return 0;
    const float width = std::sqrt(spread(type, roughness, ior));
    return without_size ? smooth_step(0.02f, 0.1f, width) : smooth_step(0.1f, 0.3f, width);
  }
  // How wide a rough lobe scatters: its alpha, less where glass hardly bends what goes through.
  static float spread(LobeType type, float roughness, float ior) {
    return square(roughness) * (transmits(type) ? std::min(std::abs(ior - 1), 1.0f) : 1.0f);
  }
};

// Directions and normals of a surface point, as lobes need them.
struct ShadingPoint {
  Vec3 ng;           // geometric normal, outward (the winding's side)
  Frame frame;       // around the shading normal, on ng's side
};

struct BsdfSample {
  Vec3 direction;             // unit, away from the surface
  Vec3 weight;                // f |cos| / pdf
  float pdf_solid_angle = 0;  // 0 for smooth lobes
  bool smooth = false;
  float probability = 1;      // of a smooth lobe: to reflect, or to refract if it has
};

// f(wo, wi) of one rough lobe for light that goes from wi to wo, radiance or photons alike; 0 for smooth ones.
Vec3 evaluate(const Lobe& lobe, const ShadingPoint& at, Vec3 wo, Vec3 wi);
// Density with which `sample` makes `sampled` from `given`.
float pdf_solid_angle(const Lobe& lobe, const ShadingPoint& at, Vec3 given, Vec3 sampled);
// A direction drawn from the lobe, given the other one. Where the bent shading normal of a smooth lobe would send light through the
// wrong side of the surface, the geometric normal serves instead: glass must not go black at its rims.
std::optional<BsdfSample> sample(const Lobe& lobe, const ShadingPoint& at, Vec3 given, const std::array<float, 3>& u, Transport transport);
// What share of the light from `given` the lobe scatters, with the reflectance of a smooth surface unless `directional` is set; for passes.
Vec3 albedo(const Lobe& lobe, const ShadingPoint& at, Vec3 given);
// About what share of the light from `given` the lobe scatters: the weight by which lobes are chosen.
float estimated_albedo(const Lobe& lobe, const ShadingPoint& at, Vec3 given);

// Reflectance of a smooth interface; `eta` is the index on the far side over that of the side of the given cosine.
float fresnel_dielectric(float cos_theta, float eta);

// Directional albedo of a rough reflector without absorption (or with the Fresnel factor of `ior`), tabulated over cosine and
// roughness by quadrature. What is missing to 1 is what the single-scattering model loses (Kulla and Conty 2017).
class AlbedoTable {
 public:
  explicit AlbedoTable(LobeType type, float ior);
  // In place of the albedo of a rough conductor how far it is on its way from `color` to `color2`.
  static AlbedoTable edge();
  float albedo(float cos_theta, float roughness) const;
  // Its mean over directions, weighted by the cosine.
  float average(float roughness) const;

 private:
  AlbedoTable() = default;
  template <typename Value>
  void fill(Value value);

  static constexpr int kSize = 16;
  std::array<float, kSize * kSize> values_;
  std::array<float, kSize> averages_;
};

// How Cycles before 4.0 masks its clearcoat, however rough it is.
inline constexpr float kClearcoatAlpha = 0.25f;
// GGX roughness below this acts as a mirror: the lobe is narrower than float directions resolve.
inline constexpr float kSmallestAlpha = 1e-4f;

}  // namespace sppm
