#include "grid.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "photon_map.h"

using namespace sppm;

namespace {

struct Query {
  Vec3 p;
  float radius;
};

// Queries with radii over six orders of magnitude, and photons of which most are near one of them. A photon's power is its number.
struct Cloud {
  std::vector<Query> queries;
  std::vector<Photon> photons;

  Cloud(int query_count, int photon_count) {
    std::mt19937 random(4);
    std::uniform_real_distribution<float> uniform(-1, 1);
    const auto point = [&] { return Vec3{uniform(random), uniform(random), uniform(random)}; };
    for (int i = 0; i < query_count; ++i) queries.push_back({point() * 3, std::pow(10.0f, -3 + 3 * uniform(random))});
    for (int i = 0; i < photon_count; ++i) {
      const Query& near = queries[random() % queries.size()];
      const Vec3 p = i % 4 == 0 ? point() * 3 : near.p + point() * (1.3f * near.radius);
      photons.push_back({p, {static_cast<float>(i), 0, 0}});
    }
  }
  void announce(PhotonMap& map) const {
    map.reset(queries.size());
    for (const Query& q : queries) map.announce({q.p, q.radius});
  }
  void build(PhotonMap& map, uint32_t threads) const {
    announce(map);
    std::vector<PhotonMap::Block> blocks(3);
    for (size_t i = 0; i < photons.size(); ++i) {
      PhotonMap::Block& b = blocks[i * blocks.size() / photons.size()];
      map.occupancy().visit_marked(photons[i].p, [&](CellKey key) {
        b.keys.push_back(key);
        b.owners.push_back(static_cast<uint32_t>(b.photons.size()));
      });
      b.photons.push_back(photons[i]);
    }
    map.build(blocks, Threads(threads));
  }
};

std::vector<int> found(const PhotonMap& map, const Query& q) {
  std::vector<int> ids;
  map.visit_within({q.p, q.radius}, [&](const PhotonGroup& group, uint32_t lanes) {
    for (uint32_t lane = 0; lane < PhotonGroup::kLanes; ++lane)
      if (lanes >> lane & 1) ids.push_back(static_cast<int>(group.power(lane).x));
  });
  return ids;
}

std::vector<int> brute_force(const Cloud& cloud, const Query& q) {
  std::vector<int> ids;
  for (size_t i = 0; i < cloud.photons.size(); ++i)
    if (length_squared(cloud.photons[i].p - q.p) < q.radius * q.radius) ids.push_back(static_cast<int>(i));
  return ids;
}

}  // namespace

TEST_CASE("a lookup finds each photon within its radius exactly once") {
  const Cloud cloud(600, 20000);
  PhotonMap map;
  cloud.build(map, 1);
  size_t total = 0;
  for (const Query& q : cloud.queries) {
    auto ids = found(map, q);
    std::sort(ids.begin(), ids.end());
    CHECK(ids == brute_force(cloud, q));
    total += ids.size();
  }
  CHECK(total > 5000);
}

TEST_CASE("the order of what is found does not depend on threads") {
  const Cloud cloud(200, 150000);
  PhotonMap one, two, four;
  cloud.build(one, 1), cloud.build(two, 2), cloud.build(four, 4);
  CHECK(one.stored() == four.stored());
  for (const Query& q : cloud.queries) {
    const auto expected = found(one, q);
    CHECK(expected == found(two, q));
    CHECK(expected == found(four, q));
  }
}

TEST_CASE("a map may be filled again, for other queries") {
  PhotonMap map;
  const Cloud first(50, 1000), second(400, 3000);
  first.build(map, 1), second.build(map, 1);
  for (const Query& q : second.queries) CHECK(found(map, q).size() == brute_force(second, q).size());
}

