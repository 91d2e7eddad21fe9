// The progressive estimate of one pixel for one kind of photons: [16.13], [16.14] and the radiance that follows.
#pragma once

#include <cmath>
#include <cstdint>

#include "vecmath.h"

namespace sppm {

// All double: a million iterations add terms a million times smaller than the sum, and shrink the radius by less than a float can tell.
struct ProgressiveEstimate {
  double radius = 0;  // [m]; 0 until the pixel has seen a surface
  double count = 0;   // N, photons accepted so far, reduced with the radius
  double flux[3] = {0, 0, 0};  // tau [W sr^-1], reduced with the radius

  // Adds an iteration that found `found` photons with the sum `phi` of beta_camera f beta inside the radius. `gamma` is the share of
  // them to keep; the radius does not go below `smallest_radius`, where positions have no more digits.
  void update(uint64_t found, Vec3 phi, double gamma, float smallest_radius) {
    double shrink = 1;  // r'^2 / r^2
    if (found > 0) {
      const double m = static_cast<double>(found);
      if (radius > static_cast<double>(smallest_radius)) {
        shrink = (count + gamma * m) / (count + m);  // [16.13]
        count += gamma * m;
      } else {
        count += m;
      }
    }
    flux[0] = (flux[0] + static_cast<double>(phi.x)) * shrink;  // [16.14]
    flux[1] = (flux[1] + static_cast<double>(phi.y)) * shrink;
    flux[2] = (flux[2] + static_cast<double>(phi.z)) * shrink;
    radius *= std::sqrt(shrink);
  }

  // Radiance toward the camera after `emitted` photon paths [W m^-2 sr^-1].
  Vec3 radiance(uint64_t emitted) const {
    const double area = M_PI * radius * radius * static_cast<double>(emitted);
    if (!(area > 0)) return {};
    return {static_cast<float>(flux[0] / area), static_cast<float>(flux[1] / area), static_cast<float>(flux[2] / area)};
  }
};

}  // namespace sppm
