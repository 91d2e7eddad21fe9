#include "emission.h"

#include "mesh.h"

namespace sppm {
namespace {

// A direction in which a surface shines, about as strongly in each, with cos / pdf [sr].
struct SurfaceDirection {
  Vec3 direction;
  float cos_over_pdf;
};
std::optional<SurfaceDirection> sample_surface_direction(Vec3 p, Vec3 normal, const Targets* targets, Vec2 u, float target) {
  if (!targets) return SurfaceDirection{normalize(Frame(normal).to_world(sample_cosine_hemisphere(u))), kPi};
  const auto aimed = targets->sample_direction(p, 0, {normal, 0}, u, target);
  if (!aimed) return std::nullopt;
  const float cosine = dot(aimed->direction, normal);
  if (cosine <= 0) return std::nullopt;
  return SurfaceDirection{aimed->direction, cosine / aimed->pdf_solid_angle};
}

PhotonStart emit_from_infinity(Vec3 toward_light, Vec3 weight, const PhotonAim& aim, Vec2 u, float target) {
  if (aim.targets) {
    const Targets::Line line = aim.targets->sample_line(toward_light, u, target);
    const float height = aim.radius + dot(aim.center - line.point, toward_light);
    return {line.point + toward_light * height, -toward_light, weight / line.pdf_area};
  }
  const Vec2 d = sample_disk(u);
  const Frame frame(toward_light);
  const Vec3 origin = aim.center + (frame.s * d.x + frame.t * d.y + toward_light) * aim.radius;
  return {origin, -toward_light, weight * (kPi * square(aim.radius))};
}

PhotonStart emit_sun(const Lamp& lamp, const PhotonAim& aim, const Sample4& u, float target) {
  const Vec3 toward = lamp.one_minus_cos == 0 ? -lamp.axis : Frame(-lamp.axis).to_world(sample_cone(u.second(), lamp.one_minus_cos));
  const float radiance_over_pdf = 2 / (2 - lamp.one_minus_cos);  // (1 / (pi sin^2)) (2 pi (1 - cos))
  const Vec3 weight = lamp.emission * (lamp.one_minus_cos == 0 ? 1 : radiance_over_pdf);
  return emit_from_infinity(normalize(toward), weight, aim, u.first(), target);
}

// A sphere that shines with I(omega) / (pi r^2) sends I(omega) through its disk across omega.
std::optional<PhotonStart> emit_sphere(const Lamp& lamp, const Targets* targets, const Sample4& u, float target) {
  const bool spot = lamp.type == SPPM_LIGHT_SPOT;
  const float one_minus_cos = spot ? lamp.one_minus_cos : 2.0f;
  const Cone cone{spot ? lamp.axis : Vec3{0, 0, 1}, spot ? lamp.cos_half : -1.0f};
  Targets::Direction sample;
  if (targets) {
    const auto aimed = targets->sample_direction(lamp.position, lamp.radius, cone, u.second(), target);
    if (!aimed) return std::nullopt;
    sample = *aimed;
  } else {
    sample = {normalize(Frame(cone.axis).to_world(sample_cone(u.second(), one_minus_cos))), 1 / (2 * kPi * one_minus_cos)};
  }
  const Vec2 d = sample_disk(u.first());
  const Frame across(sample.direction);
  const float forward = safe_sqrt(1 - d.x * d.x - d.y * d.y);
  const Vec3 origin = lamp.position + (across.s * d.x + across.t * d.y + sample.direction * forward) * lamp.radius;
  const Vec3 weight = lamp.emission * lamp.spot_factor(dot(sample.direction, lamp.axis)) / sample.pdf_solid_angle;
  return PhotonStart{origin, sample.direction, weight};
}

std::optional<PhotonStart> emit_area(const Lamp& lamp, const Targets* targets, const Sample4& u, float target) {
  const Vec2 q = lamp.type == SPPM_LIGHT_ELLIPSE ? sample_disk(u.first()) : Vec2{2 * u[0] - 1, 2 * u[1] - 1};
  const Vec3 origin = lamp.position + lamp.x * q.x + lamp.y * q.y;
  const auto sample = sample_surface_direction(origin, lamp.axis, targets, u.second(), target);
  if (!sample) return std::nullopt;
  return PhotonStart{origin, sample->direction, lamp.emission * (sample->cos_over_pdf * static_cast<float>(lamp.area))};
}

}  // namespace

std::optional<PhotonStart> emit(const Lamp& lamp, const PhotonAim& aim, const Sample4& u, float target) {
  switch (lamp.type) {
    case SPPM_LIGHT_SUN: return emit_sun(lamp, aim, u, target);
    case SPPM_LIGHT_POINT:
    case SPPM_LIGHT_SPOT: return emit_sphere(lamp, aim.targets, u, target);
    default: return emit_area(lamp, aim.targets, u, target);
  }
}

std::optional<PhotonStart> emit(const EmissiveMesh& mesh, const PhotonAim& aim, const Sample4& u, const Sample4& v) {
  float choice = v[1];
  const size_t i = mesh.choice.sample(choice);
  const EmissiveTriangle& t = mesh.triangles[i];
  const Vec2 b = sample_triangle(u.first());
  const Vec3 e1 = t.p[1] - t.p[0], e2 = t.p[2] - t.p[0], front = unit_normal(e1, e2);
  if (is_black(front)) return std::nullopt;
  const Vec3 normal = choice < 0.5f ? front : -front;
  const Vec3 origin = t.at(b) + normal * clearance(t.reach, e1, e2);
  const auto sample = sample_surface_direction(origin, normal, aim.targets, u.second(), v[2]);
  if (!sample) return std::nullopt;
  const float weight = 2 * sample->cos_over_pdf * static_cast<float>(t.area) / mesh.choice.probability(i);
  return PhotonStart{origin, sample->direction, mesh.radiance(t, b, sample->direction) * weight};
}

std::optional<PhotonStart> emit(const Environment& environment, const PhotonAim& aim, const Sample4& u, float target) {
  float pdf = 0;
  const Vec3 toward = environment.sample_direction(u.second(), pdf);
  if (!(pdf > 0)) return std::nullopt;
  return emit_from_infinity(toward, environment.radiance(toward) / pdf, aim, u.first(), target);
}

}  // namespace sppm
