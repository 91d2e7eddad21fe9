#include "targets.h"

#include <algorithm>
#include <cmath>

#include "sampling.h"

namespace sppm {
namespace {

// Balls are replaced by those of their halves where that leaves less of their volume: thin sheets and rings are, solid balls are not.
constexpr float kWorthSplitting = 0.8f;
// Balls hold their casters in spite of rounding.
constexpr float kSlack = 1 + 1e-5f;

float cube(float x) { return x * x * x; }

// By eights: a running sum would wait for each addition.
float sum_of(const float* values, size_t n) {
  constexpr size_t kLanes = 8;
  float lanes[kLanes] = {}, total = 0;
  size_t i = 0;
  for (; i + kLanes <= n; i += kLanes)
    for (size_t k = 0; k < kLanes; ++k) lanes[k] += values[i + k];
  for (; i < n; ++i) total += values[i];
  for (const float lane : lanes) total += lane;
  return total;
}

}  // namespace

Targets::Ball Targets::enclose(const Caster* begin, const Caster* end) {
  Bounds bounds;
  Ball ball;
  for (const Caster* c = begin; c != end; ++c) bounds.add(c->bounds);
  ball.center = bounds.center();
  for (const Caster* c = begin; c != end; ++c) {
    const Vec3 farthest = max(abs(c->bounds.lo - ball.center), abs(c->bounds.hi - ball.center));
    ball.radius = std::max(ball.radius, length(farthest));
    ball.strength = std::max(ball.strength, c->strength);
  }
  ball.radius = ball.radius * kSlack + 0x1p-20f * max_component(abs(ball.center));
  return ball;
}

std::vector<Targets::Ball> Targets::split(Caster* begin, Caster* end, int budget) {
  const Ball whole = enclose(begin, end);
  if (budget == 1 || end - begin == 1) return {whole};
  Bounds centers;
  for (const Caster* c = begin; c != end; ++c) centers.add(c->bounds.center());
  const Vec3 size = centers.hi - centers.lo;
  const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
  const float middle = centers.center()[axis];
  Caster* half = std::partition(begin, end, [&](const Caster& c) { return c.bounds.center()[axis] < middle; });
  if (half == begin || half == end) return {whole};
  std::vector<Ball> parts = split(begin, half, budget / 2);
  const std::vector<Ball> rest = split(half, end, budget - budget / 2);
  parts.insert(parts.end(), rest.begin(), rest.end());
  float volume = 0;
  for (const Ball& b : parts) volume += cube(b.radius);
  if (volume < kWorthSplitting * cube(whole.radius)) return parts;
  return {whole};
}

void Targets::build(std::vector<Caster> casters) {
  if (casters.empty()) return;
  for (const Ball& b : split(casters.data(), casters.data() + casters.size(), kMost)) {
    x_.push_back(b.center.x), y_.push_back(b.center.y), z_.push_back(b.center.z);
    radius_.push_back(b.radius), strength_.push_back(b.strength);
  }
}

std::optional<Targets::Direction> Targets::sample_direction(Vec3 p, float margin, const Cone& limit, Vec2 u, float choice) const {
  const size_t n = count();
  float cosine[kMost], weight[kMost];  // of the cone around each ball; strength times solid angle
  const float sin_half = safe_sqrt(1 - square(limit.cos_half));
  // By pointers and without branches: the compiler then takes eight balls at a time.
  const float *x = x_.data(), *y = y_.data(), *z = z_.data(), *radius = radius_.data(), *strength = strength_.data();
  for (size_t i = 0; i < n; ++i) {
    const float dx = x[i] - p.x, dy = y[i] - p.y, dz = z[i] - p.z;
    const float d2 = dx * dx + dy * dy + dz * dz, r2 = square(radius[i] + margin), ratio = r2 / d2;
    const float sin2 = ratio < 1 ? ratio : 1.0f;
    const float c = d2 > r2 ? std::sqrt(1 - sin2) : -1.0f;
    const float one_minus_cos = d2 > r2 ? sin2 / (1 + c) : 2.0f;
    const float along = (dx * limit.axis.x + dy * limit.axis.y + dz * limit.axis.z) / std::sqrt(d2);
    // The two cones meet unless their axes are apart by more than both their angles; those may make more than a half turn.
    const bool apart = (limit.cos_half > -c) & (along < limit.cos_half * c - sin_half * std::sqrt(sin2) - 1e-5f);
    cosine[i] = c;
    weight[i] = apart ? 0.0f : strength[i] * one_minus_cos;
  }
  const float total = sum_of(weight, n);
  if (!(total > 0)) return std::nullopt;
  size_t chosen = 0;
  for (float rest = choice * total; chosen + 1 < n && rest >= weight[chosen]; ++chosen) rest -= weight[chosen];
  while (weight[chosen] == 0) --chosen;  // rounding may run past the last that counts
  const Vec3 to_chosen = Vec3{x_[chosen], y_[chosen], z_[chosen]} - p;
  Direction result;
  if (cosine[chosen] < 0) {
    result.direction = sample_sphere(u);
  } else {
    const float sin2 = square(radius_[chosen] + margin) / length_squared(to_chosen);
    result.direction = normalize(Frame(normalize(to_chosen)).to_world(sample_cone(u, sin2 / (1 + cosine[chosen]))));
  }
  const Vec3 w = result.direction;
  float density[kMost];
  for (size_t i = 0; i < n; ++i) {
    const Vec3 d{x_[i] - p.x, y_[i] - p.y, z_[i] - p.z};
    const bool ahead = (dot(d, w) > 0) & (length_squared(cross(d, w)) <= square(radius_[i] + margin));
    density[i] = (weight[i] > 0) & ((cosine[i] < 0) | ahead) ? strength_[i] : 0.0f;
  }
  density[chosen] = strength_[chosen];
  result.pdf_solid_angle = sum_of(density, n) / (2 * kPi * total);
  return result;
}

Targets::Line Targets::sample_line(Vec3 direction, Vec2 u, float choice) const {
  const size_t n = count();
  float total = 0;
  for (size_t i = 0; i < n; ++i) total += strength_[i] * square(radius_[i]);
  size_t chosen = 0;
  for (float rest = choice * total; chosen + 1 < n; ++chosen) {
    const float weight = strength_[chosen] * square(radius_[chosen]);
    if (rest < weight) break;
    rest -= weight;
  }
  const Vec2 d = sample_disk(u);
  const Frame across(direction);
  Line line;
  line.point = Vec3{x_[chosen], y_[chosen], z_[chosen]} + (across.s * d.x + across.t * d.y) * radius_[chosen];
  float density[kMost];
  for (size_t i = 0; i < n; ++i) {
    const Vec3 to_center{x_[i] - line.point.x, y_[i] - line.point.y, z_[i] - line.point.z};
    const bool met = length_squared(cross(to_center, direction)) <= square(radius_[i]);
    density[i] = met ? strength_[i] : 0.0f;
  }
  density[chosen] = strength_[chosen];
  line.pdf_area = sum_of(density, n) / (kPi * total);
  return line;
}

}  // namespace sppm
