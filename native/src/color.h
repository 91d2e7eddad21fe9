// Linear RGB: luminance and the sRGB curve.
#pragma once

#include <cmath>

#include "vecmath.h"

namespace sppm {

// Y of linear Rec. 709 RGB. Only used to weigh decisions, so another RGB space costs efficiency, not correctness.
constexpr float luminance(Vec3 c) { return 0.2126f * c.x + 0.7152f * c.y + 0.0722f * c.z; }

inline float srgb_to_linear(float s) { return s <= 0.04045f ? s / 12.92f : std::pow((s + 0.055f) / 1.055f, 2.4f); }

}  // namespace sppm