TEST_CASE("a photon takes at most 48 bytes in the map, and what announced queries leave behind is counted apart") {
  PhotonMap map;
  map.reset(1);
  map.announce({Vec3{}, 1});
  std::mt19937 random(5);
  std::uniform_real_distribution<float> uniform(-1, 1);
  std::vector<PhotonMap::Block> blocks(1);
  for (uint32_t i = 0; i < 300000; ++i) {
    const Vec3 p = Vec3{uniform(random), uniform(random), uniform(random)} * 0.5f;
    map.occupancy().visit_marked(p, [&](CellKey key) {
      blocks[0].keys.push_back(key);
      blocks[0].owners.push_back(i);
    });
    blocks[0].photons.push_back({p, {1, 1, 1}});
  }
  map.build(blocks, Threads(1));
  const double bytes = static_cast<double>(map.memory() - map.occupancy().memory()) / static_cast<double>(map.stored());
  MESSAGE("bytes a stored photon: ", bytes);
  CHECK(map.stored() == 300000);
  CHECK(bytes <= 48);
}

TEST_CASE("far from the origin, at the smallest radius that positions resolve") {
  const float radius = 32 * 0x1p-23f * 1000;
  PhotonMap map;
  map.reset(1);
  map.announce({{1000, -1000, 1000}, radius});
  std::vector<PhotonMap::Block> blocks(1);
  for (int i = -100; i <= 100; ++i) {
    const Vec3 p{1000 + static_cast<float>(i) * 0x1p-14f, -1000, 1000};
    map.occupancy().visit_marked(p, [&](CellKey key) {
      blocks[0].keys.push_back(key);
      blocks[0].owners.push_back(static_cast<uint32_t>(blocks[0].photons.size()));
    });
    blocks[0].photons.push_back({p, {1, 1, 1}});
  }
  map.build(blocks, Threads(1));
  CHECK(found(map, {{1000, -1000, 1000}, radius}).size() == 2 * static_cast<size_t>(std::ceil(radius * 0x1p14f) - 1) + 1);
}

TEST_CASE("a ball meets at most eight cells") {
  std::mt19937 random(6);
  std::uniform_real_distribution<float> uniform(-1, 1);
  for (int i = 0; i < 10000; ++i) {
    int cells = 0;
    visit_cell_runs({uniform(random), uniform(random), uniform(random)}, std::pow(10.0f, 3 * uniform(random) - 3),
                    [&](CellKey, uint32_t more) { cells += static_cast<int>(1 + more); });
    CHECK((cells >= 1 && cells <= 8));
  }
}

TEST_CASE("a level's cells are wider than its queries' balls, and the next level's are twice as wide") {
  for (const float radius : {1e-15f, 1e-6f, 0.3f, 0.4f, 0.5f, 1.0f, 7.0f, 1e15f}) {
    const float width = 1 / inverse_width(grid_level(radius));
    CHECK((width >= 2.5f * radius && width <= 5 * radius));
    CHECK(grid_level(2 * radius) <= grid_level(radius) + 1);
  }
}

TEST_CASE("cells keep all elements, in their first order") {
  for (const size_t n : {size_t{0}, size_t{1}, size_t{2}, size_t{1000}, size_t{200000}}) {
    std::vector<CellKey> keys(n);
    for (size_t i = 0; i < n; ++i) keys[i] = hash64(i * 7 % 5000);
    Grid one, four;
    const auto order = one.build(keys, Threads(1)), by_four = four.build(keys, Threads(4));
    CHECK(one.empty() == (n == 0));
    CHECK(std::equal(order.get(), order.get() + n, by_four.get()));
    std::vector<int> seen(n, 0);
    for (size_t i = 0; i < n; ++i) ++seen[order[i]];
    CHECK(std::all_of(seen.begin(), seen.end(), [](int count) { return count == 1; }));
    for (size_t k = 0; k < std::min<size_t>(n, 500); ++k) {
      const auto [begin, end] = one.range(keys[k], 0);
      std::vector<uint32_t> mine;
      for (uint32_t i = begin; i < end; ++i)
        if (keys[order[i]] == keys[k]) mine.push_back(order[i]);
      CHECK(static_cast<size_t>(std::count(keys.begin(), keys.end(), keys[k])) == mine.size());
      CHECK(std::is_sorted(mine.begin(), mine.end()));
    }
  }
}
