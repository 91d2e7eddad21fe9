// What pixels know of the surfaces that they see.
#include <algorithm>
#include <cmath>
#include <vector>

#include "film.h"

namespace sppm {
namespace {

constexpr int kReach = Outline::kReach;  // pixels within which ends are looked for: a little more than the first radius
// What lies this far behind the plane, in footprints and of the distance along it, is not the same surface, bent.
constexpr float kOffPlane = 0.25f, kOffPlaneSlope = 0.5f;
// A surface that bends goes on where it is not seen. Cosine of how far its normal may turn.
constexpr float kFlat = 0.99f;
// Cosine to the line of sight below which pixels are too long, as they lie on the surface, to tell where it ends.
constexpr float kGrazing = 0.1f;

TangentAxes axes_of(const Camera& camera, const VisiblePoint& vp) { return {vp, camera.footprint(vp.path_length)}; }

// Calls use(i, dx, dy) for each pixel i within the reach of (x, y).
template <typename Use>
void visit_around(const Camera& camera, uint64_t x, uint64_t y, Use use) {
  const auto width = static_cast<int64_t>(camera.region_width), height = static_cast<int64_t>(camera.region_height);
  for (int dy = -kReach; dy <= kReach; ++dy)
    for (int dx = -kReach; dx <= kReach; ++dx) {
      const int64_t i = static_cast<int64_t>(x) + dx, j = static_cast<int64_t>(y) + dy;
      if (i >= 0 && j >= 0 && i < width && j < height) use(static_cast<size_t>(j * width + i), dx, dy);
    }
}

}  // namespace

void Film::find_surfaces(const Camera& camera, CameraSamples& samples, const Threads& threads) {
  const uint64_t width = camera.region_width, height = camera.region_height;
  std::vector<uint8_t> edges(pixels_.size());  // apart from the pixels, which their neighbours read here
  threads.for_each(height, [&](uint64_t y) {
    for (uint64_t x = 0; x < width; ++x) {
      const uint64_t i = y * width + x;
      const PixelSpread& spread = pixels_[i].spread;
      edges[i] = spread.edge;
      CameraSample& sample = samples.pixels[i];
      if (!sample.point.valid() || spread.count == 0) continue;
      const TangentAxes axes = axes_of(camera, sample.point);
      const auto goes_on = [&](uint64_t neighbor) { return spread.reaches(pixels_[neighbor].spread, axes); };
      if (!spread.has(sample, axes)) continue;
      edges[i] = !((x == 0 || goes_on(i - 1)) && (x + 1 == width || goes_on(i + 1)) && (y == 0 || goes_on(i - width)) &&
                   (y + 1 == height || goes_on(i + width)));
      if (!edges[i]) sample.ellipse = spread.ellipse(axes);
    }
  });
  mark_edges(edges, width, threads);
}

void Film::learn_surfaces(const Camera& camera, const CameraSamples& samples, const Threads& threads) {
  threads.for_blocks(pixels_.size(), kGrain, [&](uint64_t begin, uint64_t end) {
    for (uint64_t i = begin; i < end; ++i) {
      const CameraSample& sample = samples.pixels[i];
      if (sample.point.valid()) {
        pixels_[i].spread.add(sample, axes_of(camera, sample.point));
      } else if (sample.met_nothing()) {
        pixels_[i].spread.add_miss();
      }
    }
  });
}

// Marks edges and the pixels around them: first along rows, then along columns.
void Film::mark_edges(const std::vector<uint8_t>& edges, uint64_t width, const Threads& threads) {
  const uint64_t height = pixels_.size() / width;
  std::vector<uint8_t> along_row(pixels_.size());
  const auto any = [](uint64_t at, uint64_t size, auto is_marked) {
    constexpr uint64_t kWindow = kReach;
    for (uint64_t i = at - std::min(at, kWindow); i <= std::min(at + kWindow, size - 1); ++i)
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

// Where the surface around a pixel that is seen directly ends before what lies behind it; nothing where it does not.
std::optional<Outline> Film::outline(const Camera& camera, const CameraSamples& samples, uint64_t x, uint64_t y, const PixelSpread& surface,
                                     const TangentAxes& axes) const {
  // Where the plane is seen through the middle of a pixel.
  const auto place = [&](float dx, float dy) {
    const Ray ray = camera.ray(static_cast<float>(camera.region_x + x) + 0.5f + dx, static_cast<float>(camera.region_y + y) + 0.5f + dy,
                               {0.5f, 0.5f});
    return ray.origin + ray.direction * (dot(surface.mean - ray.origin, axes.normal) / dot(ray.direction, axes.normal));
  };
  const Vec3 middle = place(0, 0);
  Outline found(middle, place(1, 0) - middle, place(0, 1) - middle, axes.normal);
  enum Seen : uint8_t { kUnknown, kSurface, kBehind };
  const auto look = [&](size_t i, Vec3 there) {
    const PixelSpread& seen = pixels_[i].spread;
    if (seen.count == 0) return samples.pixels[i].met_nothing() ? kBehind : kUnknown;
    if (seen.way != 0) return kUnknown;
    const float behind = -dot(seen.mean - surface.mean, axes.normal), near = kOffPlane * axes.footprint;
    return behind > near + kOffPlaneSlope * length(there - surface.mean) ? kBehind : std::abs(behind) <= near ? kSurface : kUnknown;
  };
  constexpr int kSide = 2 * kReach + 3;
  std::array<Seen, kSide * kSide> seen{};  // with a border that nothing is known of
  const auto at = [&](int dx, int dy) -> Seen& { return seen[static_cast<size_t>((dy + kReach + 1) * kSide + dx + kReach + 1)]; };
  bool ends = false, bent = false;
  visit_around(camera, x, y, [&](size_t i, int dx, int dy) {
    ends |= (at(dx, dy) = look(i, found.place(static_cast<float>(dx), static_cast<float>(dy)))) == kBehind;
    const PixelSpread& other = pixels_[i].spread;
    if (other.count == 0 || other.way != 0 || other.normal == surface.normal) return;
    const float turn = dot(unpack_direction(other.normal), axes.normal);
    bent |= turn < kFlat && turn > Gatherer::kSameSurface;
  });
  if (!ends || bent) return {};
  visit_around(camera, x, y, [&](size_t i, int dx, int dy) {
    const Seen here = at(dx, dy);
    const auto beside = [&](Seen what) {
      return at(dx - 1, dy) == what || at(dx + 1, dy) == what || at(dx, dy - 1) == what || at(dx, dy + 1) == what;
    };
    // The end runs through pixels: the points of their other surface tell how much.
    const auto count = static_cast<float>(pixels_[i].spread.count), others = static_cast<float>(pixels_[i].spread.others);
    float& share = found.at(dx, dy);
    if (here == kBehind) share = count > 0 ? others / (count + others) : 0;
    if (here == kSurface && beside(kBehind)) share = count / (count + others);
  });
  return found;
}

// Where the surface ends within the largest disk of a pixel whose sample has a visible point.
Creases Film::creases(const Camera& camera, const CameraSamples& samples, uint64_t x, uint64_t y) const {
  const size_t own = y * camera.region_width + x;
  const CameraSample& own_sample = samples.pixels[own];
  const TangentAxes axes = axes_of(camera, own_sample.point);
  Creases found;
  // At a crease half of a pixel's points lie on the surface that its neighbour has.
  const PixelSpread* surface = nullptr;
  const auto take = [&](size_t i) {
    if (!surface && pixels_[i].spread.has(own_sample, axes)) surface = &pixels_[i].spread;
  };
  take(own);
  if (x > 0) take(own - 1);
  if (x + 1 < camera.region_width) take(own + 1);
  if (y > 0) take(own - camera.region_width);
  if (y + 1 < camera.region_height) take(own + camera.region_width);
  PixelSpread alone;  // of something thinner than a pixel, or seen by another way
  if (!surface) alone.add(own_sample, axes), surface = &alone;
  const PixelSpread& spread = *surface;
  visit_around(camera, x, y, [&](size_t i, int dx, int dy) {
    const PixelSpread& other = pixels_[i].spread;
    const CameraSample& sample = samples.pixels[i];
    if (other.count == 0 || other.normal == spread.normal || !sample.point.valid()) return;
    const TangentAxes other_axes = axes_of(camera, sample.point);
    if (!other.has(sample, other_axes)) return;
    found.add(spread, axes, other, other_axes, std::sqrt(static_cast<float>(dx * dx + dy * dy)));
  });
  if (found.any())
    visit_around(camera, x, y, [&](size_t i, int, int) {
      if (pixels_[i].spread.count > 0) found.check(spread, axes, pixels_[i].spread);
    });
  if (spread.way == 0 && axes.cosine > kGrazing) found.outline = outline(camera, samples, x, y, spread, axes);
  return found;
}

}  // namespace sppm
