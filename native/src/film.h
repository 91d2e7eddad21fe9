// Sums over iterations, pixel by pixel, and the passes that they give.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "camera_pass.h"
#include "photon_pass.h"
#include "progressive.h"
#include "sppm/sppm.h"

namespace sppm {

struct Pixel {
  std::array<ProgressiveEstimate, kPhotonKinds> photons;
  double direct[3] = {0, 0, 0};
  double alpha = 0;
};

class Film {
 public:
  Film(uint64_t pixels, uint64_t passes);

  // Gives a pixel that has its first visible point its first radius, [16.2.4]: `initial_radius`, or by the pixel's footprint if 0.
  void start_radii(const Camera& camera, const CameraSamples& samples, double initial_radius, const Threads& threads);
  // Tells the maps where they will be asked.
  void announce(const CameraSamples& samples, PhotonMaps& maps, const Threads& threads) const;

  // What each pixel's visible point found in one iteration. Apart from the sums, so that a cancelled iteration leaves them alone.
  struct Found {
    std::array<Vec3, kPhotonKinds> phi;
    std::array<uint32_t, kPhotonKinds> count{};
  };
  // Returns how many contributions were left out because they were not finite.
  uint64_t gather(const CameraSamples& samples, const PhotonMaps& maps, uint64_t width, const Threads& threads,
                  std::vector<Found>& found) const;
  // Ends an iteration.
  void update(const CameraSamples& samples, const std::vector<Found>& found, double gamma, const Threads& threads);

  static uint32_t channels(SppmPass pass);
  // `iterations` done with `emitted` photon paths in all; `out` has pixels * channels floats.
  void read(SppmPass pass, uint64_t iterations, uint64_t emitted, float* out) const;
  const Pixel& pixel(uint64_t i) const { return pixels_[i]; }
  uint64_t memory() const;

 private:
  std::vector<Pixel> pixels_;
  std::vector<float> depth_;         // of the first iteration
  std::vector<Vec3> normal_sum_;
  uint64_t updates_ = 0;
};

}  // namespace sppm
