#include <cmath>

#include "material.h"

#include <doctest/doctest.h>

using namespace sppm;

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
