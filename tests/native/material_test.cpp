#include <cmath>

#include "material.h"

#include <doctest/doctest.h>

#include "closures.h"

using namespace sppm;

namespace {

uint32_t add_material(Materials& materials, const std::vector<SppmClosureDesc>& closures) {
  SppmMaterialDesc desc{};
  desc.struct_size = sizeof desc;
  desc.closure_count = closures.size(), desc.closures = closures.data();
  return materials.add(desc);
}

SppmClosureDesc coat(float share, float roughness = 0, uint32_t flags = 0) {
  SppmClosureDesc c = closure(SPPM_COAT, share);
  c.flags = SPPM_CLOSURE_ATTENUATE | flags;
  c.roughness.value[0] = roughness;
  return c;
}

}  // namespace

TEST_CASE("whatever scatters a share that photons carry is a caster, so that they are aimed at it") {
  Textures textures;
  Materials materials(&textures);
  for (const SppmClosureType type : {SPPM_DIFFUSE, SPPM_DIELECTRIC, SPPM_CONDUCTOR, SPPM_COAT})
    for (const uint32_t flags : {0, static_cast<int>(SPPM_CLOSURE_REFRACTION_ONLY)})
      for (const float roughness : {0.0f, 0.3f, 0.45f, 0.6f, 1.0f})
        for (const float ior : {1.0f, 1.01f, 1.5f})
          for (const int colors : {0, 1, 2, 3}) {
            SppmClosureDesc closure{};
            closure.struct_size = sizeof closure;
            closure.type = type, closure.flags = flags, closure.ior = ior;
            for (int c = 0; c < 3; ++c) {
              closure.weight.value[c] = 1, closure.roughness.value[c] = roughness;
              closure.color.value[c] = colors & 1 ? 0.5f : 0, closure.color2.value[c] = colors & 2 ? 0.5f : 0;
            }
            SppmMaterialDesc desc{};
            desc.struct_size = sizeof desc;
            desc.closure_count = 1, desc.closures = &closure;
            const uint32_t id = materials.add(desc);
            Bsdf bsdf(ShadingPoint{{0, 0, 1}, Frame({0, 0, 1})});
            materials.lobes(id, {}, bsdf);
            REQUIRE(bsdf.count == 1);
            const Lobe& lobe = bsdf[0];
            CAPTURE(type);
            CAPTURE(roughness);
            CAPTURE(ior);
            CAPTURE(colors);
            if (lobe.smooth()) CHECK(lobe.photon_share() == 1);
            // At some angle light goes on from here; a coat of index 1 reflects nothing.
            bool shines = false;
            for (const float c : {0.1f, 0.5f, 1.0f}) shines |= estimated_albedo(lobe, bsdf.at, {std::sqrt(1 - c * c), 0, c}) > 0;
            if (shines && lobe.photon_share() > 0) CHECK(materials.caster_strength(id) > 0);
          }
}

TEST_CASE("emission shines through a smooth coat by what Fresnel's formula leaves of it") {
  Textures textures;
  Materials materials(&textures);
  for (const float share : {0.0f, 0.5f, 1.0f}) {
    const uint32_t id = add_material(materials, {closure(SPPM_EMISSION, 1), coat(share), closure(SPPM_EMISSION, 2)});
    CHECK(materials.emits_through_coat(id));
    for (const int step : {2, 4, 6, 9, 12, 15}) {  // where the coat's table has its values
      const float cosine = static_cast<float>(step) / 15;
      CAPTURE(share);
      CAPTURE(cosine);
      const float expected = 1 + 2 * (1 - share * fresnel_dielectric(cosine, 1.5f));
      CHECK(materials.emission(id, {}, cosine).x == doctest::Approx(expected).epsilon(1e-4));
    }
  }
}

TEST_CASE("emission is dimmed by coats as a white diffuse surface in its place is") {
  Textures textures;
  Materials materials(&textures);
  SppmClosureDesc absent = coat(1);
  for (float& w : absent.weight.value) w = 0;
  std::vector<SppmClosureDesc> closures;
  for (const SppmClosureDesc& above : {coat(0), coat(0.7f, 0.2f), coat(1, 0.6f, SPPM_CLOSURE_UNDER_COAT), coat(0.4f), absent})
    for (const SppmClosureDesc& c : {above, closure(SPPM_EMISSION, 1), closure(SPPM_DIFFUSE, 1)}) closures.push_back(c);
  const uint32_t id = add_material(materials, closures);
  Bsdf bsdf(ShadingPoint{{0, 0, 1}, Frame({0, 0, 1})});
  materials.lobes(id, {}, bsdf);
  float most = 0;
  for (const float cosine : {0.05f, 0.2f, 0.43f, 0.8f, 1.0f}) {
    CAPTURE(cosine);
    const Vec3 wo{std::sqrt(1 - cosine * cosine), 0, cosine};
    float expected = 0;
    for (const Lobe& lobe : bsdf)
      if (lobe.diffuse()) expected += kPi * evaluate(lobe, bsdf.at, wo, {0, 0, 1}).x;
    CHECK(materials.emission(id, {}, cosine).x == doctest::Approx(expected).epsilon(1e-5));
    most = std::max(most, 5 - expected);
  }
  CHECK(most > 0.5f);  // something was dimmed
}

TEST_CASE("emission that no coat dims is what was given, whatever coats are beside it") {
  Textures textures;
  Materials materials(&textures);
  SppmClosureDesc clear = coat(1);
  clear.flags = 0;  // takes nothing from what lies below
  for (const auto& closures : {std::vector{closure(SPPM_EMISSION, 0.3f), coat(1)}, std::vector{clear, closure(SPPM_EMISSION, 0.3f)}}) {
    const uint32_t id = add_material(materials, closures);
    CHECK_FALSE(materials.emits_through_coat(id));
    for (const float cosine : {0.01f, 0.5f, 1.0f}) CHECK(materials.emission(id, {}, cosine).x == 0.3f);
  }
}
