#include "box_tree.h"

#include <numeric>

namespace sppm {

void BoxTree::build(std::span<const Bounds> boxes) {
  nodes_.clear();
  order_.resize(boxes.size());
  std::iota(order_.begin(), order_.end(), 0u);
  if (!boxes.empty()) build(boxes, 0, static_cast<uint32_t>(boxes.size()));
}

// Halves of equal number along the axis over which the centres spread the most; the depth is then the logarithm of the number.
void BoxTree::build(std::span<const Bounds> boxes, uint32_t begin, uint32_t end) {
  const size_t here = nodes_.size();
  nodes_.emplace_back();
  Bounds all, centers;
  for (uint32_t i = begin; i < end; ++i) all.add(boxes[order_[i]]), centers.add(boxes[order_[i]].center());
  nodes_[here].bounds = all;
  if (end - begin <= kLeaf) {
    nodes_[here].second = begin, nodes_[here].count = end - begin;
    return;
  }
  const Vec3 spread = centers.hi - centers.lo;
  const int axis = spread.x >= spread.y && spread.x >= spread.z ? 0 : spread.y >= spread.z ? 1 : 2;
  const uint32_t middle = begin + (end - begin) / 2;
  std::nth_element(order_.begin() + begin, order_.begin() + middle, order_.begin() + end, [&](uint32_t a, uint32_t b) {
    const float x = boxes[a].center()[axis], y = boxes[b].center()[axis];
    return x < y || (x == y && a < b);  // ties too in one order only
  });
  build(boxes, begin, middle);
  nodes_[here].second = static_cast<uint32_t>(nodes_.size());
  build(boxes, middle, end);
}

}  // namespace sppm
