#include "pixel_spread.h"

namespace sppm {
namespace {

// A point this many footprints away, seen straight on, is another surface's, or the same surface's by another way.
constexpr float kReach = 6;
// From the tangent plane, in footprints.
constexpr float kOffPlane = 0.25f;
// Standard deviation of Blender's filter of 1.5 pixels, in footprints, and how many points it counts for.
constexpr float kPriorSpread = 0.4f, kPriorPoints = 3;
// Standard deviation across of what a kernel may cover, in footprints.
constexpr float kWidest = 0.95f;
constexpr uint32_t kMostPoints = (1 << 12) - 1;

// The coordinates that remain.
constexpr int first_kept(uint32_t dropped) { return dropped == 0 ? 1 : 0; }
constexpr int second_kept(uint32_t dropped) { return dropped == 2 ? 1 : 2; }

}  // namespace

bool PixelSpread::near_plane(Vec3 p, const TangentAxes& axes) const {
  const Vec3 d = p - mean;
  return std::abs(dot(d, axes.normal)) <= kOffPlane * axes.footprint && dot(d, d) <= square(kReach * axes.footprint / axes.cosine);
}

void PixelSpread::begin(const CameraSample& sample, const TangentAxes& axes) {
  const Vec3 n = abs(axes.normal);
  mean = sample.point.p;
  normal = sample.point.ng;
  way = sample.way & 15;
  count = 1, others = 0;
  dropped = n.x >= n.y && n.x >= n.z ? 0 : n.y >= n.z ? 1 : 2;
  // A disk around the line of sight, cut by the surface.
  const float variance = square(kPriorSpread * axes.footprint), stretch = 1 / square(axes.cosine) - 1;
  const int u = first_kept(dropped), v = second_kept(dropped);
  const auto entry = [&](int i, int j) {
    return variance * (static_cast<float>(i == j) - axes.normal[i] * axes.normal[j] + stretch * axes.along[i] * axes.along[j]);
  };
  uu = entry(u, u), uv = entry(u, v), vv = entry(v, v);
}

void PixelSpread::add(const CameraSample& sample, const TangentAxes& axes) {
  forget();
  if (!has(sample, axes)) {
    if (others < count) {
      ++others;
    } else {
      begin(sample, axes);
    }
    return;
  }
  ++count;
  const Vec3 before = sample.point.p - mean;
  mean += before / static_cast<float>(count);
  const Vec3 after = sample.point.p - mean;
  const float share = 1 / (kPriorPoints + static_cast<float>(count));
  const int u = first_kept(dropped), v = second_kept(dropped);
  uu += (before[u] * after[u] - uu) * share;
  uv += (before[u] * after[v] - uv) * share;
  vv += (before[v] * after[v] - vv) * share;
}

// Both counts, before one of them has no room.
void PixelSpread::forget() {
  if (count == kMostPoints || others == kMostPoints) count = (count + 1) / 2, others = others / 2;
}

PixelEllipse PixelSpread::ellipse(const TangentAxes& axes) const {
  // From the two coordinates to the plane: the normal tells the third.
  const Frame frame(axes.normal);
  const int u = first_kept(dropped), v = second_kept(dropped), w = static_cast<int>(dropped);
  if (std::abs(axes.normal[w]) < 0.1f) return {};
  const float du = axes.normal[u] / axes.normal[w], dv = axes.normal[v] / axes.normal[w];
  const float su = frame.s[u] - frame.s[w] * du, sv = frame.s[v] - frame.s[w] * dv;
  const float tu = frame.t[u] - frame.t[w] * du, tv = frame.t[v] - frame.t[w] * dv;
  const float ss = su * su * uu + 2 * su * sv * uv + sv * sv * vv, tt = tu * tu * uu + 2 * tu * tv * uv + tv * tv * vv;
  const float st = su * tu * uu + (su * tv + sv * tu) * uv + sv * tv * vv;
  // Eigenvalues and the larger one's eigenvector.
  const float half = 0.5f * (ss + tt), root = std::sqrt(square(0.5f * (ss - tt)) + st * st);
  if (half - root > square(kWidest * axes.footprint)) return {};
  const float angle = 0.5f * std::atan2(2 * st, ss - tt);
  const Vec3 axis = frame.s * std::cos(angle) + frame.t * std::sin(angle);
  return {mean, pack_direction(axis), std::sqrt(half + root), std::sqrt(std::max(half - root, 1e-4f * half))};
}

}  // namespace sppm
