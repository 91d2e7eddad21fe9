// How wide the disks of the next iteration are, by what the film has found so far.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "film.h"

namespace sppm {
namespace {

// Photons of Sobol points scatter less than independent ones.
constexpr double kScatter = 0.5;

// What makes radii of a kind of photons.
struct RadiusChoice {
  int64_t nearest, farthest;  // pixels at whose distances the curvature of light is measured
  double noise;               // how often the variance of what is measured is taken off
  bool careful;               // where surfaces may end, no more than a number of photons wide
};

// Caustics have lines that are missed from two pixels away. Noise would pass for curvature there; from three pixels away it limits
// radii to about as much.
constexpr std::array<RadiusChoice, kPhotonKinds> kChoice{{{1, 2, 2, true}, {3, 3, 0, false}}};

// How much wider than its neighbour's a pixel's disk may be, in footprints a pixel.
constexpr std::array<float, kPhotonKinds> kWidening{0.125f, 0.25f};

// Lowers a row to the least of its neighbouring row's values plus their distance.
void lower_by_row(float* row, const float* neighbor, uint64_t width, float slope) {
  const float diagonal = slope * std::numbers::sqrt2_v<float>;
  for (uint64_t x = 0; x < width; ++x) row[x] = std::min(row[x], neighbor[x] + slope);
  for (uint64_t x = 1; x < width; ++x) row[x] = std::min(row[x], neighbor[x - 1] + diagonal);
  for (uint64_t x = 1; x < width; ++x) row[x - 1] = std::min(row[x - 1], neighbor[x] + diagonal);
}

// Lowers values to the least of all others plus `slope` a pixel of distance: two sweeps of the chamfer distance transform.
void spread_least(std::vector<float>& values, uint64_t width, uint64_t height, float slope) {
  for (uint64_t y = 0; y < height; ++y) {
    float* row = values.data() + y * width;
    if (y > 0) lower_by_row(row, row - width, width, slope);
    for (uint64_t x = 1; x < width; ++x) row[x] = std::min(row[x], row[x - 1] + slope);
  }
  for (uint64_t y = height; y-- > 0;) {
    float* row = values.data() + y * width;
    if (y + 1 < height) lower_by_row(row, row + width, width, slope);
    for (uint64_t x = width - 1; x > 0; --x) row[x - 1] = std::min(row[x - 1], row[x] + slope);
  }
}

}  // namespace

// A disk of radius r finds r^2/8 of the light's Laplacian too much, and the mean of four pixels at the distance d tells d^2/4 of it: the
// relative bias is r^2/(2 d^2) times their relative difference g. Of n photons a unit of area the relative variance is 1/(pi r^2 n).
// Squared bias and variance together are least at r^6 = 2 d^4 / (pi n g^2). The density of photons stands for the light: it knows
// nothing of textures.
void Film::choose_radii(const Camera& camera, const CameraSamples& samples, const PhotonRules& rules, const Threads& threads) {
  const uint64_t width = camera.region_width, height = camera.region_height;
  std::vector<float> densities(pixels_.size());  // photons a path and area [m^-2], negative where no surface was seen
  for (size_t kind = 0; kind < kPhotonKinds; ++kind) {
    if (rules[kind].paths == 0) continue;
    threads.for_blocks(pixels_.size(), kGrain, [&](uint64_t begin, uint64_t end) {
      for (uint64_t i = begin; i < end; ++i) {
        const PhotonEstimate& e = pixels_[i].photons[kind];
        densities[i] = e.searched > 0 ? static_cast<float>(e.count / e.searched) : -1;
      }
    });
    const RadiusChoice& choice = kChoice[kind];
    const RadiusRule& rule = rules[kind];
    const auto variance = [&](size_t i) {
      return square(static_cast<double>(densities[i])) / std::max(1.0, pixels_[i].photons[kind].count);
    };
    // Square of the largest curvature at pixel i, in densities a squared pixel.
    const auto curvature2 = [&](int64_t x, int64_t y, size_t own) {
      double most = 0;
      for (int64_t d = choice.nearest; d <= choice.farthest; ++d) {
        double difference = 0, noise = variance(own);
        for (const auto& [dx, dy] : {std::array{-d, int64_t{0}}, {d, int64_t{0}}, {int64_t{0}, -d}, {int64_t{0}, d}}) {
          const int64_t i = x + dx, j = y + dy;
          if (i < 0 || j < 0 || i >= static_cast<int64_t>(width) || j >= static_cast<int64_t>(height)) continue;
          const auto at = static_cast<size_t>(j) * width + static_cast<size_t>(i);
          if (densities[at] < 0) continue;
          difference += 0.25 * static_cast<double>(densities[at] - densities[own]);
          noise += variance(at) / 16;
        }
        most = std::max(most, (square(difference) - choice.noise * noise) / square(square(static_cast<double>(d))));
      }
      return most;
    };
    threads.for_each(height, [&](uint64_t y) {
      for (uint64_t x = 0; x < width; ++x) {
        const size_t i = y * width + x;
        Pixel& pixel = pixels_[i];
        const VisiblePoint& vp = samples.pixels[i].point;
        if (!(densities[i] > 0) || !vp.valid()) continue;
        const auto density = static_cast<double>(densities[i]), footprint = static_cast<double>(pixel.footprint);
        const double n = density * static_cast<double>(rule.paths + rule.paths_before) * square(footprint) / kScatter;
        const double g2 = curvature2(static_cast<int64_t>(x), static_cast<int64_t>(y), i) / square(density);
        const double size = static_cast<double>(camera.footprint(vp.path_length)) / footprint;  // of a pixel
        const double best = std::cbrt(square(size) * std::sqrt(2 / (M_PI * n * g2)));  // infinite where no curvature was found
        const double radius = std::max(std::clamp(best, rule.narrowest, kFirstRadius) * footprint,
                                       static_cast<double>(smallest_radius(vp.p)));
        double& next = pixel.photons[kind].radius;
        const bool known = pixel.spread.count > 0 && !pixel.spread.near_edge;
        next = known || !choice.careful ? radius : std::min(next, radius);
      }
    });
  }
}

// A pixel's disk that reaches a bright spot from beside it adds light that the spot's own small disks do not lack. So no disk may be so
// much wider than one near by that it reaches that one's.
void Film::limit_radii(const PhotonRules& rules, uint64_t width, const Threads& threads) {
  const uint64_t height = pixels_.size() / width;
  threads.for_each(kPhotonKinds, [&](uint64_t kind) {
    if (rules[kind].paths == 0) return;
    std::vector<float> radii(pixels_.size());  // in footprints
    for (size_t i = 0; i < radii.size(); ++i) {
      const Pixel& p = pixels_[i];
      radii[i] = p.footprint > 0 ? static_cast<float>(p.photons[kind].radius) / p.footprint : kInfinity;
    }
    spread_least(radii, width, height, kWidening[kind]);
    for (size_t i = 0; i < radii.size(); ++i) {
      double& radius = pixels_[i].photons[kind].radius;
      if (radii[i] < kInfinity) radius = std::min(radius, static_cast<double>(radii[i] * pixels_[i].footprint));
    }
  });
}

}  // namespace sppm
