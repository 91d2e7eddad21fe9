// Chooses one of many lights for a point: a binary tree of their bounds, walked by what each half could do there.
//
// After Conty and Kulla (2018), without the receiver's normal. A node's estimate is never 0 where one of its lights shines.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "vecmath.h"

namespace sppm {

// Where a light is, how strong it is, and where to.
struct LightBounds {
  Vec3 center;
  float radius = 0;     // of a ball around it [m]
  float intensity = 0;  // luminance, along the axis [W sr^-1]
  Vec3 axis{0, 0, 1};
  float spread = kPi;   // it shines with full intensity within this angle of its axis,
  float fade = 0;       // with the cosine of what is beyond that up to this much more, and not at all farther off

  float irradiance(Vec3 p) const;  // about what it can bring to p [W m^-2]
};

class LightTree {
 public:
  void build(const std::vector<LightBounds>& lights);  // those of no intensity are never chosen

  struct Choice {
    uint32_t light;
    float probability;
  };
  // Empty if no light shines at p. Makes u a fresh number in [0, 1).
  std::optional<Choice> sample(Vec3 p, float& u) const;
  // With which `sample` chooses the light.
  float probability(uint32_t light, Vec3 p) const;
  float irradiance(Vec3 p) const { return nodes_.empty() ? 0.0f : nodes_[0].bounds.irradiance(p); }

 private:
  static constexpr uint32_t kNone = ~0u;
  struct Node {
    LightBounds bounds;
    uint32_t right = kNone;  // the left child follows its parent; kNone: a leaf
    uint32_t light = kNone;
    uint32_t parent = kNone;
  };
  uint32_t add(const std::vector<LightBounds>& lights, uint32_t* begin, uint32_t* end, uint32_t parent);
  // Probability of the left child.
  float left_share(uint32_t node, Vec3 p) const;

  std::vector<Node> nodes_;
  std::vector<uint32_t> leaf_of_;  // light -> node
};

}  // namespace sppm
