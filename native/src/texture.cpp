#include "texture.h"

#include <string>

#include "status.h"

namespace sppm {
namespace {

Vec3 blend(uint32_t mode, Vec3 a, Vec3 b) {
  switch (mode) {
    case SPPM_BLEND_MULTIPLY: return a * b;
    case SPPM_BLEND_ADD: return a + b;
    case SPPM_BLEND_SUBTRACT: return a - b;
    case SPPM_BLEND_SCREEN: return splat(1) - (splat(1) - a) * (splat(1) - b);
    case SPPM_BLEND_DIFFERENCE: return abs(a - b);
    case SPPM_BLEND_DARKEN: return min(a, b);
    case SPPM_BLEND_LIGHTEN: return max(a, b);
    default: return b;
  }
}

}  // namespace

uint32_t Textures::add_image(const SppmImageDesc& desc) {
  images_.emplace_back(desc);
  return static_cast<uint32_t>(images_.size());
}

uint32_t Textures::add_texture(const SppmTextureDesc& desc) {
  const std::string where = "texture " + std::to_string(textures_.size() + 1) + ": ";
  require(desc.type <= SPPM_TEXTURE_MIX, where + "type must be an SppmTextureType");
  require(desc.interpolation <= SPPM_CLOSEST && desc.extension <= SPPM_MIRROR && desc.blend <= SPPM_BLEND_LIGHTEN,
          where + "interpolation, extension or blend out of range");
  require(std::isfinite(desc.value[0]) && std::isfinite(desc.value[1]) && std::isfinite(desc.value[2]), where + "value must be finite");
  if (desc.type == SPPM_TEXTURE_IMAGE || desc.type == SPPM_TEXTURE_IMAGE_ALPHA)
    require(desc.image >= 1 && desc.image <= images_.size(), where + "image must be an id of this scene");
  if (desc.type == SPPM_TEXTURE_MIX)
    for (const uint32_t child : {desc.a, desc.b, desc.factor})
      require(child >= 1 && child <= textures_.size(), where + "a, b and factor must be textures added before");
  Texture texture{desc, {}};
  bool given = false;
  for (const float m : desc.mapping) {
    require(std::isfinite(m), where + "mapping must be finite");
    given |= m != 0;
  }
  if (given) std::copy(desc.mapping, desc.mapping + 12, texture.mapping.m.begin());
  textures_.push_back(texture);
  return static_cast<uint32_t>(textures_.size());
}

Vec3 Textures::evaluate(uint32_t id, const SurfaceAttributes& at) const {
  const Texture& texture = textures_[id - 1];
  const SppmTextureDesc& d = texture.desc;
  switch (d.type) {
    case SPPM_TEXTURE_IMAGE:
    case SPPM_TEXTURE_IMAGE_ALPHA: {
      const Vec3 p = texture.mapping.point({at.uv.x, at.uv.y, 0});
      const Rgba c = images_[d.image - 1].sample({p.x, p.y}, static_cast<SppmInterpolation>(d.interpolation),
                                                 static_cast<SppmExtension>(d.extension));
      return d.type == SPPM_TEXTURE_IMAGE ? c.color : splat(c.alpha);
    }
    case SPPM_TEXTURE_ATTRIBUTE: return at.color;
    case SPPM_TEXTURE_MIX: {
      const float factor = std::clamp(evaluate(d.factor, at).x, 0.0f, 1.0f);
      const Vec3 a = evaluate(d.a, at);
      return lerp(a, blend(d.blend, a, evaluate(d.b, at)), factor);
    }
    default: return {d.value[0], d.value[1], d.value[2]};
  }
}

uint64_t Textures::memory() const {
  uint64_t bytes = textures_.size() * sizeof(Texture);
  for (const Image& image : images_) bytes += image.memory();
  return bytes;
}

}  // namespace sppm
