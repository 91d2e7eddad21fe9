// Traces photons from the lights and keeps those that a visible point could use.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <span>
#include <vector>

#include "camera_pass.h"
#include "photon.h"
#include "photon_map.h"

namespace sppm {

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
