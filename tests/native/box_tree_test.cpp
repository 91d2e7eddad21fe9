#include "box_tree.h"

#include <doctest/doctest.h>

#include <random>
#include <set>
#include <vector>

#include "sampling.h"

using namespace sppm;

namespace {

std::set<uint32_t> visited(const BoxTree& tree, Vec3 origin, Vec3 direction, float far) {
  std::set<uint32_t> found;
  bool once = true;
  tree.visit_along(origin, direction, far, [&](uint32_t i) { once &= found.insert(i).second; });
  CHECK(once);
  return found;
}

}  // namespace

TEST_CASE("a ray visits every box that it passes through, and few others") {
  std::mt19937 random(5);
  std::uniform_real_distribution<float> uniform;
  for (const uint32_t count : {1u, 4u, 5u, 1000u}) {
    std::vector<Vec3> centers;
    std::vector<Bounds> boxes;
    for (uint32_t i = 0; i < count; ++i) {
      centers.push_back({uniform(random), uniform(random), uniform(random)});
      const Vec3 half{0.02f * uniform(random), 0.02f * uniform(random), 0};  // flat
      boxes.push_back({centers[i] - half, centers[i] + half});
    }
    BoxTree tree;
    tree.build(boxes);
    size_t visits = 0;
    constexpr int rays = 2000;
    for (int k = 0; k < rays; ++k) {
      const auto target = static_cast<uint32_t>(k) % count;
      const Vec3 origin = Vec3{0.5f, 0.5f, 0.5f} + sample_sphere({uniform(random), uniform(random)}) * 3;
      const float distance = length(centers[target] - origin);
      const Vec3 direction = (centers[target] - origin) / distance;
      const auto found = visited(tree, origin, direction, distance * 1.001f);
      CHECK(found.contains(target));
      CHECK(visited(tree, origin, -direction, kInfinity).size() < count / 10 + 5);
      visits += found.size();
    }
    CHECK(visits < rays * (5 + count / 20));
  }
}

TEST_CASE("boxes in one place, rays in the plane of flat ones, and no box at all") {
  BoxTree tree;
  CHECK(visited(tree, {}, {1, 0, 0}, kInfinity).empty());
  tree.build({});
  CHECK(visited(tree, {}, {1, 0, 0}, kInfinity).empty());
  const std::vector<Bounds> boxes(100, Bounds{{1, 0, 0}, {2, 1, 0}});
  tree.build(boxes);
  CHECK(visited(tree, {0, 0.5f, 0}, {1, 0, 0}, kInfinity).size() == 100);
  CHECK(visited(tree, {0, 0.5f, 0}, {1, 0, 0}, 0.9f).empty());
  CHECK(visited(tree, {0, 2, 0}, {1, 0, 0}, kInfinity).empty());
}
