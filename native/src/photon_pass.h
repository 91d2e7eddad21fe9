// Traces photons from the lights and keeps those that a visible point could use.
#pragma once

#include <array>
#include <atomic>
#include <span>
#include <vector>

#include "camera_pass.h"
#include "grid.h"
#include "photon.h"

namespace sppm {

// The photons of one kind and one iteration, sorted into cells.
class PhotonMap {
 public:
  // Announces a query. Parallel calls are fine; all come before `build`.
  void reset(uint64_t queries) { occupancy_.reset(queries); }
  void announce(Vec3 p, float radius) { occupancy_.mark(p, radius); }
  const Occupancy& occupancy() const { return occupancy_; }

  // Takes photons with the cells they were stored for, in path order.
  struct Block {
    std::vector<Photon> photons;
    std::vector<CellKey> keys;
    std::vector<uint32_t> owners;  // photon of each key
  };
  void build(std::vector<Block>& blocks, const Threads& threads);

  // Calls visit(Photon) for each photon closer than radius to p, in an order that depends on the photons alone.
  template <typename Visit>
  void visit_within(Vec3 p, float radius, Visit visit) const {
    if (grid_.empty()) return;
    const float r2 = radius * radius;
    visit_cells(p, radius, [&](CellKey key) {
      const auto [begin, end] = grid_.range(key);
      for (uint32_t i = begin; i < end; ++i) {
        const float dx = x_[i] - p.x, dy = y_[i] - p.y, dz = z_[i] - p.z;
        if (dx * dx + dy * dy + dz * dz < r2 && tags_[i] == cell_tag(key)) visit(sorted_[i]);
      }
    });
  }
  uint64_t stored() const { return stored_; }
  uint64_t memory() const;

 private:
  Occupancy occupancy_;
  Grid grid_;
  std::vector<CellKey> keys_;
  std::vector<float> x_, y_, z_;  // in the grid's order
  std::vector<uint32_t> tags_;
  std::vector<Photon> sorted_;
  uint64_t stored_ = 0;  // photons; those kept at several levels count once
};

// Which paths photons stand for, told by the lobe that scatters them first.
enum class Emission {
  kAll,       // from the lights to anywhere
  kSpecular,  // the share that photons carry in any case (Lobe::photon_share), aimed at what throws it
  kRest       // what that leaves
};

struct PhotonBatch {
  Emission emission = Emission::kAll;
  bool aimed = false;  // at the scene's targets; for kSpecular
  uint64_t first = 0, count = 0;  // of the sequence
};

using PhotonMaps = std::array<PhotonMap, kPhotonKinds>;

using PhotonBlocks = std::array<std::vector<PhotonMap::Block>, kPhotonKinds>;

// Traces the batches into `blocks`, and counts rays into `counts`, one a batch; false if cancelled. A photon's power is that per path of
// its batch, so batches add up.
bool run_photon_pass(const Scene& scene, const PathSettings& settings, std::span<const PhotonBatch> batches, const Threads& threads,
                     const std::atomic<bool>& cancel, const PhotonMaps& maps, PhotonBlocks& blocks, std::span<RayCounts> counts);

}  // namespace sppm
