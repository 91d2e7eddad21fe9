#include "light_tree.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace sppm {
namespace {

float angle_between(Vec3 a, Vec3 b) { return std::acos(std::clamp(dot(a, b), -1.0f, 1.0f)); }

LightBounds join(const LightBounds& a, const LightBounds& b) {
  LightBounds both;
  const Vec3 between = b.center - a.center;
  const float d = length(between);
  if (d + b.radius <= a.radius) {
    both.center = a.center, both.radius = a.radius;
  } else if (d + a.radius <= b.radius) {
    both.center = b.center, both.radius = b.radius;
  } else {
    both.radius = 0.5f * (d + a.radius + b.radius);
    both.center = a.center + between * ((both.radius - a.radius) / d);
  }
  both.intensity = a.intensity + b.intensity;
  const Vec3 sum = a.axis + b.axis;
  both.axis = length_squared(sum) > 0 ? normalize(sum) : a.axis;
  both.spread = std::min(kPi, std::max(angle_between(both.axis, a.axis) + a.spread, angle_between(both.axis, b.axis) + b.spread));
  both.fade = std::max(a.fade, b.fade);
  return both;
}

}  // namespace

float LightBounds::irradiance(Vec3 p) const {
  const Vec3 to_point = p - center;
  const float d2 = length_squared(to_point), r2 = square(radius);
  float off = 0;  // how far p is outside the full intensity, at least
  if (d2 > r2 && spread < kPi) {
    off = angle_between(axis, to_point / std::sqrt(d2)) - std::asin(std::sqrt(r2 / d2)) - spread - 1e-3f;
    if (off > fade) return 0;
  }
  return intensity * std::max(std::cos(std::max(off, 0.0f)), 0.0f) / std::max({d2, r2, std::numeric_limits<float>::min()});
}

uint32_t LightTree::add(const std::vector<LightBounds>& lights, uint32_t* begin, uint32_t* end, uint32_t parent) {
  const auto index = static_cast<uint32_t>(nodes_.size());
  nodes_.push_back({});
  nodes_[index].parent = parent;
  if (end - begin == 1) {
    nodes_[index].bounds = lights[*begin];
    nodes_[index].light = *begin;
    leaf_of_[*begin] = index;
    return index;
  }
  Bounds centers;
  for (const uint32_t* i = begin; i != end; ++i) centers.add(lights[*i].center);
  const Vec3 size = centers.hi - centers.lo;
  const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
  uint32_t* half = begin + (end - begin) / 2;
  std::nth_element(begin, half, end, [&](uint32_t a, uint32_t b) {
    return lights[a].center[axis] != lights[b].center[axis] ? lights[a].center[axis] < lights[b].center[axis] : a < b;
  });
  add(lights, begin, half, index);
  const uint32_t right = add(lights, half, end, index);
  nodes_[index].right = right;
  nodes_[index].bounds = join(nodes_[index + 1].bounds, nodes_[right].bounds);
  return index;
}

void LightTree::build(const std::vector<LightBounds>& lights) {
  std::vector<uint32_t> lit;
  for (uint32_t i = 0; i < lights.size(); ++i)
    if (lights[i].intensity > 0) lit.push_back(i);
  leaf_of_.assign(lights.size(), kNone);
  nodes_.clear();
  if (!lit.empty()) add(lights, lit.data(), lit.data() + lit.size(), kNone);
}

float LightTree::left_share(uint32_t node, Vec3 p) const {
  const float left = nodes_[node + 1].bounds.irradiance(p), right = nodes_[nodes_[node].right].bounds.irradiance(p);
  return left + right > 0 ? left / (left + right) : -1.0f;
}

std::optional<LightTree::Choice> LightTree::sample(Vec3 p, float& u) const {
  if (nodes_.empty() || nodes_[0].bounds.irradiance(p) == 0) return std::nullopt;
  Choice choice{0, 1};
  uint32_t node = 0;
  while (nodes_[node].right != kNone) {
    const float left = left_share(node, p);
    if (left < 0) return std::nullopt;
    const bool goes_left = u < left;
    const float share = goes_left ? left : 1 - left;
    u = std::min((goes_left ? u : u - left) / share, 0x1.fffffep-1f);
    choice.probability *= share;
    node = goes_left ? node + 1 : nodes_[node].right;
  }
  choice.light = nodes_[node].light;
  return choice;
}

float LightTree::probability(uint32_t light, Vec3 p) const {
  uint32_t node = leaf_of_[light];
  if (node == kNone) return 0;
  float probability = 1;
  for (uint32_t parent; (parent = nodes_[node].parent) != kNone; node = parent) {
    const float left = left_share(parent, p);
    if (left < 0) return 0;
    probability *= node == parent + 1 ? left : 1 - left;
  }
  return nodes_[0].bounds.irradiance(p) > 0 ? probability : 0;
}

}  // namespace sppm
