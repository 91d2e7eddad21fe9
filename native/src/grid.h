// Cells that hold points, for finding those within a radius. Knows positions and radii and nothing about light.
//
// Radii differ by orders of magnitude over a picture, so cells come in levels, each twice as wide as the one before, and a query
// of radius r looks only at the level whose cells are 2.5 to 5 r wide: it meets at most 8 of them. Points are stored at each level
// at which some query announced that it will look there (Occupancy). Blocks of 4 x 4 x 4 cells are hashed, so that what is near in space
// is near in memory; the stored tag tells aliases apart.
#pragma once

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "large_vector.h"
#include "parallel.h"
#include "sampling.h"
#include "vecmath.h"

namespace sppm {

// A cell of a level in 64 bits: the hash of its block, whose high bits choose where it is kept, and in the lowest 6 bits the cell's place
// in the block, x fastest.
using CellKey = uint64_t;

inline constexpr int kLevelBias = 64, kLevels = 128;

// Level for queries of radius r: its cells are 2^(level - kLevelBias) metres wide.
inline int grid_level(float radius) {
  // The exponent e of 2.5 r = m 2^e, with m in [1/2, 1).
  const int exponent = static_cast<int>(std::bit_cast<uint32_t>(2.5f * radius) >> 23) - 126;
  return std::clamp(exponent + kLevelBias, 0, kLevels - 1);
}

// 1 / width of a level's cells: a power of two, made of its exponent.
inline float inverse_width(int level) { return std::bit_cast<float>(static_cast<uint32_t>(127 + kLevelBias - level) << 23); }

inline constexpr uint64_t kCellsInBlock = 64;

inline CellKey cell_key(int64_t x, int64_t y, int64_t z, int level) {
  const auto u = [](int64_t i) { return static_cast<uint64_t>(i); };
  // Odd factors, as in the seeds of `Sampler`.
  const uint64_t block = hash64(u(x >> 2) * 0xd1342543de82ef95u + u(y >> 2) * 0xaf251af3b0f025b5u + u(z >> 2) * 0xb564ef22ec7aece5u +
                                u(level) * 0xf7c2ebc08f67f2b5u);
  return (block & ~(kCellsInBlock - 1)) | u(z & 3) << 4 | u(y & 3) << 2 | u(x & 3);
}

inline int64_t cell_index(float x, float inverse_width) { return static_cast<int64_t>(std::floor(x * inverse_width)); }

inline CellKey cell_key_at(Vec3 p, int level) {
  const float inverse = inverse_width(level);
  return cell_key(cell_index(p.x, inverse), cell_index(p.y, inverse), cell_index(p.z, inverse), level);
}

// Calls visit(CellKey first, uint32_t more) for the cells that a ball meets: `first` and so many after it, of the same block and row. Their
// keys follow each other.
template <typename Visit>
void visit_cell_runs(Vec3 p, float radius, Visit visit) {
  const int level = grid_level(radius);
  const float inverse = inverse_width(level);
  const Vec3 lo = p - splat(radius), hi = p + splat(radius);
  const int64_t x0 = cell_index(lo.x, inverse), x1 = cell_index(hi.x, inverse);
  const int64_t y1 = cell_index(hi.y, inverse), z1 = cell_index(hi.z, inverse);
  for (int64_t z = cell_index(lo.z, inverse); z <= z1; ++z)
    for (int64_t y = cell_index(lo.y, inverse); y <= y1; ++y)
      for (int64_t x = x0; x <= x1;) {
        const int64_t last = std::min(x1, x | 3);
        visit(cell_key(x, y, z, level), static_cast<uint32_t>(last - x));
        x = last + 1;
      }
}

// Which cells queries will look at. Marking may run in parallel: the result does not depend on the order.
class Occupancy {
 public:
  // Forgets all marks; room for about `queries` balls.
  void reset(uint64_t queries);
  void mark(Vec3 p, float radius);
  // Calls visit(CellKey) for every marked cell around p, at most one a level. Aliases may add some that nobody needs.
  template <typename Visit>
  void visit_marked(Vec3 p, Visit visit) const {
    for (int word = 0; word < 2; ++word)
      for (uint64_t levels = levels_[word].load(std::memory_order_relaxed); levels != 0; levels &= levels - 1) {
        const CellKey key = cell_key_at(p, word * 64 + __builtin_ctzll(levels));
        if (bits_[key >> shift_].load(std::memory_order_relaxed) >> (key & 63) & 1) visit(key);
      }
  }
  uint64_t memory() const { return words_ * 8; }

 private:
  std::unique_ptr<std::atomic<uint64_t>[]> bits_;
  uint64_t words_ = 0;
  int shift_ = 63;
  std::atomic<uint64_t> levels_[2] = {};
};

// Sorts keys into slots, stably, so that what shares a cell is contiguous and in its first order.
class Grid {
 public:
  // Returns the sorted order: its position i holds element order[i] of `keys`.
  std::unique_ptr<uint32_t[]> build(std::span<const CellKey> keys, const Threads& threads);

  // Range of the sorted order that holds a run of cells, and perhaps others: compare tags.
  std::pair<uint32_t, uint32_t> range(CellKey first, uint32_t more) const {
    const size_t i = slot(first);
    return {starts_[i], starts_[i + more + 1]};
  }
  bool empty() const { return starts_.empty() || starts_.back() == 0; }
  uint64_t memory() const { return starts_.capacity() * 4; }

 private:
  size_t slot(CellKey key) const { return (key >> shift_ & ~(kCellsInBlock - 1)) | (key & (kCellsInBlock - 1)); }

  LargeVector<uint32_t> starts_;
  int shift_ = 63;
};

// The same for the cells of a block.
inline uint32_t cell_tag(CellKey key) { return static_cast<uint32_t>(key / kCellsInBlock); }

}  // namespace sppm
