// Sums over iterations, pixel by pixel, and the passes that they give.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "camera_pass.h"
#include "crease.h"
#include "photon_pass.h"
#include "pixel_spread.h"
#include "progressive.h"
#include "sppm/sppm.h"

namespace sppm {

struct Pixel {
  std::array<PhotonEstimate, kPhotonKinds> photons;  // what paths bring from other surfaces is in the sum of kIndirect
  double direct[3] = {0, 0, 0};
  PixelSpread spread;
  float alpha = 0;  // mean of the iterations
  float footprint = 0;  // of the pixel where it first saw a surface, or what `initial_radius` takes it for [m]; 0 until then
};

// How an iteration ends for each kind of photons.
using PhotonRules = std::array<RadiusRule, kPhotonKinds>;

class Film {
 public:
  Film(uint64_t pixels, const DataPasses& data);

  // Gives a pixel that has its first visible point its first radii: `initial_radius`, or by the pixel's footprint if 0.
  void start_radii(const Camera& camera, const CameraSamples& samples, double initial_radius, const Threads& threads);
  // Tells visible points what their pixels saw in earlier iterations, so that they may stand for it, and where surfaces end.
  void find_surfaces(const Camera& camera, CameraSamples& samples, const Threads& threads);
  // Adds the visible points of an iteration that is done to what their pixels saw.
  void learn_surfaces(const Camera& camera, const CameraSamples& samples, const Threads& threads);
  // Tells the maps where they will be asked.
  void announce(const CameraSamples& samples, PhotonMaps& maps, const PhotonRules& rules, const Threads& threads) const;
  // Ends an iteration: each pixel sums the photons around its visible point, alone, and its next radii are chosen. Returns how many
  // contributions were left out because they were not finite.
  uint64_t update(const Camera& camera, CameraSamples& samples, const PhotonMaps& maps, const PhotonRules& rules, const Threads& threads);
  // Forgets all iterations.
  void clear();
  // Share of the pixels with a visible point that found at least `least` photons of a kind.
  double share_with(PhotonKind kind, double least) const;

  // Of all iterations done; `out` has a float for each pixel and channel.
  void read(SppmPass pass, float* out) const;
  uint64_t memory() const;

 private:
  static constexpr uint64_t kGrain = 1024;  // pixels that a thread takes at once

  void mark_edges(const std::vector<uint8_t>& edges, uint64_t width, const Threads& threads);
  Creases creases(const Camera& camera, const CameraSamples& samples, uint64_t x, uint64_t y) const;
  std::optional<Outline> outline(const Camera& camera, const CameraSamples& samples, uint64_t x, uint64_t y, const PixelSpread& surface,
                                 const TangentAxes& axes) const;
  void choose_radii(const Camera& camera, const CameraSamples& samples, const PhotonRules& rules, const Threads& threads);
  void limit_radii(const PhotonRules& rules, uint64_t width, const Threads& threads);
  void add_data(const CameraSamples& samples, const Threads& threads);
  void read_data(SppmPass pass, float* out) const;

  LargeVector<Pixel> pixels_;
  DataPasses passes_;
  std::vector<float> data_;  // a record for each pixel: means, where it is averaged
  uint64_t iterations_ = 0;
};

}  // namespace sppm
