// Traces photons from the lights and keeps those that a visible point could use.
#pragma once

#include <immintrin.h>

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
      for (uint32_t i = begin; i < end; i += kLanes)
        for (uint32_t near = near_lanes(i, p, r2) & lanes_before(end - i); near != 0; near &= near - 1) {
          const uint32_t k = i + static_cast<uint32_t>(__builtin_ctz(near));
          if (tags_[k] == cell_tag(key)) visit(sorted_[k]);
        }
    });
  }
  uint64_t stored() const { return stored_; }
  uint64_t memory() const;

 private:
  static constexpr uint32_t kLanes = 8;  // positions that one AVX instruction compares
  static uint32_t lanes_before(uint32_t count) { return count < kLanes ? (1u << count) - 1 : 0xffu; }
  // Bit k tells whether position i + k is closer than the root of r2 to p; the arrays are padded for it.
  uint32_t near_lanes(uint32_t i, Vec3 p, float r2) const {
    const __m256 dx = _mm256_sub_ps(_mm256_loadu_ps(&x_[i]), _mm256_set1_ps(p.x));
    const __m256 dy = _mm256_sub_ps(_mm256_loadu_ps(&y_[i]), _mm256_set1_ps(p.y));
    const __m256 dz = _mm256_sub_ps(_mm256_loadu_ps(&z_[i]), _mm256_set1_ps(p.z));
    const __m256 d2 = _mm256_add_ps(_mm256_add_ps(_mm256_mul_ps(dx, dx), _mm256_mul_ps(dy, dy)), _mm256_mul_ps(dz, dz));
    return static_cast<uint32_t>(_mm256_movemask_ps(_mm256_cmp_ps(d2, _mm256_set1_ps(r2), _CMP_LT_OQ)));
  }

  Occupancy occupancy_;
  Grid grid_;
  std::vector<CellKey> keys_;
  std::vector<float> x_, y_, z_;  // in the grid's order, and kLanes unused ones
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
