// Lights without a scene around them, for tests.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "closures.h"
#include "light.h"

namespace sppm {

// The square metre that photons are caught on, in tiles, and something beside it.
inline Targets make_targets(float z) {
  std::vector<Caster> casters;
  for (int i = 0; i < 16; ++i) {
    const float x = static_cast<float>(i / 4) / 4, y = static_cast<float>(i % 4) / 4 - 0.5f;
    Caster tile{{}, 0.3f + 0.7f * static_cast<float>(i % 3)};
    tile.bounds.add(Vec3{x, y, z}), tile.bounds.add(Vec3{x + 0.25f, y + 0.25f, z});
    casters.push_back(tile);
  }
  Caster other{{}, 1};
  other.bounds.add(Vec3{-1, -0.2f, -0.7f}), other.bounds.add(Vec3{-0.6f, 0.2f, -0.3f});
  casters.push_back(other);
  Targets targets;
  targets.build(casters);
  return targets;
}

// Lights of a scene whose bounding sphere has radius 2 around the origin.
struct Rig {
  Textures textures;
  Materials materials{&textures};
  Lights lights{&textures, &materials};

  void commit(float z = 0) {
    const float e = 2 / std::sqrt(3.0f);
    lights.commit({splat(-e), splat(e)}, make_targets(z));
  }
  uint32_t image(uint64_t width, uint64_t height, const std::vector<float>& pixels) {
    SppmImageDesc d{};
    d.struct_size = sizeof d;
    d.width = width, d.height = height, d.pixels = pixels.data();
    return textures.add_image(d);
  }
  uint32_t image_texture(uint32_t of_image) {
    SppmTextureDesc d{};
    d.struct_size = sizeof d;
    d.type = SPPM_TEXTURE_IMAGE, d.image = of_image, d.interpolation = SPPM_CLOSEST;
    return textures.add_texture(d);
  }
  // `turned` by an angle whose cosine is 0.6 about z.
  void set_world(float radiance, uint32_t of_image = 0, bool turned = false) {
    SppmWorldDesc d{};
    d.struct_size = sizeof d;
    for (float& r : d.radiance) r = radiance;
    d.image = of_image;
    const float rotation[9] = {0.6f, 0.8f, 0, -0.8f, 0.6f, 0, 0, 0, 1};
    if (turned) std::copy(rotation, rotation + 9, d.rotation);
    lights.set_world(d);
  }
  // A material that emits `radiance`, times the texture.
  uint32_t glow(float radiance, uint32_t texture = 0) {
    SppmClosureDesc c{};
    c.struct_size = sizeof c;
    c.type = SPPM_EMISSION;
    for (int i = 0; i < 3; ++i) c.weight.value[i] = 1, c.color.value[i] = radiance;
    c.color.texture = texture;
    SppmMaterialDesc d{};
    d.struct_size = sizeof d;
    d.closure_count = 1, d.closures = &c;
    return materials.add(d);
  }
  // The same under a smooth coat of index 1.5 that covers all of it.
  uint32_t coated_glow(float radiance) {
    SppmClosureDesc c[] = {closure(SPPM_COAT, 1), closure(SPPM_EMISSION, radiance)};
    c[0].flags = SPPM_CLOSURE_ATTENUATE;
    SppmMaterialDesc d{};
    d.struct_size = sizeof d;
    d.closure_count = 2, d.closures = c;
    return materials.add(d);
  }
  EmissiveTriangle triangle(Vec3 a, Vec3 b, Vec3 c, uint32_t material) const {
    EmissiveTriangle t;
    t.p = {a, b, c};
    t.material = material;
    return t;
  }
};

inline constexpr float kRadius = 2 * 1.001f;  // of the sphere, the library's margin included

inline SppmLightDesc lamp(SppmLightType type) {  // 3 m above the origin, shining down
  SppmLightDesc d{};
  d.struct_size = sizeof d;
  d.type = type;
  d.transform[0] = d.transform[5] = d.transform[10] = 1, d.transform[11] = 3;
  d.emission[0] = 1, d.emission[1] = 2, d.emission[2] = 4;
  d.size_x = 2, d.size_y = 1;
  d.angle = type == SPPM_LIGHT_SPOT ? 1.2f : 0;
  return d;
}

// One of each type that a ray can meet.
inline std::vector<SppmLightDesc> sized_lamps() {
  std::vector<SppmLightDesc> lamps;
  for (const SppmLightType type : {SPPM_LIGHT_POINT, SPPM_LIGHT_SPOT, SPPM_LIGHT_SUN, SPPM_LIGHT_RECTANGLE, SPPM_LIGHT_ELLIPSE}) {
    SppmLightDesc& d = lamps.emplace_back(lamp(type));
    if (type == SPPM_LIGHT_SUN)
      d.angle = 0.3f;
    else if (type == SPPM_LIGHT_POINT || type == SPPM_LIGHT_SPOT)
      d.radius = 0.4f, d.blend = 0.5f;
  }
  return lamps;
}

}  // namespace sppm
