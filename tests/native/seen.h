// Visible points as camera paths find them.
#pragma once

#include "pixel_spread.h"
#include "sampling.h"

namespace sppm {

inline constexpr float kFootprint = 0.01f;

inline CameraSample seen(Vec3 p, Vec3 normal = {0, 0, 1}, Vec3 wo = {0, 0, 1}) {
  CameraSample sample;
  VisiblePoint& vp = sample.point;
  vp.p = p;
  vp.ng = vp.ns = pack_direction(normal);
  vp.wo = pack_direction(normalize(wo));
  vp.weight = splat(1);
  return sample;
}

inline TangentAxes axes_of(const CameraSample& sample) { return {sample.point, kFootprint}; }

inline void add(PixelSpread& spread, const CameraSample& sample) { spread.add(sample, axes_of(sample)); }

// A pixel that saw points of z = 0 around `middle`, uniform in a rectangle of these sides.
inline PixelSpread rectangle(Vec3 middle, float x, float y, Vec3 wo, int points = 3000) {
  PixelSpread spread;
  for (int i = 0; i < points; ++i) {
    const Sample4 u = Sampler(7, static_cast<uint64_t>(i)).next();
    add(spread, seen(middle + Vec3{(u[0] - 0.5f) * x, (u[1] - 0.5f) * y, 0}, {0, 0, 1}, wo));
  }
  return spread;
}

}  // namespace sppm
