// A lamp: a point or a sphere with or without a spot's cone, a sun, a rectangle or an ellipse.
//
// The samples of one light carry no choice of it: where `choice` is asked for, it is the probability of this light among all.
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>

#include "light_sample.h"
#include "light_tree.h"
#include "sppm/sppm.h"
#include "vecmath.h"

namespace sppm {

struct Lamp {
  explicit Lamp(const SppmLightDesc& desc);  // throws Error

  SppmLightType type;
  uint32_t flags;
  Vec3 position, axis, x, y;  // axis: where light goes; x, y: half extents of an area lamp
  Vec3 emission;
  float radius = 0, cos_half = -1, blend = 0, one_minus_cos = 0;
  double area = 0;

  bool sun() const { return type == SPPM_LIGHT_SUN; }
  // True if it has a size, so that a ray could meet it.
  bool sized() const { return sun() ? one_minus_cos > 0 : radius > 0 || area > 0; }
  // True if it is so small beside a scene of this radius, or a sun so narrow, that a scattered ray hardly ever meets it by way of glass.
  bool small_in(float scene_radius) const {
    constexpr float kSunCap = 0.004f, kShare = 0.03f;  // 1 - cos of 5 degrees; half the lamp's size over that of the scene
    return sun() ? one_minus_cos < kSunCap : std::max(radius, 0.5f * static_cast<float>(std::sqrt(area))) < kShare * scene_radius;
  }
  // True for lamps whose light on rough surfaces is direct light's alone: a scattered ray would not meet them, or be shadowed.
  bool direct_only() const { return flags & (SPPM_LIGHT_HIDDEN_FROM_SPECULAR | SPPM_LIGHT_NO_SHADOW); }

  double power(float scene_radius) const;  // luminance [W]; of a sun, what reaches the scene's bounding sphere
  LightBounds bounds() const;              // of no intensity for a sun
  Bounds box() const;                      // of a sized lamp that is no sun
  Vec3 spot_factor(float cos_theta) const;

  // Light toward p.
  std::optional<DirectSample> sample_direct(Vec3 p, Vec2 u) const;
  // Where a ray meets a sized lamp from its front, at a distance in (near, far]; infinite for a sun.
  std::optional<float> distance_along(Vec3 origin, Vec3 direction, float near, float far) const;
  // What a ray that meets it at that distance finds.
  EmittedLight emitted(Vec3 origin, Vec3 direction, float distance, float choice) const;
};

}  // namespace sppm
