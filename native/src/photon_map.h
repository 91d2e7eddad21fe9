// The photons of one kind and one iteration, sorted into cells.
#pragma once

#include <immintrin.h>

#include <cstdint>
#include <vector>

#include "ellipsoid.h"
#include "grid.h"
#include "large_vector.h"
#include "parallel.h"
#include "photon.h"

namespace sppm {

// Photons side by side, as many as one AVX instruction compares. A set of them is a number with a bit for each lane.
struct alignas(32) PhotonGroup {
  static constexpr uint32_t kLanes = 8;

  float x[kLanes], y[kLanes], z[kLanes];
  uint32_t tag[kLanes];  // of the cell
  float red[kLanes], green[kLanes], blue[kLanes];  // power
  PackedDirection wi[kLanes], ng[kLanes];

  void set(uint32_t lane, const Photon& photon, uint32_t cell_tag) {
    x[lane] = photon.p.x, y[lane] = photon.p.y, z[lane] = photon.p.z;
    tag[lane] = cell_tag;
    red[lane] = photon.power.x, green[lane] = photon.power.y, blue[lane] = photon.power.z;
    wi[lane] = photon.wi, ng[lane] = photon.ng;
  }
  Vec3 position(uint32_t lane) const { return {x[lane], y[lane], z[lane]}; }
  Vec3 power(uint32_t lane) const { return {red[lane], green[lane], blue[lane]}; }

  uint32_t inside(const Ellipsoid& e) const {
    const __m256 dx = _mm256_sub_ps(_mm256_load_ps(x), _mm256_set1_ps(e.center.x));
    const __m256 dy = _mm256_sub_ps(_mm256_load_ps(y), _mm256_set1_ps(e.center.y));
    const __m256 dz = _mm256_sub_ps(_mm256_load_ps(z), _mm256_set1_ps(e.center.z));
    const __m256 d2 = _mm256_add_ps(_mm256_add_ps(_mm256_mul_ps(dx, dx), _mm256_mul_ps(dy, dy)), _mm256_mul_ps(dz, dz));
    const __m256 axis_x = _mm256_set1_ps(e.axis.x), axis_y = _mm256_set1_ps(e.axis.y), axis_z = _mm256_set1_ps(e.axis.z);
    const __m256 da = _mm256_add_ps(_mm256_add_ps(_mm256_mul_ps(dx, axis_x), _mm256_mul_ps(dy, axis_y)), _mm256_mul_ps(dz, axis_z));
    const __m256 stretched = _mm256_mul_ps(_mm256_mul_ps(da, da), _mm256_set1_ps(e.stretch));
    return lanes(_mm256_cmp_ps(_mm256_add_ps(d2, stretched), _mm256_set1_ps(square(e.across)), _CMP_LT_OQ));
  }
  static uint32_t lanes(__m256 mask) { return static_cast<uint32_t>(_mm256_movemask_ps(mask)); }
  static uint32_t equal(const uint32_t* values, uint32_t to) {
    const __m256i v = _mm256_load_si256(reinterpret_cast<const __m256i*>(values));
    return lanes(_mm256_castsi256_ps(_mm256_cmpeq_epi32(v, _mm256_set1_epi32(static_cast<int>(to)))));
  }
};

class PhotonMap {
 public:
  // Announces a query. Parallel calls are fine; all come before `build`.
  void reset(uint64_t queries) { occupancy_.reset(queries); }
  void announce(const Ellipsoid& region) { occupancy_.mark(region.center, region.along); }
  const Occupancy& occupancy() const { return occupancy_; }

  // Takes photons with the cells they were stored for, in path order.
  struct Block {
    std::vector<Photon> photons;
    std::vector<CellKey> keys;
    std::vector<uint32_t> owners;  // photon of each key
  };
  void build(std::vector<Block>& blocks, const Threads& threads);

  // Calls visit(const PhotonGroup&, lanes) so that each photon in the ellipsoid is in one call's lanes, in an order that depends on the
  // photons alone.
  template <typename Visit>
  void visit_within(const Ellipsoid& region, Visit visit) const {
    if (grid_.empty()) return;
    visit_cell_runs(region.center, region.along, [&](CellKey first, uint32_t more) {
      const auto [begin, end] = grid_.range(first, more);
      const uint32_t tag = cell_tag(first);
      for (uint32_t i = begin & ~(PhotonGroup::kLanes - 1); i < end; i += PhotonGroup::kLanes) {
        const PhotonGroup& group = groups_[i / PhotonGroup::kLanes];
        const uint32_t inside = lanes_before(end - i) & ~lanes_before(begin > i ? begin - i : 0);
        const uint32_t lanes = group.inside(region) & inside & PhotonGroup::equal(group.tag, tag);
        if (lanes != 0) visit(group, lanes);
      }
    });
  }
  uint64_t stored() const { return stored_; }
  uint64_t memory() const;

 private:
  static uint32_t lanes_before(uint32_t count) { return count < PhotonGroup::kLanes ? (1u << count) - 1 : 0xffu; }

  Occupancy occupancy_;
  Grid grid_;
  LargeVector<PhotonGroup> groups_;  // in the grid's order
  uint64_t stored_ = 0;  // photons; those kept at several levels count once
};

}  // namespace sppm
