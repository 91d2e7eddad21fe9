// What pixels know of the surfaces that they see.
#include <algorithm>
#include <cmath>
#include <vector>

#include "film.h"

namespace sppm {
namespace {

constexpr uint64_t kGrain = 1024;
constexpr uint64_t kCreaseWindow = 4;  // pixels within which creases are looked for: a little more than the first radius

}  // namespace

void Film::use_spreads(CameraSamples& samples, uint64_t width, const Threads& threads) {
  const uint64_t height = pixels_.size() / width;
  std::vector<uint8_t> edges(pixels_.size());  // apart from the pixels, which their neighbours read here
  threads.for_each(height, [&](uint64_t y) {
    for (uint64_t x = 0; x < width; ++x) {
      const uint64_t i = y * width + x;
      const PixelSpread& spread = pixels_[i].spread;
      edges[i] = spread.edge;
      const VisiblePoint& vp = samples.pixels[i].point;
      if (!vp.valid() || spread.count == 0) continue;
      const TangentAxes axes(vp);
      const auto goes_on = [&](uint64_t neighbor) { return spread.reaches(pixels_[neighbor].spread, axes, pixels_[i].footprint); };
      if (!spread.has(vp, axes, pixels_[i].footprint)) continue;
      edges[i] = !((x == 0 || goes_on(i - 1)) && (x + 1 == width || goes_on(i + 1)) && (y == 0 || goes_on(i - width)) &&
                   (y + 1 == height || goes_on(i + width)));
      if (!edges[i]) samples.pixels[i].ellipse = spread.ellipse(axes);
    }
  });
  mark_edges(edges, width, threads);
  threads.for_blocks(pixels_.size(), kGrain, [&](uint64_t begin, uint64_t end) {
    for (uint64_t i = begin; i < end; ++i)
      if (samples.pixels[i].point.valid()) pixels_[i].spread.add(samples.pixels[i].point, pixels_[i].footprint);
  });
}

// Marks edges and the pixels around them: first along rows, then along columns.
void Film::mark_edges(const std::vector<uint8_t>& edges, uint64_t width, const Threads& threads) {
  const uint64_t height = pixels_.size() / width;
  std::vector<uint8_t> along_row(pixels_.size());
  const auto any = [](uint64_t at, uint64_t size, auto is_marked) {
    for (uint64_t i = at - std::min(at, kCreaseWindow); i <= std::min(at + kCreaseWindow, size - 1); ++i)
      if (is_marked(i)) return true;
    return false;
  };
  threads.for_each(height, [&](uint64_t y) {
    for (uint64_t x = 0; x < width; ++x)
      along_row[y * width + x] = any(x, width, [&](uint64_t i) { return edges[y * width + i] != 0; });
  });
  threads.for_each(height, [&](uint64_t y) {
    for (uint64_t x = 0; x < width; ++x) {
      PixelSpread& spread = pixels_[y * width + x].spread;
      spread.edge = edges[y * width + x];
      spread.near_edge = any(y, height, [&](uint64_t i) { return along_row[i * width + x] != 0; });
    }
  });
}

// The creases within the largest disk of a pixel whose sample has a visible point.
Creases Film::creases(const CameraSamples& samples, uint64_t x, uint64_t y, uint64_t width) const {
  const auto w = static_cast<int64_t>(width), h = static_cast<int64_t>(pixels_.size()) / w;
  const auto own_x = static_cast<int64_t>(x), own_y = static_cast<int64_t>(y);
  const size_t own = y * width + x;
  const TangentAxes axes(samples.pixels[own].point);
  Creases found;
  if (!pixels_[own].spread.has(samples.pixels[own].point, axes, pixels_[own].footprint)) return found;
  constexpr auto kReach = static_cast<int64_t>(kCreaseWindow);
  const auto visit = [&](auto use) {
    for (int64_t j = std::max<int64_t>(own_y - kReach, 0); j <= std::min(own_y + kReach, h - 1); ++j)
      for (int64_t i = std::max<int64_t>(own_x - kReach, 0); i <= std::min(own_x + kReach, w - 1); ++i)
        if (pixels_[static_cast<size_t>(j * w + i)].spread.count > 0) use(static_cast<size_t>(j * w + i), i - own_x, j - own_y);
  };
  const PixelSpread& spread = pixels_[own].spread;
  const float footprint = pixels_[own].footprint;
  visit([&](size_t i, int64_t dx, int64_t dy) {
    const PixelSpread& other = pixels_[i].spread;
    const VisiblePoint& vp = samples.pixels[i].point;
    if (other.normal == spread.normal || !vp.valid()) return;
    const TangentAxes other_axes(vp);
    if (!other.has(vp, other_axes, pixels_[i].footprint)) return;
    found.add(spread, axes, other, other_axes, footprint, std::hypot(static_cast<float>(dx), static_cast<float>(dy)));
  });
  if (found.any()) visit([&](size_t i, int64_t, int64_t) { found.check(spread, axes, pixels_[i].spread, footprint); });
  return found;
}

}  // namespace sppm
