// Images in memory, and the EXR files that passes are written to.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "sppm/sppm.h"
#include "vecmath.h"

namespace sppm {

struct Rgba {
  Vec3 color;
  float alpha = 1;
};

// RGBA texels, bottom row first, stored as given. An sRGB image is filtered as encoded and then decoded, as Cycles does it.
class Image {
 public:
  explicit Image(const SppmImageDesc& desc);  // throws Error on sizes of 0 or missing pixels

  int64_t width() const { return width_; }
  int64_t height() const { return height_; }
  Rgba texel(int64_t x, int64_t y) const { return decode(stored(x, y)); }  // inside the image, linear
  // The image at (u, v) in units of its size.
  Rgba sample(Vec2 uv, SppmInterpolation interpolation, SppmExtension extension) const;
  uint64_t memory() const { return floats_.size() * 4 + bytes_.size(); }

 private:
  Rgba stored(int64_t x, int64_t y) const;
  Rgba decode(const Rgba& encoded) const;

  int64_t width_, height_;
  bool srgb_;
  std::vector<float> floats_;
  std::vector<uint8_t> bytes_;
};

struct ExrChannel {
  std::string name;
  const float* first;  // of the bottom row's left pixel
  uint64_t stride;     // floats from pixel to pixel
};

// Writes float channels with ZIP compression; `rows` come bottom-up and are flipped to EXR's top-down. Throws Error(SPPM_IO_ERROR).
void write_exr(const std::string& path, int64_t width, int64_t height, const std::vector<ExrChannel>& channels,
               const std::vector<std::pair<std::string, std::string>>& metadata);

}  // namespace sppm
