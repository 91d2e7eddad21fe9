#include "lamp.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "color.h"
#include "mesh.h"
#include "sampling.h"
#include "status.h"

namespace sppm {
namespace {

// Below this lamps are points: the solid angle of a smaller one, seen from afar, is no float any more.
constexpr float kSmallestRadius = 1e-12f;

Vec3 unit_axis(const Affine& m, int column, const std::string& where) {
  const Vec3 a = m.column(column);
  const float l = length(a);
  require(std::isfinite(l) && l > 0, where + "transform must be finite and invertible");
  return a / l;
}

// 1 - cos(angle), exact for small angles.
float versine(float angle) { return 2 * square(std::sin(angle / 2)); }

}  // namespace

Lamp::Lamp(const SppmLightDesc& d) {
  const std::string where = std::string("light '") + (d.name ? d.name : "") + "': ";
  require(d.type >= SPPM_LIGHT_POINT && d.type <= SPPM_LIGHT_ELLIPSE, where + "type must be an SppmLightType");
  for (const float e : d.emission) require(std::isfinite(e) && e >= 0, where + "emission must be finite and at least 0");
  for (const float m : d.transform) require(std::isfinite(m), where + "transform must be finite");
  require(std::isfinite(d.radius) && d.radius >= 0, where + "radius must be finite and at least 0");
  Affine m;
  std::copy(d.transform, d.transform + 12, m.m.begin());
  type = static_cast<SppmLightType>(d.type);
  flags = d.flags;
  position = m.column(3);
  emission = {d.emission[0], d.emission[1], d.emission[2]};
  axis = -unit_axis(m, 2, where);
  switch (type) {
    case SPPM_LIGHT_SPOT:
      require(std::isfinite(d.angle) && d.angle > 0 && d.angle <= 2 * kPi, where + "angle must be above 0 and at most 2 pi");
      require(d.blend >= 0 && d.blend <= 1, where + "blend must be from 0 to 1");
      one_minus_cos = versine(d.angle / 2), cos_half = 1 - one_minus_cos, blend = d.blend;
      [[fallthrough]];
    case SPPM_LIGHT_POINT: radius = d.radius < kSmallestRadius ? 0 : d.radius; break;
    case SPPM_LIGHT_SUN:
      require(std::isfinite(d.angle) && d.angle >= 0 && d.angle <= kPi, where + "angle must be from 0 to pi");
      one_minus_cos = versine(d.angle / 2);
      break;
    default:
      require(std::isfinite(d.size_x) && std::isfinite(d.size_y) && d.size_x >= 0 && d.size_y >= 0,
              where + "size_x and size_y must be finite and at least 0");
      x = m.column(0) * (d.size_x / 2), y = m.column(1) * (d.size_y / 2);
      axis = normalize(face_toward(cross(m.column(0), m.column(1)), axis));
      area = 2 * area_of({Vec3{}, x, y}) * (type == SPPM_LIGHT_ELLIPSE ? M_PI : 4.0);
  }
}

double Lamp::power(float scene_radius) const {
  const double lum = static_cast<double>(luminance(emission));
  switch (type) {
    case SPPM_LIGHT_POINT: return 4 * M_PI * lum;
    case SPPM_LIGHT_SPOT: {
      double sum = 0;
      constexpr int kSteps = 512;
      for (int i = 0; i < kSteps; ++i) {
        const float c = 1 - one_minus_cos * (static_cast<float>(i) + 0.5f) / kSteps;
        sum += static_cast<double>(spot_factor(c).x);
      }
      return 2 * M_PI * static_cast<double>(one_minus_cos) * sum / kSteps * lum;
    }
    case SPPM_LIGHT_SUN:  // through disks across its directions, of which those away from the axis bring less to a plane facing it
      return M_PI * static_cast<double>(square(scene_radius)) * lum * 2 / (2 - static_cast<double>(one_minus_cos));
    default: return M_PI * area * lum;
  }
}

LightBounds Lamp::bounds() const {
  LightBounds b;
  b.center = position, b.axis = axis;
  b.intensity = luminance(emission);
  switch (type) {
    case SPPM_LIGHT_SUN: b.intensity = 0; break;
    case SPPM_LIGHT_POINT: b.radius = radius; break;
    case SPPM_LIGHT_SPOT:
      // The fall-off belongs to the point of a lamp's sphere that is seen, so the cone is that of the whole sphere.
      b.radius = radius, b.spread = radius > 0 ? kPi : std::acos(std::clamp(cos_half, -1.0f, 1.0f));
      break;
    default:
      b.radius = length(max(abs(x + y), abs(x - y)));
      b.intensity *= static_cast<float>(area);
      b.spread = 0, b.fade = kPi / 2;
  }
  return b;
}

Bounds Lamp::box() const {
  const Vec3 half = area > 0 ? abs(x) + abs(y) : splat(radius);
  return {position - half, position + half};
}

Vec3 Lamp::spot_factor(float cos_theta) const {
  if (type != SPPM_LIGHT_SPOT) return {1, 1, 1};
  const float inside = cos_theta - cos_half;
  if (inside <= 0) return {};
  const float edge = blend > 0 ? smooth_step(0, 1, inside / (one_minus_cos * blend)) : 1.0f;
  return splat(flags & SPPM_LIGHT_SPOT_COSINE ? edge * std::max(cos_theta, 0.0f) : edge);
}

std::optional<DirectSample> Lamp::sample_direct(Vec3 p, Vec2 u) const {
  DirectSample s;
  s.casts_shadow = !(flags & SPPM_LIGHT_NO_SHADOW);
  const Vec3 to_center = position - p;
  const float d2 = length_squared(to_center);
  switch (type) {
    case SPPM_LIGHT_SUN:
      s.distance = kInfinity;
      s.delta = one_minus_cos == 0;
      s.wi = s.delta ? -axis : Frame(-axis).to_world(sample_cone(u, one_minus_cos));
      s.pdf = s.delta ? 1 : 1 / (2 * kPi * one_minus_cos);
      s.radiance = s.delta ? emission : emission / (kPi * one_minus_cos * (2 - one_minus_cos));
      return s;
    case SPPM_LIGHT_POINT:
    case SPPM_LIGHT_SPOT: {
      if (d2 <= 0) return std::nullopt;
      const float d = std::sqrt(d2);
      if (radius == 0) {
        s.wi = to_center / d, s.distance = d, s.delta = true, s.pdf = 1;
        s.radiance = emission * spot_factor(dot(-s.wi, axis)) / d2;
        return s;
      }
      if (d <= radius) return std::nullopt;  // inside the lamp: its surface emits outward only
      const float sin2 = square(radius) / d2;
      const float cap = sin2 / (1 + safe_sqrt(1 - sin2));  // 1 - cos of the half angle that the sphere fills
      s.wi = normalize(Frame(to_center / d).to_world(sample_cone(u, cap)));
      const float along = dot(s.wi, to_center);
      s.distance = along - safe_sqrt(square(radius) - (d2 - along * along));
      s.pdf = 1 / (2 * kPi * cap);
      s.radiance = emission * spot_factor(dot(-s.wi, axis)) / (kPi * square(radius));
      return s;
    }
    default: {
      if (area <= 0) return std::nullopt;
      const Vec2 q = type == SPPM_LIGHT_ELLIPSE ? sample_disk(u) : Vec2{2 * u.x - 1, 2 * u.y - 1};
      const Vec3 to_point = position + x * q.x + y * q.y - p;
      const float distance2 = length_squared(to_point);
      if (distance2 <= 0) return std::nullopt;
      s.distance = std::sqrt(distance2);
      s.wi = to_point / s.distance;
      const float cosine = -dot(s.wi, axis);
      if (cosine <= 0) return std::nullopt;
      s.pdf = distance2 / (cosine * static_cast<float>(area));
      s.radiance = emission;
      return s;
    }
  }
}

std::optional<float> Lamp::distance_along(Vec3 origin, Vec3 direction, float near, float far) const {
  if (sun()) {
    const float off = 0.5f * length_squared(direction + axis);  // 1 - cos to the sun's centre
    return off > one_minus_cos ? std::nullopt : std::optional(kInfinity);
  }
  const Vec3 to_center = position - origin;
  if (type == SPPM_LIGHT_POINT || type == SPPM_LIGHT_SPOT) {
    const float d2 = length_squared(to_center), r2 = square(radius);
    const float along = dot(direction, to_center);
    const float off2 = length_squared(to_center - direction * along);
    if (d2 <= r2 || along <= 0 || off2 > r2) return std::nullopt;
    const float t = along - std::sqrt(r2 - off2);
    return t <= near || t > far ? std::nullopt : std::optional(t);
  }
  const float cosine = -dot(direction, axis);
  if (cosine <= 0) return std::nullopt;
  const float t = -dot(to_center, axis) / cosine;
  if (!(t > near) || t > far) return std::nullopt;
  const Vec3 q = direction * t - to_center;
  const float a = dot(q, x) / length_squared(x), b = dot(q, y) / length_squared(y);
  const bool inside = type == SPPM_LIGHT_ELLIPSE ? a * a + b * b <= 1 : std::abs(a) <= 1 && std::abs(b) <= 1;
  return inside ? std::optional(t) : std::nullopt;
}

EmittedLight Lamp::emitted(Vec3 origin, Vec3 direction, float t, float choice) const {
  switch (type) {
    case SPPM_LIGHT_SUN: return {emission / (kPi * one_minus_cos * (2 - one_minus_cos)), choice / (2 * kPi * one_minus_cos)};
    case SPPM_LIGHT_POINT:
    case SPPM_LIGHT_SPOT: {
      const float r2 = square(radius), sin2 = r2 / length_squared(position - origin);
      const float cap = sin2 / (1 + safe_sqrt(1 - sin2));  // 1 - cos of the half angle that the sphere fills
      return {emission * spot_factor(dot(-direction, axis)) / (kPi * r2), choice / (2 * kPi * cap)};
    }
    default: return {emission, choice * t * t / (-dot(direction, axis) * static_cast<float>(area))};
  }
}

}  // namespace sppm
