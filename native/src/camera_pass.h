// Follows one camera path per pixel: direct light on the way, a visible point where it waits for photons, and, if asked for, the
// path's further way for all light that photons leave to it.
#pragma once

#include <atomic>
#include <cstdint>
#include <vector>

#include "data_passes.h"
#include "large_vector.h"
#include "parallel.h"
#include "scene.h"
#include "visible_point.h"

namespace sppm {

struct PathSettings {
  uint64_t seed = 0;
  uint32_t max_depth = 24;
  float filter_reach = 1.5f;  // pixels: of the window to either side, or the whole width of the box
  bool box_filter = false;
  bool transparent_film = false;
  bool trace_indirect = false;  // camera paths go on behind their visible point
  bool ask_at_glossy = false;   // glossy surfaces ask for caustic photons, which carry Lobe::photon_share
  DataPasses data;
};

inline constexpr uint64_t kTileSize = 16;

// The camera samples of one iteration, kept from pass to pass so that memory is not asked for again.
struct CameraSamples {
  LargeVector<CameraSample> pixels;     // of the region, row by row from the bottom
  std::vector<TilePoints> tiles;
  std::vector<float> data;              // a record of DataPasses for each pixel

  uint64_t memory() const;
};

struct RayCounts {
  uint64_t camera = 0, shadow = 0, photon = 0, dropped = 0;
  RayCounts& operator+=(const RayCounts& o) {
    camera += o.camera, shadow += o.shadow, photon += o.photon, dropped += o.dropped;
    return *this;
  }
};

// Tiles of a region, and its pixels tile by tile: visit(x, y). Lists per tile are found by this one numbering.
inline uint64_t tile_count(uint64_t width, uint64_t height) {
  return (width + kTileSize - 1) / kTileSize * ((height + kTileSize - 1) / kTileSize);
}
template <typename Visit>
void visit_tile(uint64_t tile, uint64_t width, uint64_t height, Visit visit) {
  const uint64_t tiles_x = (width + kTileSize - 1) / kTileSize;
  const uint64_t x0 = tile % tiles_x * kTileSize, y0 = tile / tiles_x * kTileSize;
  for (uint64_t y = y0; y < std::min(y0 + kTileSize, height); ++y)
    for (uint64_t x = x0; x < std::min(x0 + kTileSize, width); ++x) visit(x, y);
}

// Fills `samples` for one iteration; false if `cancel` turned true on the way.
bool run_camera_pass(const Scene& scene, const PathSettings& settings, uint64_t iteration, const Threads& threads,
                     const std::atomic<bool>& cancel, CameraSamples& samples, RayCounts& counts);

}  // namespace sppm
