// A tree of boxes: which of very many a ray meets. For what the ray tracer does not hold, like lamps.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "vecmath.h"

namespace sppm {

class BoxTree {
 public:
  void build(std::span<const Bounds> boxes);

  // Calls visit(index) for the boxes that a ray meets up to `far`, and now and then for one that it misses; the order is the tree's.
  template <typename Visit>
  void visit_along(Vec3 origin, Vec3 direction, float far, Visit visit) const {
    if (nodes_.empty()) return;
    const Vec3 inverse{1 / direction.x, 1 / direction.y, 1 / direction.z};
    uint32_t stack[kDeepest], size = 0, at = 0;
    for (;;) {
      const Node& node = nodes_[at];
      if (meets(node.bounds, origin, inverse, far)) {
        if (node.count == 0) {
          stack[size++] = node.second;
          ++at;  // the first child follows its parent
          continue;
        }
        for (uint32_t i = 0; i < node.count; ++i) visit(order_[node.second + i]);
      }
      if (size == 0) return;
      at = stack[--size];
    }
  }

 private:
  static constexpr uint32_t kDeepest = 64, kLeaf = 4;

  struct Node {
    Bounds bounds;
    uint32_t second = 0;  // child of an inner node, first element of a leaf in `order_`
    uint32_t count = 0;   // elements of a leaf, 0 for an inner node
  };

  static bool meets(const Bounds& box, Vec3 origin, Vec3 inverse, float far) {
    float enter = 0, leave = far;
    for (int axis = 0; axis < 3; ++axis) {
      // 0 times infinity, of a ray in the plane of a side, is no number: it drops out, and such a ray may count as outside.
      const float a = (box.lo[axis] - origin[axis]) * inverse[axis], b = (box.hi[axis] - origin[axis]) * inverse[axis];
      enter = std::max(enter, std::min(a, b));
      leave = std::min(leave, std::max(a, b));
    }
    constexpr float kSlack = 1 + 8 * 0x1p-23f;  // three roundings each: a flat box must not be missed
    return enter <= leave * kSlack;
  }
  void build(std::span<const Bounds> boxes, uint32_t begin, uint32_t end);

  std::vector<Node> nodes_;
  std::vector<uint32_t> order_;
};

}  // namespace sppm
