// What there is to know of each pass before anything is rendered.
#pragma once

#include <array>
#include <string_view>

#include "sppm/sppm.h"

namespace sppm {

enum class PassSource : uint8_t {
  kLight,    // sums that the picture is made of
  kMiddle,   // data of what lies behind the pixel's middle
  kSurfaces  // data of the surfaces that camera paths meet, averaged
};

struct PassInfo {
  const char* name;
  std::string_view channels;  // a letter each
  PassSource source;

  uint32_t channel_count() const { return static_cast<uint32_t>(channels.size()); }
};

inline constexpr std::array<PassInfo, SPPM_PASS_COUNT> kPasses{{
    {"Combined", "RGBA", PassSource::kLight},
    {"Depth", "Z", PassSource::kMiddle},
    {"Normal", "XYZ", PassSource::kSurfaces},
    {"Direct", "RGB", PassSource::kLight},
    {"Indirect", "RGB", PassSource::kLight},
    {"Caustics", "RGB", PassSource::kLight},
    {"Radius", "V", PassSource::kLight},
    {"Photons", "V", PassSource::kLight},
    {"Position", "XYZ", PassSource::kMiddle},
    {"UV", "UVA", PassSource::kSurfaces},
    {"Object Index", "V", PassSource::kMiddle},
    {"Material Index", "V", PassSource::kMiddle},
    {"Mist", "Z", PassSource::kSurfaces},
    {"Emission", "RGB", PassSource::kSurfaces},
    {"Environment", "RGB", PassSource::kSurfaces},
    {"Diffuse Color", "RGB", PassSource::kSurfaces},
    {"Denoising Albedo", "RGB", PassSource::kSurfaces},
    {"Denoising Normal", "XYZ", PassSource::kSurfaces},
}};

}  // namespace sppm
