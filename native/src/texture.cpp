#include "texture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>

#include "status.h"

namespace sppm {
namespace {

// The results of so many steps find room on the stack.
constexpr size_t kMostSteps = 256;
// Not cleared: few steps are the rule.
union Results {
  Results() {}
  std::array<Vec3, kMostSteps> of;
};

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
  Texture texture{desc, {}, {}};
  if (desc.type == SPPM_TEXTURE_MIX) texture.steps = mix_steps(desc, where);
  bool given = false;
  for (const float m : desc.mapping) {
    require(std::isfinite(m), where + "mapping must be finite");
    given |= m != 0;
  }
  if (given) std::copy(desc.mapping, desc.mapping + 12, texture.mapping.m.begin());
  textures_.push_back(texture);
  return static_cast<uint32_t>(textures_.size());
}

// Recursion would visit a texture as often as there are ways to it: in a chain of mixes that each use the one before twice, 2^n times.
std::vector<Textures::Step> Textures::mix_steps(const SppmTextureDesc& mix, const std::string& where) const {
  std::set<uint32_t> needed;  // in order of their ids, so operands come first
  for (const uint32_t child : {mix.a, mix.b, mix.factor}) {
    needed.insert(child);
    for (const Step& step : textures_[child - 1].steps) needed.insert(step.texture);
  }
  require(needed.size() < kMostSteps, where + "rests on more than " + std::to_string(kMostSteps - 1) + " textures");
  std::vector<Step> steps;
  std::map<uint32_t, uint32_t> result;  // texture -> its step
  const auto add = [&](uint32_t id, const SppmTextureDesc& d) {
    Step step{id, 0, 0, 0};
    if (d.type == SPPM_TEXTURE_MIX) step = {id, result.at(d.a), result.at(d.b), result.at(d.factor)};
    result[id] = static_cast<uint32_t>(steps.size());
    steps.push_back(step);
  };
  for (const uint32_t id : needed) add(id, textures_[id - 1].desc);
  add(static_cast<uint32_t>(textures_.size() + 1), mix);
  return steps;
}

Vec3 Textures::evaluate(uint32_t id, const SurfaceAttributes& at) const {
  const Texture& texture = textures_[id - 1];
  if (texture.steps.empty()) return evaluate_source(texture, at);
  Results results;
  size_t count = 0;
  for (const Step& step : texture.steps) {
    const Texture& t = textures_[step.texture - 1];
    Vec3& result = results.of[count++];
    if (t.steps.empty()) {
      result = evaluate_source(t, at);
    } else {
      const Vec3 a = results.of[step.a], b = results.of[step.b];
      result = lerp(a, blend(t.desc.blend, a, b), std::clamp(results.of[step.factor].x, 0.0f, 1.0f));
    }
  }
  return results.of[count - 1];
}

Vec3 Textures::evaluate_source(const Texture& texture, const SurfaceAttributes& at) const {
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
    default: return {d.value[0], d.value[1], d.value[2]};
  }
}

uint64_t Textures::memory() const {
  uint64_t bytes = textures_.size() * sizeof(Texture);
  for (const Texture& texture : textures_) bytes += texture.steps.size() * sizeof(Step);
  for (const Image& image : images_) bytes += image.memory();
  return bytes;
}

}  // namespace sppm
