// Colours that vary over a surface: a short list of operations, each of which refers to earlier ones only.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "image.h"
#include "sppm/sppm.h"
#include "vecmath.h"

namespace sppm {

// What a texture can see of a surface point.
struct SurfaceAttributes {
  Vec2 uv;
  Vec3 color{1, 1, 1};
};

class Textures {
 public:
  // Ids start at 1. Both throw Error on bad fields.
  uint32_t add_image(const SppmImageDesc& desc);
  uint32_t add_texture(const SppmTextureDesc& desc);

  Vec3 evaluate(uint32_t texture, const SurfaceAttributes& at) const;
  const Image& image(uint32_t id) const { return images_[id - 1]; }
  size_t count() const { return textures_.size(); }
  size_t image_count() const { return images_.size(); }
  uint64_t memory() const;

 private:
  // Evaluates texture `texture`; a MIX takes its operands from the results of earlier steps.
  struct Step {
    uint32_t texture;
    uint32_t a, b, factor;
  };
  struct Texture {
    SppmTextureDesc desc;
    Affine mapping;
    std::vector<Step> steps;  // of a MIX: all that it rests on, each texture once, itself last
  };
  std::vector<Step> mix_steps(const SppmTextureDesc& mix, const std::string& where) const;
  Vec3 evaluate_source(const Texture& texture, const SurfaceAttributes& at) const;

  std::vector<Image> images_;
  std::vector<Texture> textures_;
};

// value * texture; `texture` 0 counts as 1.
struct Param {
  Vec3 value{1, 1, 1};
  uint32_t texture = 0;

  Vec3 color(const Textures& textures, const SurfaceAttributes& at) const {
    return texture == 0 ? value : value * textures.evaluate(texture, at);
  }
  float scalar(const Textures& textures, const SurfaceAttributes& at) const { return color(textures, at).x; }
};

}  // namespace sppm
