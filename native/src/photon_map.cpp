#include "photon_map.h"

namespace sppm {

void PhotonMap::build(std::vector<Block>& blocks, const Threads& threads) {
  std::vector<uint64_t> key_start(blocks.size() + 1, 0), photon_start(blocks.size() + 1, 0);
  for (size_t b = 0; b < blocks.size(); ++b) {
    key_start[b + 1] = key_start[b] + blocks[b].keys.size();
    photon_start[b + 1] = photon_start[b] + blocks[b].photons.size();
  }
  const uint64_t n = key_start.back();
  stored_ = photon_start.back();
  const auto keys = std::make_unique_for_overwrite<CellKey[]>(n);
  const auto photons = std::make_unique_for_overwrite<const Photon*[]>(n);
  threads.for_each(blocks.size(), [&](uint64_t b) {
    for (size_t i = 0; i < blocks[b].keys.size(); ++i) {
      keys[key_start[b] + i] = blocks[b].keys[i];
      photons[key_start[b] + i] = &blocks[b].photons[blocks[b].owners[i]];
    }
  });
  const auto order = grid_.build({keys.get(), n}, threads);
  groups_.resize((n + PhotonGroup::kLanes - 1) / PhotonGroup::kLanes);
  threads.for_blocks(n, 1 << 14, [&](uint64_t begin, uint64_t end) {
    for (uint64_t i = begin; i < end; ++i) {
      const uint32_t from = order[i];
      groups_[i / PhotonGroup::kLanes].set(i % PhotonGroup::kLanes, *photons[from], cell_tag(keys[from]));
    }
  });
}

uint64_t PhotonMap::memory() const {
  return occupancy_.memory() + grid_.memory() + groups_.capacity() * sizeof(PhotonGroup);
}

}  // namespace sppm
