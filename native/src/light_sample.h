// What a light gives a point that it shines on: by a sample of the light, or along a ray that happens to meet it.
#pragma once

#include <optional>

#include "vecmath.h"

namespace sppm {

// Light toward a point. estimate = f |cos| radiance / pdf; for a lamp without size radiance stands for intensity / distance^2.
struct DirectSample {
  Vec3 wi;             // unit, from the point to the light
  float distance = 0;  // infinite for sun and environment
  Vec3 radiance;
  float pdf = 0;       // solid angle, choice of the light included; for lamps without size only the choice
  bool delta = false;  // cannot be met by chance
  bool casts_shadow = true;
  // Where the light is itself a surface that a shadow ray would meet, the ray must end here, just short of it.
  std::optional<Vec3> end;
};

// Radiance along a ray that could as well have been found by DirectSample with `pdf_solid_angle`.
struct EmittedLight {
  Vec3 radiance;
  float pdf_solid_angle = 0;
  float distance = kInfinity;  // of a lamp [m]
};

}  // namespace sppm
