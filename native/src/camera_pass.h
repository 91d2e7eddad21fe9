// Follows one camera path per pixel: direct light on the way, and a visible point where it waits for photons.
#pragma once

#include <atomic>
#include <cstdint>
#include <vector>

#include "parallel.h"
#include "scene.h"
#include "visible_point.h"

namespace sppm {

struct PathSettings {
  uint64_t seed = 0;
  uint32_t max_depth = 24;
  float filter_reach = 1.5f;  // of the window to either side, pixels
  bool box_filter = false;
  bool transparent_film = false;
};

inline constexpr uint64_t kTileSize = 16;

// The camera samples of one iteration, kept from pass to pass so that memory is not asked for again.
struct CameraSamples {
  std::vector<CameraSample> pixels;     // of the region, row by row from the bottom
  std::vector<std::vector<Lobe>> lobes; // per tile: what visible points that are not Lambert refer to

  uint64_t memory() const;
};

struct RayCounts {
  uint64_t camera = 0, shadow = 0, photon = 0, dropped = 0;
  RayCounts& operator+=(const RayCounts& o) {
    camera += o.camera, shadow += o.shadow, photon += o.photon, dropped += o.dropped;
    return *this;
  }
};

// Index of the tile that pixel (x, y) of a region of this width belongs to.
inline uint64_t tile_of(uint64_t x, uint64_t y, uint64_t width) {
  return y / kTileSize * ((width + kTileSize - 1) / kTileSize) + x / kTileSize;
}

// Fills `samples` for one iteration; false if `cancel` turned true on the way.
bool run_camera_pass(const Scene& scene, const PathSettings& settings, uint64_t iteration, const Threads& threads,
                     const std::atomic<bool>& cancel, CameraSamples& samples, RayCounts& counts);

}  // namespace sppm
