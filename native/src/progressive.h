// What one pixel has gathered of one kind of photons, and how its search radius follows.
//
// An iteration adds phi over the area of its kernel, which is pi r^2 for a disk. Under the textbook's rule [16.14] that is the same
// estimate: tau' / (pi r'^2) = (tau + phi) / (pi r^2). So the rules differ in the region only.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "sppm/sppm.h"
#include "vecmath.h"

namespace sppm {

// Positions carry about 24 bits; a search radius below a few of the last ones would select by rounding [m].
inline float smallest_radius(Vec3 p) { return std::max(32 * 0x1p-23f * max_component(abs(p)), 1e-30f); }

// First search radius in pixel footprints: about 28 photons where there is one a pixel.
inline constexpr double kFirstRadius = 3;

// What the radius of the next iteration depends on beside the pixel itself and, by DENSITY, its neighbours.
struct RadiusRule {
  SppmRadiusRule rule = SPPM_RADIUS_DENSITY;
  double gamma = 0.7;      // PROGRESSIVE: share of the new photons that is kept; the others: see `step`
  double shrink = 1;       // DENSITY and PASS_INDEXED: r^2 of this iteration over that of the first
  double wanted = 10;      // DENSITY: photons in the first iteration's disk, were there as many paths as pixels
  double narrowest = 0.35; // DENSITY: least radius of the first iteration, in footprints
  uint64_t pixels = 1;
  uint64_t paths = 0, paths_before = 0;  // of this iteration, and of all before it

  // Knaus and Zwicker 2011: r^2 of iteration i + 1 over that of iteration i, i from 1.
  static double step(uint64_t i, double gamma) { return (static_cast<double>(i) + gamma) / (static_cast<double>(i) + 1); }
};

// What an iteration found at a pixel's visible points.
struct Gathered {
  uint64_t count = 0;            // photons
  double radiance[3] = {0, 0, 0};  // [W m^-2 sr^-1]
  double searched = 0;           // sum over visible points of paths times area [m^2]

  // A visible point that found `found` of the photons of `paths` paths, with the sum `phi` of beta_camera f beta, per path.
  void add(uint64_t found, Vec3 phi, double area, uint64_t paths) {
    count += found;
    for (int c = 0; c < 3; ++c) radiance[c] += static_cast<double>(phi[c]) / area;
    searched += area * static_cast<double>(paths);
  }
};

// All double: a million iterations add terms a million times smaller than the sum, and shrink the radius by less than a float can tell.
struct PhotonEstimate {
  double radius = 0;             // [m]; 0 until the pixel has seen a surface
  double count = 0;              // N, photons accepted so far, reduced with the radius; PASS_INDEXED: all photons found
  double searched = 0;           // DENSITY: sum of paths times area searched, reduced as the count [m^2]
  double radiance_sum[3] = {0, 0, 0};  // of all iterations [W m^-2 sr^-1]

  void add(Vec3 radiance) {
    radiance_sum[0] += static_cast<double>(radiance.x);
    radiance_sum[1] += static_cast<double>(radiance.y);
    radiance_sum[2] += static_cast<double>(radiance.z);
  }

  // Adds what an iteration found, and chooses the next radius. `footprint` [m] is a pixel's size there; below `smallest_radius` positions
  // have no digits.
  void update(const Gathered& gathered, const RadiusRule& rule, double footprint, float smallest_radius) {
    for (int c = 0; c < 3; ++c) radiance_sum[c] += gathered.radiance[c];
    const double m = static_cast<double>(gathered.count), smallest = static_cast<double>(smallest_radius);
    if (rule.rule == SPPM_RADIUS_PROGRESSIVE) {
      if (gathered.count == 0) return;
      if (radius <= smallest) {
        count += m;
        return;
      }
      radius *= std::sqrt((count + rule.gamma * m) / (count + m));  // [16.13]
      count += rule.gamma * m;
      radius = std::max(radius, smallest);
      return;
    }
    double next = kFirstRadius * footprint * std::sqrt(rule.shrink);
    if (rule.rule == SPPM_RADIUS_PASS_INDEXED) count += m;
    if (rule.rule == SPPM_RADIUS_DENSITY) {
      // What was found in wider disks before weighs no more a path than this.
      const double same_area = gathered.searched / static_cast<double>(rule.paths) * static_cast<double>(rule.paths_before);
      const double kept = searched > same_area ? same_area / searched : 1;
      count = count * kept + m, searched = searched * kept + gathered.searched;
      // Only photons of earlier iterations decide, so an iteration's radius does not depend on what it will find.
      const double per_area = count / searched * static_cast<double>(rule.pixels);
      const double wanted = std::sqrt(rule.wanted * rule.shrink / (M_PI * per_area));  // infinite where none was found
      const double limit = footprint * std::sqrt(rule.shrink);
      next = std::clamp(wanted, rule.narrowest * limit, kFirstRadius * limit);
    }
    radius = std::max(next, smallest);
  }

  // Radiance toward the camera after `iterations` [W m^-2 sr^-1].
  Vec3 radiance(uint64_t iterations) const {
    if (iterations == 0) return {};
    const double n = static_cast<double>(iterations);
    return {static_cast<float>(radiance_sum[0] / n), static_cast<float>(radiance_sum[1] / n), static_cast<float>(radiance_sum[2] / n)};
  }
};

}  // namespace sppm
