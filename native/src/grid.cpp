#include "grid.h"

#include <algorithm>

#include "status.h"

namespace sppm {
namespace {

int bits_for(uint64_t count, int least) {
  int bits = least;
  while (bits < 31 && (uint64_t{1} << bits) < count) ++bits;
  return bits;
}

constexpr int kBucketBits = 9, kFewestSlotBits = kBucketBits + 6;  // a bucket holds whole blocks
constexpr uint64_t kChunk = 1 << 16;

}  // namespace

void Occupancy::reset(uint64_t queries) {
  const int bits = bits_for(queries / 4, 6);  // 16 bits a query: few aliases among its up to 8 cells
  const uint64_t words = uint64_t{1} << bits;
  if (words != words_) {
    bits_ = std::make_unique<std::atomic<uint64_t>[]>(words);
    words_ = words;
    shift_ = 64 - bits;
  }
  for (uint64_t i = 0; i < words_; ++i) bits_[i].store(0, std::memory_order_relaxed);
  for (auto& l : levels_) l.store(0, std::memory_order_relaxed);
}

void Occupancy::mark(Vec3 p, float radius) {
  const int level = grid_level(radius);
  const uint64_t bit = uint64_t{1} << (level & 63);
  auto& levels = levels_[level >> 6];
  if (!(levels.load(std::memory_order_relaxed) & bit)) levels.fetch_or(bit, std::memory_order_relaxed);
  visit_cell_runs(p, radius, [&](CellKey first, uint32_t more) {
    auto& word = bits_[first >> shift_];
    const uint64_t marks = ((uint64_t{2} << more) - 1) << (first % kCellsInBlock);
    if (~word.load(std::memory_order_relaxed) & marks) word.fetch_or(marks, std::memory_order_relaxed);
  });
}

std::unique_ptr<uint32_t[]> Grid::build(std::span<const CellKey> keys, const Threads& threads) {
  const uint64_t n = keys.size();
  if (n >> 32) throw Error(SPPM_OUT_OF_MEMORY, "more than 2^32 photons to store in an iteration: lower photons_per_iteration");
  const int slot_bits = bits_for(n, kFewestSlotBits);
  shift_ = 64 - slot_bits;
  const uint64_t buckets = uint64_t{1} << kBucketBits, slots_per_bucket = uint64_t{1} << (slot_bits - kBucketBits);
  const uint64_t chunks = (n + kChunk - 1) / kChunk;
  auto order = std::make_unique_for_overwrite<uint32_t[]>(n), bucketed = std::make_unique_for_overwrite<uint32_t[]>(n);
  starts_.resize((uint64_t{1} << slot_bits) + 1);

  // Count by bucket and chunk, so that each chunk then knows where its elements go.
  std::vector<uint32_t> offsets(buckets * chunks, 0);
  threads.for_each(chunks, [&](uint64_t c) {
    for (uint64_t i = c * kChunk; i < std::min(n, (c + 1) * kChunk); ++i) ++offsets[(keys[i] >> (64 - kBucketBits)) * chunks + c];
  });
  uint32_t sum = 0;
  for (uint32_t& o : offsets) {
    const uint32_t count = o;
    o = sum;
    sum += count;
  }
  std::vector<uint32_t> bucket_start(buckets + 1, sum);
  for (uint64_t b = 0; b < buckets && chunks > 0; ++b) bucket_start[b] = offsets[b * chunks];
  threads.for_each(chunks, [&](uint64_t c) {
    for (uint64_t i = c * kChunk; i < std::min(n, (c + 1) * kChunk); ++i)
      bucketed[offsets[(keys[i] >> (64 - kBucketBits)) * chunks + c]++] = static_cast<uint32_t>(i);
  });

  // Within a bucket: a counting sort by slot.
  threads.for_each(buckets, [&](uint64_t b) {
    const uint32_t begin = bucket_start[b], end = bucket_start[b + 1];
    std::vector<uint32_t> next(slots_per_bucket + 1, 0);
    const auto local_slot = [&](uint32_t element) { return slot(keys[element]) & (slots_per_bucket - 1); };
    for (uint32_t i = begin; i < end; ++i) ++next[local_slot(bucketed[i]) + 1];
    next[0] = begin;
    for (uint64_t s = 0; s < slots_per_bucket; ++s) {
      next[s + 1] += next[s];
      starts_[b * slots_per_bucket + s] = next[s];
    }
    for (uint32_t i = begin; i < end; ++i) order[next[local_slot(bucketed[i])]++] = bucketed[i];
  });
  starts_.back() = static_cast<uint32_t>(n);
  return order;
}

}  // namespace sppm
