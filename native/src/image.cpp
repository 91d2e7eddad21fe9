#include "image.h"

#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfOutputFile.h>
#include <ImfStringAttribute.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <exception>

#include "color.h"
#include "status.h"

namespace sppm {
namespace {

// The texel that index i stands for under the extension rule, or -1 where there is none.
int64_t extend(int64_t i, int64_t size, SppmExtension extension) {
  if (i >= 0 && i < size) return i;
  switch (extension) {
    case SPPM_EXTEND: return std::clamp<int64_t>(i, 0, size - 1);
    case SPPM_CLIP: return -1;
    case SPPM_MIRROR: {
      const int64_t k = ((i % (2 * size)) + 2 * size) % (2 * size);
      return k < size ? k : 2 * size - 1 - k;
    }
    default: return ((i % size) + size) % size;
  }
}

// The sRGB curve by a table with linear steps. With std::pow a render whose walls are all textured took 4 % longer.
class SrgbTable {
 public:
  SrgbTable() {
    for (size_t i = 0; i < values_.size(); ++i) values_[i] = srgb_to_linear(static_cast<float>(i) / kSteps);
  }
  float operator()(float s) const {
    if (!(s >= 0 && s <= 1)) return srgb_to_linear(s);
    const float x = s * kSteps;
    const auto i = static_cast<size_t>(x);
    return values_[i] + (values_[i + 1] - values_[i]) * (x - static_cast<float>(i));
  }

 private:
  static constexpr int kSteps = 2048;
  std::array<float, kSteps + 2> values_;
};
const SrgbTable kDecode;

}  // namespace

Image::Image(const SppmImageDesc& desc)
    : width_(static_cast<int64_t>(desc.width)), height_(static_cast<int64_t>(desc.height)), srgb_(desc.encoding == SPPM_SRGB) {
  const std::string name = desc.name ? desc.name : "";
  require(desc.width > 0 && desc.height > 0 && desc.width <= 1u << 16 && desc.height <= 1u << 16,
          "image '" + name + "': width and height must be 1 to 65536");
  require((desc.pixels != nullptr) != (desc.pixels_u8 != nullptr), "image '" + name + "': give either pixels or pixels_u8");
  require(desc.encoding <= SPPM_SRGB, "image '" + name + "': encoding must be an SppmColorEncoding");
  const size_t count = static_cast<size_t>(width_ * height_ * 4);
  if (desc.pixels_u8) {
    bytes_.assign(desc.pixels_u8, desc.pixels_u8 + count);
    return;
  }
  floats_.assign(desc.pixels, desc.pixels + count);
  for (const float value : floats_) require(std::isfinite(value), [&] { return "image '" + name + "': a pixel is not finite"; });
}

Rgba Image::stored(int64_t x, int64_t y) const {
  const size_t i = static_cast<size_t>((y * width_ + x) * 4);
  if (bytes_.empty()) return {{floats_[i], floats_[i + 1], floats_[i + 2]}, floats_[i + 3]};
  const auto value = [&](size_t channel) { return static_cast<float>(bytes_[i + channel]) / 255; };
  return {{value(0), value(1), value(2)}, value(3)};
}

Rgba Image::decode(const Rgba& encoded) const {
  if (!srgb_) return encoded;
  return {{kDecode(encoded.color.x), kDecode(encoded.color.y), kDecode(encoded.color.z)}, encoded.alpha};
}

Rgba Image::sample(Vec2 uv, SppmInterpolation interpolation, SppmExtension extension) const {
  // Beyond this the float has no fraction left, and the conversion to an index would overflow.
  const auto bounded = [](float a) { return std::isfinite(a) ? std::clamp(a, -1e6f, 1e6f) : 0.0f; };
  const float x = bounded(uv.x) * static_cast<float>(width_), y = bounded(uv.y) * static_cast<float>(height_);
  const auto fetch = [&](int64_t i, int64_t j) -> Rgba {
    i = extend(i, width_, extension), j = extend(j, height_, extension);
    if (i < 0 || j < 0) return {{}, 0};
    return stored(i, j);
  };
  if (interpolation == SPPM_CLOSEST) return decode(fetch(static_cast<int64_t>(std::floor(x)), static_cast<int64_t>(std::floor(y))));
  const float fx = std::floor(x - 0.5f), fy = std::floor(y - 0.5f);
  const int64_t i = static_cast<int64_t>(fx), j = static_cast<int64_t>(fy);
  const float s = x - 0.5f - fx, t = y - 0.5f - fy;
  const Rgba a = fetch(i, j), b = fetch(i + 1, j), c = fetch(i, j + 1), d = fetch(i + 1, j + 1);
  return decode({lerp(lerp(a.color, b.color, s), lerp(c.color, d.color, s), t),
                 (a.alpha * (1 - s) + b.alpha * s) * (1 - t) + (c.alpha * (1 - s) + d.alpha * s) * t});
}

void write_exr(const std::string& path, int64_t width, int64_t height, const std::vector<ExrChannel>& channels,
               const std::vector<std::pair<std::string, std::string>>& metadata) {
  // Written beside the target and renamed, so that a reader never sees half a file and a failure keeps the last good one.
  const std::string partial = path + ".part";
  try {
    Imf::Header header(static_cast<int>(width), static_cast<int>(height));
    header.compression() = Imf::ZIP_COMPRESSION;
    for (const auto& [key, value] : metadata) header.insert(key, Imf::StringAttribute(value));
    Imf::FrameBuffer frame;
    for (const ExrChannel& channel : channels) {
      header.channels().insert(channel.name, Imf::Channel(Imf::FLOAT));
      const auto pixel = static_cast<std::ptrdiff_t>(channel.stride * sizeof(float));
      const std::ptrdiff_t row = pixel * width;
      char* top = const_cast<char*>(reinterpret_cast<const char*>(channel.first)) + row * (height - 1);
      frame.insert(channel.name, Imf::Slice(Imf::FLOAT, top, static_cast<size_t>(pixel), static_cast<size_t>(-row)));
    }
    Imf::OutputFile file(partial.c_str(), header);
    file.setFrameBuffer(frame);
    file.writePixels(static_cast<int>(height));
  } catch (const std::exception& e) {
    std::remove(partial.c_str());
    throw Error(SPPM_IO_ERROR, "cannot write '" + path + "': " + e.what());
  }
  if (std::rename(partial.c_str(), path.c_str()) != 0) {
    std::remove(partial.c_str());
    throw Error(SPPM_IO_ERROR, "cannot replace '" + path + "'");
  }
}

}  // namespace sppm
