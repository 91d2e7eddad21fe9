#include <algorithm>

#include "texture.h"

#include <doctest/doctest.h>

#include "status.h"

using namespace sppm;

namespace {

SppmTextureDesc desc(SppmTextureType type, Vec3 value = {}) {
  SppmTextureDesc d{};
  d.struct_size = sizeof d;
  d.type = type;
  d.value[0] = value.x, d.value[1] = value.y, d.value[2] = value.z;
  return d;
}

uint32_t constant(Textures& t, Vec3 value) { return t.add_texture(desc(SPPM_TEXTURE_CONSTANT, value)); }

void check(Vec3 a, Vec3 b) { CHECK(length(a - b) < 1e-6f); }

}  // namespace

TEST_CASE("every blend mode does what its name says, in the measure of the factor") {
  const Vec3 a{0.5f, 0.2f, 0.8f}, b{0.25f, 0.6f, 0.1f};
  const std::pair<uint32_t, Vec3> modes[] = {
      {SPPM_BLEND_MIX, b},
      {SPPM_BLEND_MULTIPLY, {0.125f, 0.12f, 0.08f}},
      {SPPM_BLEND_ADD, {0.75f, 0.8f, 0.9f}},
      {SPPM_BLEND_SUBTRACT, {0.25f, -0.4f, 0.7f}},
      {SPPM_BLEND_SCREEN, {0.625f, 0.68f, 0.82f}},
      {SPPM_BLEND_DIFFERENCE, {0.25f, 0.4f, 0.7f}},
      {SPPM_BLEND_DARKEN, {0.25f, 0.2f, 0.1f}},
      {SPPM_BLEND_LIGHTEN, {0.5f, 0.6f, 0.8f}}};
  for (const auto& [mode, full] : modes)
    for (const float factor : {0.0f, 0.5f, 1.0f, 3.0f}) {
      Textures t;
      SppmTextureDesc mix = desc(SPPM_TEXTURE_MIX);
      mix.blend = mode, mix.a = constant(t, a), mix.b = constant(t, b), mix.factor = constant(t, splat(factor));
      check(t.evaluate(t.add_texture(mix), {}), lerp(a, full, std::min(factor, 1.0f)));
    }
}

TEST_CASE("images are looked up through the mapping") {
  Textures t;
  const float pixels[] = {1, 2, 3, 0.5f, 4, 5, 6, 0.25f};  // two texels side by side
  SppmImageDesc image{};
  image.width = 2, image.height = 1, image.pixels = pixels;
  SppmTextureDesc d = desc(SPPM_TEXTURE_IMAGE);
  d.image = t.add_image(image), d.interpolation = SPPM_CLOSEST;
  const SurfaceAttributes left{{0.25f, 0.5f}, {1, 1, 1}};
  check(t.evaluate(t.add_texture(d), left), {1, 2, 3});
  d.mapping[0] = d.mapping[5] = d.mapping[10] = 1, d.mapping[3] = 0.5f;
  check(t.evaluate(t.add_texture(d), left), {4, 5, 6});
  d.type = SPPM_TEXTURE_IMAGE_ALPHA;
  check(t.evaluate(t.add_texture(d), left), splat(0.25f));
}

TEST_CASE("attributes are passed through, and a parameter multiplies its texture") {
  Textures t;
  const SurfaceAttributes at{{}, {0.1f, 0.2f, 0.3f}};
  const uint32_t attribute = t.add_texture(desc(SPPM_TEXTURE_ATTRIBUTE));
  check(t.evaluate(attribute, at), {0.1f, 0.2f, 0.3f});
  check(Param{{2, 3, 4}, attribute}.color(t, at), {0.2f, 0.6f, 1.2f});
  check(Param{{2, 3, 4}, 0}.color(t, at), {2, 3, 4});
  CHECK(Param{{2, 3, 4}, attribute}.scalar(t, at) == doctest::Approx(0.2));
}

TEST_CASE("textures refer to earlier ones and to images of the scene only") {
  Textures t;
  SppmTextureDesc mix = desc(SPPM_TEXTURE_MIX);
  mix.a = mix.b = constant(t, {});
  mix.factor = 2;  // itself
  CHECK_THROWS_AS(t.add_texture(mix), Error);
  mix.factor = 0;
  CHECK_THROWS_AS(t.add_texture(mix), Error);
  CHECK_THROWS_AS(t.add_texture(desc(SPPM_TEXTURE_IMAGE)), Error);
  CHECK_THROWS_AS(t.add_texture(desc(static_cast<SppmTextureType>(99))), Error);
  CHECK_THROWS_AS(constant(t, {kInfinity, 0, 0}), Error);
  CHECK(t.count() == 1);
}

TEST_CASE("a texture that many mixes share is evaluated once, and what rests on too many is refused") {
  Textures t;
  const uint32_t attribute = t.add_texture(desc(SPPM_TEXTURE_ATTRIBUTE)), half = constant(t, splat(0.5f));
  uint32_t top = attribute;
  const auto average_with_itself = [&] {  // each step doubles the ways to the first
    SppmTextureDesc mix = desc(SPPM_TEXTURE_MIX);
    mix.a = mix.b = top, mix.factor = half;
    return t.add_texture(mix);
  };
  for (int i = 0; i < 253; ++i) top = average_with_itself();
  check(t.evaluate(top, {{}, {0.1f, 0.2f, 0.3f}}), {0.1f, 0.2f, 0.3f});
  top = average_with_itself();
  CHECK_THROWS_AS(average_with_itself(), Error);
}
