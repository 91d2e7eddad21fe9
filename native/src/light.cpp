#include "light.h"

#include <numeric>

#include "color.h"
#include "mesh.h"
#include "status.h"

namespace sppm {
namespace {

constexpr int kLargestMap = 1024;  // cells across the environment's sampling table
constexpr uint64_t kMostLooks = 1 << 16;  // at the textures of one emitting mesh, to know where it is bright

Vec3 unit_axis(const Affine& m, int column, const std::string& where) {
  const Vec3 a = m.column(column);
  const float l = length(a);
  require(std::isfinite(l) && l > 0, where + "transform must be finite and invertible");
  return a / l;
}

float smoothstep(float x) {
  const float t = std::clamp(x, 0.0f, 1.0f);
  return t * t * (3 - 2 * t);
}

// True for lamps whose light on rough surfaces is direct light's alone: a scattered ray would not meet them, or be shadowed.
bool direct_only(uint32_t flags) { return flags & (SPPM_LIGHT_HIDDEN_FROM_SPECULAR | SPPM_LIGHT_NO_SHADOW); }

// 1 - cos(angle), exact for small angles.
float versine(float angle) { return 2 * square(std::sin(angle / 2)); }

// A direction in which a surface of constant radiance shines, with cos / pdf [sr].
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

}  // namespace

uint32_t Lights::add_lamp(const SppmLightDesc& d) {
  const std::string where = std::string("light '") + (d.name ? d.name : "") + "': ";
  require(d.type >= SPPM_LIGHT_POINT && d.type <= SPPM_LIGHT_ELLIPSE, where + "type must be an SppmLightType");
  for (const float e : d.emission) require(std::isfinite(e) && e >= 0, where + "emission must be finite and at least 0");
  for (const float m : d.transform) require(std::isfinite(m), where + "transform must be finite");
  require(std::isfinite(d.radius) && d.radius >= 0, where + "radius must be finite and at least 0");
  Affine m;
  std::copy(d.transform, d.transform + 12, m.m.begin());
  Lamp lamp;
  lamp.type = static_cast<SppmLightType>(d.type);
  lamp.flags = d.flags;
  lamp.position = m.column(3);
  lamp.emission = {d.emission[0], d.emission[1], d.emission[2]};
  lamp.axis = -unit_axis(m, 2, where);
  switch (lamp.type) {
    case SPPM_LIGHT_SPOT:
      require(std::isfinite(d.angle) && d.angle > 0 && d.angle <= 2 * kPi, where + "angle must be above 0 and at most 2 pi");
      require(d.blend >= 0 && d.blend <= 1, where + "blend must be from 0 to 1");
      lamp.one_minus_cos = versine(d.angle / 2), lamp.cos_half = 1 - lamp.one_minus_cos, lamp.blend = d.blend;
      [[fallthrough]];
    case SPPM_LIGHT_POINT: lamp.radius = d.radius; break;
    case SPPM_LIGHT_SUN:
      require(std::isfinite(d.angle) && d.angle >= 0 && d.angle <= kPi, where + "angle must be from 0 to pi");
      lamp.one_minus_cos = versine(d.angle / 2);
      break;
    default:
      require(std::isfinite(d.size_x) && std::isfinite(d.size_y) && d.size_x >= 0 && d.size_y >= 0,
              where + "size_x and size_y must be finite and at least 0");
      lamp.x = m.column(0) * (d.size_x / 2), lamp.y = m.column(1) * (d.size_y / 2);
      lamp.axis = normalize(face_toward(cross(m.column(0), m.column(1)), lamp.axis));
      lamp.area = static_cast<double>(length(cross(lamp.x, lamp.y))) * (lamp.type == SPPM_LIGHT_ELLIPSE ? kPi : 4.0f);
  }
  lamps_.push_back(lamp);
  return static_cast<uint32_t>(lamps_.size());
}

void Lights::set_world(const SppmWorldDesc& d) {
  for (const float r : d.radiance) require(std::isfinite(r) && r >= 0, "world: radiance must be finite and at least 0");
  require(d.image <= textures_->image_count(), "world: image " + std::to_string(d.image) + " is not of this scene");
  world_factor_ = {d.radiance[0], d.radiance[1], d.radiance[2]};
  world_image_ = d.image;
  world_hidden_ = d.hidden_from_camera != 0;
  bool given = false;
  for (const float r : d.rotation) {
    require(std::isfinite(r), "world: rotation must be finite");
    given |= r != 0;
  }
  world_rotation_ = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  if (given) std::copy(d.rotation, d.rotation + 9, world_rotation_.begin());
  has_world_ = !is_black(world_factor_);
}

uint32_t Lights::add_triangles(std::vector<EmissiveTriangle> triangles) {
  // A textured triangle is looked at in a few places, more where triangles are few; the least weight keeps what they missed possible.
  const uint64_t looks = std::clamp<uint64_t>(kMostLooks / std::max<size_t>(triangles.size(), 1), 4, 4096);
  std::vector<double> weights;
  for (EmissiveTriangle& t : triangles) {
    for (const Vec3 p : t.p) t.reach = std::max(t.reach, max_component(abs(p)));
    t.area = 0.5 * static_cast<double>(length(cross(t.p[1] - t.p[0], t.p[2] - t.p[0])));
    const uint64_t n = materials_->textured(t.material) ? looks : 1;
    double brightness = 0;
    for (uint64_t k = 0; k < n; ++k)
      brightness += static_cast<double>(luminance(triangle_emission(t, sample_triangle(Sampler(0, k).next().first()))));
    weights.push_back(t.area * brightness / static_cast<double>(n));
  }
  double total_area = 0, total = 0;
  for (size_t i = 0; i < triangles.size(); ++i) total_area += triangles[i].area, total += weights[i];
  if (total > 0)
    for (size_t i = 0; i < triangles.size(); ++i)
      if (materials_->textured(triangles[i].material)) weights[i] += 0.01 * total * triangles[i].area / total_area;
  triangle_sets_.push_back({std::move(triangles), Distribution(weights)});
  return static_cast<uint32_t>(triangle_sets_.size() - 1);
}

double Lights::lamp_power(const Lamp& lamp) const {
  const double y = static_cast<double>(luminance(lamp.emission));
  switch (lamp.type) {
    case SPPM_LIGHT_POINT: return 4 * M_PI * y;
    case SPPM_LIGHT_SPOT: {
      double sum = 0;
      constexpr int kSteps = 512;
      for (int i = 0; i < kSteps; ++i) {
        const float c = 1 - lamp.one_minus_cos * (static_cast<float>(i) + 0.5f) / kSteps;
        sum += static_cast<double>(spot_factor(lamp, c).x);
      }
      return 2 * M_PI * static_cast<double>(lamp.one_minus_cos) * sum / kSteps * y;
    }
    case SPPM_LIGHT_SUN:  // through disks across its directions, of which those away from the axis bring less to a plane facing it
      return M_PI * static_cast<double>(square(radius_)) * y * 2 / (2 - static_cast<double>(lamp.one_minus_cos));
    default: return M_PI * lamp.area * y;
  }
}

void Lights::commit(const Bounds& bounds, Targets targets) {
  targets_ = std::move(targets);
  center_ = bounds.empty() ? Vec3{} : bounds.center();
  radius_ = bounds.radius() * 1.001f;
  std::vector<double> powers;
  lamp_entry_.resize(lamps_.size());
  set_entry_.resize(triangle_sets_.size());
  for (uint32_t i = 0; i < lamps_.size(); ++i) {
    const Lamp& lamp = lamps_[i];
    const double power = lamp_power(lamp);
    lamp_entry_[i] = static_cast<uint32_t>(entries_.size());
    entries_.push_back({Kind::kLamp, i});
    powers.push_back(power);
    if (power <= 0 || lamp.flags & SPPM_LIGHT_HIDDEN_FROM_SPECULAR) continue;
    if (lamp.type == SPPM_LIGHT_SUN && lamp.one_minus_cos > 0) suns_.push_back(i);
    if (lamp.type != SPPM_LIGHT_SUN && (lamp.radius > 0 || lamp.area > 0)) sized_lamps_.push_back(i);
  }
  for (uint32_t i = 0; i < triangle_sets_.size(); ++i) {
    const TriangleSet& set = triangle_sets_[i];
    set_entry_[i] = static_cast<uint32_t>(entries_.size());
    entries_.push_back({Kind::kTriangles, i});
    powers.push_back(2 * M_PI * set.choice.total());
  }
  if (has_world_) {
    build_world_distribution();
    world_entry_ = static_cast<uint32_t>(entries_.size());
    entries_.push_back({Kind::kWorld, 0});
    powers.push_back(M_PI * static_cast<double>(square(radius_)) * world_integral_);
  }
  by_power_ = Distribution(powers);
  if (!targets_.empty()) {
    std::vector<double> aimed;
    for (size_t i = 0; i < entries_.size(); ++i) aimed.push_back(powers[i] > 0 ? aimed_power(entries_[i]) : 0.0);
    const double all = std::accumulate(aimed.begin(), aimed.end(), 0.0);
    // An estimate from few samples may miss what a light does to a target: none that shines is left out.
    for (size_t i = 0; i < entries_.size(); ++i) aimed[i] += powers[i] > 0 ? 0.01 * all * powers[i] / by_power_.total() : 0.0;
    by_aimed_power_ = Distribution(aimed);
  }
  build_choice();
  met_ = has_world_ || !suns_.empty() || !sized_lamps_.empty();
  for (const TriangleSet& set : triangle_sets_) met_ |= !set.choice.empty();
}

LightBounds Lights::lamp_bounds(const Lamp& lamp) const {
  LightBounds b;
  b.center = lamp.position, b.axis = lamp.axis;
  b.intensity = luminance(lamp.emission);
  switch (lamp.type) {
    case SPPM_LIGHT_SUN: b.intensity = 0; break;
    case SPPM_LIGHT_POINT: b.radius = lamp.radius; break;
    case SPPM_LIGHT_SPOT:
      // The fall-off belongs to the point of a lamp's sphere that is seen, so the cone is that of the whole sphere.
      b.radius = lamp.radius, b.spread = lamp.radius > 0 ? kPi : std::acos(std::clamp(lamp.cos_half, -1.0f, 1.0f));
      break;
    default:
      b.radius = length(max(abs(lamp.x + lamp.y), abs(lamp.x - lamp.y)));
      b.intensity *= static_cast<float>(lamp.area);
      b.spread = 0, b.fade = kPi / 2;
  }
  return b;
}

void Lights::build_choice() {
  std::vector<LightBounds> near(entries_.size());
  std::vector<double> far;
  for (uint32_t i = 0; i < entries_.size(); ++i) {
    const Entry& entry = entries_[i];
    double irradiance = 0;
    if (entry.kind == Kind::kLamp) {
      near[i] = lamp_bounds(lamps_[entry.index]);
      if (lamps_[entry.index].type == SPPM_LIGHT_SUN) irradiance = static_cast<double>(luminance(lamps_[entry.index].emission));
    } else if (entry.kind == Kind::kTriangles) {
      const TriangleSet& set = triangle_sets_[entry.index];
      Bounds bounds;
      for (const EmissiveTriangle& t : set.triangles)
        for (const Vec3 p : t.p) bounds.add(p);
      near[i].center = bounds.center(), near[i].radius = bounds.radius();
      near[i].intensity = static_cast<float>(set.choice.total());
    } else {
      irradiance = world_integral_ / 4;  // of a hemisphere of the mean radiance
    }
    if (irradiance <= 0) continue;
    far_entries_.push_back(i);
    far.push_back(irradiance);
  }
  near_.build(near);
  far_ = Distribution(far);
}

std::optional<LightTree::Choice> Lights::choose(Vec3 p, float& u) const {
  const float near = near_.irradiance(p), total = near + static_cast<float>(far_.total());
  if (!(total > 0)) return std::nullopt;
  const float share = near / total;
  if (u < share) {
    u = std::min(u / share, 0x1.fffffep-1f);
    auto choice = near_.sample(p, u);
    if (choice) choice->probability *= share;
    return choice;
  }
  u = std::min((u - share) / (1 - share), 0x1.fffffep-1f);
  if (far_.empty()) return std::nullopt;
  const size_t i = far_.sample(u);
  return LightTree::Choice{far_entries_[i], (1 - share) * far_.probability(i)};
}

float Lights::probability(uint32_t entry, Vec3 p) const {
  const float near = near_.irradiance(p), total = near + static_cast<float>(far_.total());
  if (!(total > 0)) return 0;
  for (size_t i = 0; i < far_entries_.size(); ++i)
    if (far_entries_[i] == entry) return (1 - near / total) * far_.probability(i);
  return near / total * near_.probability(entry, p);
}

Vec3 Lights::spot_factor(const Lamp& lamp, float cos_theta) const {
  if (lamp.type != SPPM_LIGHT_SPOT) return {1, 1, 1};
  const float inside = cos_theta - lamp.cos_half;
  if (inside <= 0) return {};
  const float edge = lamp.blend > 0 ? smoothstep(inside / (lamp.one_minus_cos * lamp.blend)) : 1.0f;
  return splat(lamp.flags & SPPM_LIGHT_SPOT_COSINE ? edge * std::max(cos_theta, 0.0f) : edge);
}

std::optional<DirectSample> Lights::sample_lamp(const Lamp& lamp, Vec3 p, Vec2 u) const {
  DirectSample s;
  s.casts_shadow = !(lamp.flags & SPPM_LIGHT_NO_SHADOW);
  const Vec3 to_center = lamp.position - p;
  const float d2 = length_squared(to_center);
  switch (lamp.type) {
    case SPPM_LIGHT_SUN:
      s.distance = kInfinity;
      s.delta = lamp.one_minus_cos == 0;
      s.wi = s.delta ? -lamp.axis : Frame(-lamp.axis).to_world(sample_cone(u, lamp.one_minus_cos));
      s.pdf = s.delta ? 1 : 1 / (2 * kPi * lamp.one_minus_cos);
      s.radiance = s.delta ? lamp.emission : lamp.emission / (kPi * lamp.one_minus_cos * (2 - lamp.one_minus_cos));
      return s;
    case SPPM_LIGHT_POINT:
    case SPPM_LIGHT_SPOT: {
      if (d2 <= 0) return std::nullopt;
      const float d = std::sqrt(d2);
      if (lamp.radius == 0) {
        s.wi = to_center / d, s.distance = d, s.delta = true, s.pdf = 1;
        s.radiance = lamp.emission * spot_factor(lamp, dot(-s.wi, lamp.axis)) / d2;
        return s;
      }
      if (d <= lamp.radius) return std::nullopt;  // inside the lamp: its surface emits outward only
      const float sin2 = square(lamp.radius) / d2;
      const float one_minus_cos = sin2 / (1 + safe_sqrt(1 - sin2));
      s.wi = normalize(Frame(to_center / d).to_world(sample_cone(u, one_minus_cos)));
      const float along = dot(s.wi, to_center);
      s.distance = along - safe_sqrt(square(lamp.radius) - (d2 - along * along));
      s.pdf = 1 / (2 * kPi * one_minus_cos);
      s.radiance = lamp.emission * spot_factor(lamp, dot(-s.wi, lamp.axis)) / (kPi * square(lamp.radius));
      return s;
    }
    default: {
      if (lamp.area <= 0) return std::nullopt;
      const Vec2 q = lamp.type == SPPM_LIGHT_ELLIPSE ? sample_disk(u) : Vec2{2 * u.x - 1, 2 * u.y - 1};
      const Vec3 to_point = lamp.position + lamp.x * q.x + lamp.y * q.y - p;
      const float distance2 = length_squared(to_point);
      if (distance2 <= 0) return std::nullopt;
      s.distance = std::sqrt(distance2);
      s.wi = to_point / s.distance;
      const float cosine = -dot(s.wi, lamp.axis);
      if (cosine <= 0) return std::nullopt;
      s.pdf = distance2 / (cosine * static_cast<float>(lamp.area));
      s.radiance = lamp.emission;
      return s;
    }
  }
}

std::optional<EmittedLight> Lights::lamp_along(uint32_t i, Vec3 origin, Vec3 direction, float near, float far) const {
  const Lamp& lamp = lamps_[i];
  // Infinite where direct light takes all: the weight of a rough surface's ray is then 0.
  const auto choice = [&] { return direct_only(lamp.flags) ? kInfinity : probability(lamp_entry_[i], origin); };
  const Vec3 to_center = lamp.position - origin;
  if (lamp.type == SPPM_LIGHT_POINT || lamp.type == SPPM_LIGHT_SPOT) {
    const float d2 = length_squared(to_center), r2 = square(lamp.radius);
    const float along = dot(direction, to_center);
    const float off2 = length_squared(to_center - direction * along);
    if (d2 <= r2 || along <= 0 || off2 > r2) return std::nullopt;
    const float t = along - std::sqrt(r2 - off2);
    if (t <= near || t > far) return std::nullopt;
    const float sin2 = r2 / d2;
    const float one_minus_cos = sin2 / (1 + safe_sqrt(1 - sin2));
    return EmittedLight{lamp.emission * spot_factor(lamp, dot(-direction, lamp.axis)) / (kPi * r2), choice() / (2 * kPi * one_minus_cos)};
  }
  const float cosine = -dot(direction, lamp.axis);
  if (cosine <= 0) return std::nullopt;
  const float t = -dot(to_center, lamp.axis) / cosine;
  if (!(t > near) || t > far) return std::nullopt;
  const Vec3 q = direction * t - to_center;
  const float a = dot(q, lamp.x) / length_squared(lamp.x), b = dot(q, lamp.y) / length_squared(lamp.y);
  const bool inside = lamp.type == SPPM_LIGHT_ELLIPSE ? a * a + b * b <= 1 : std::abs(a) <= 1 && std::abs(b) <= 1;
  if (!inside) return std::nullopt;
  return EmittedLight{lamp.emission, choice() * t * t / (cosine * static_cast<float>(lamp.area))};
}

std::optional<EmittedLight> Lights::sun_along(uint32_t i, Vec3 origin, Vec3 direction) const {
  const Lamp& lamp = lamps_[i];
  const float off = 0.5f * length_squared(direction + lamp.axis);  // 1 - cos to the sun's centre
  if (off > lamp.one_minus_cos) return std::nullopt;
  const float choice = direct_only(lamp.flags) ? kInfinity : probability(lamp_entry_[i], origin);
  return EmittedLight{lamp.emission / (kPi * lamp.one_minus_cos * (2 - lamp.one_minus_cos)), choice / (2 * kPi * lamp.one_minus_cos)};
}

Vec3 Lights::triangle_emission(const EmissiveTriangle& t, Vec2 b) const {
  const float a = 1 - b.x - b.y;
  SurfaceAttributes at;
  at.uv = {t.attributes[0].uv.x * a + t.attributes[1].uv.x * b.x + t.attributes[2].uv.x * b.y,
           t.attributes[0].uv.y * a + t.attributes[1].uv.y * b.x + t.attributes[2].uv.y * b.y};
  at.color = t.attributes[0].color * a + t.attributes[1].color * b.x + t.attributes[2].color * b.y;
  return materials_->emission(t.material, at);
}

std::optional<DirectSample> Lights::sample_triangles(const TriangleSet& set, Vec3 p, Vec2 u, float choice) const {
  const size_t i = set.choice.sample(choice);
  const EmissiveTriangle& t = set.triangles[i];
  const Vec2 b = sample_triangle(u);
  const Vec3 point = t.p[0] * (1 - b.x - b.y) + t.p[1] * b.x + t.p[2] * b.y, to_point = point - p;
  const float distance2 = length_squared(to_point);
  const Vec3 e1 = t.p[1] - t.p[0], e2 = t.p[2] - t.p[0], normal = cross(e1, e2);
  if (distance2 <= 0) return std::nullopt;
  DirectSample s;
  s.distance = std::sqrt(distance2);
  s.wi = to_point / s.distance;
  const float cosine = std::abs(dot(s.wi, normal)) / length(normal);
  if (!(cosine > 0)) return std::nullopt;
  s.pdf = set.choice.probability(i) * distance2 / (cosine * static_cast<float>(t.area));
  s.radiance = triangle_emission(t, b);
  // The rounding of p, where the ray begins, is carried along to its end.
  const float short_of = clearance(std::max(t.reach, max_component(abs(p))), e1, e2);
  s.end = point + face_toward(normal / length(normal), -to_point) * short_of;
  return s;
}

float Lights::triangle_pdf_area(uint32_t set_index, uint32_t triangle, Vec3 p) const {
  const TriangleSet& set = triangle_sets_[set_index];
  const double area = set.triangles[triangle].area;
  if (!(area > 0) || set.choice.empty()) return 0;
  return probability(set_entry_[set_index], p) * set.choice.probability(triangle) / static_cast<float>(area);
}

std::optional<DirectSample> Lights::sample_world(Vec2 u) const {
  DirectSample s;
  s.wi = sample_world_direction(u, s.pdf);
  s.distance = kInfinity;
  s.radiance = world_radiance(s.wi);
  return s;
}

std::optional<DirectSample> Lights::sample_direct(Vec3 p, const Sample4& u) const {
  if (none()) return std::nullopt;
  float fresh = u[2];
  const auto choice = choose(p, fresh);
  if (!choice) return std::nullopt;
  const Entry entry = entries_[choice->light];
  auto s = entry.kind == Kind::kLamp        ? sample_lamp(lamps_[entry.index], p, u.first())
           : entry.kind == Kind::kTriangles ? sample_triangles(triangle_sets_[entry.index], p, u.first(), fresh)
                                            : sample_world(u.first());
  if (!s || !(s->pdf > 0) || !std::isfinite(s->pdf) || is_black(s->radiance)) return std::nullopt;
  s->pdf *= choice->probability;
  if (entry.kind == Kind::kLamp) s->delta |= direct_only(lamps_[entry.index].flags);
  return s;
}

PhotonStart Lights::emit_from_infinity(Vec3 toward_light, Vec3 weight, const Targets* targets, Vec2 u, float target) const {
  if (targets) {
    const Targets::Line line = targets->sample_line(toward_light, u, target);
    const float height = radius_ + dot(center_ - line.point, toward_light);
    return {line.point + toward_light * height, -toward_light, weight / line.pdf_area};
  }
  const Vec2 d = sample_disk(u);
  const Frame frame(toward_light);
  const Vec3 origin = center_ + (frame.s * d.x + frame.t * d.y + toward_light) * radius_;
  return {origin, -toward_light, weight * (kPi * square(radius_))};
}

std::optional<PhotonStart> Lights::emit_lamp(const Lamp& lamp, const Targets* targets, const Sample4& u, float target) const {
  switch (lamp.type) {
    case SPPM_LIGHT_SUN: {
      const Vec3 toward =
          lamp.one_minus_cos == 0 ? -lamp.axis : Frame(-lamp.axis).to_world(sample_cone(u.second(), lamp.one_minus_cos));
      const float radiance_over_pdf = 2 / (2 - lamp.one_minus_cos);  // (1 / (pi sin^2)) (2 pi (1 - cos))
      const Vec3 weight = lamp.emission * (lamp.one_minus_cos == 0 ? 1 : radiance_over_pdf);
      return emit_from_infinity(normalize(toward), weight, targets, u.first(), target);
    }
    case SPPM_LIGHT_POINT:
    case SPPM_LIGHT_SPOT: {
      // A sphere that shines with I(omega) / (pi r^2) sends I(omega) through its disk across omega.
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
      const Vec3 weight = lamp.emission * spot_factor(lamp, dot(sample.direction, lamp.axis)) / sample.pdf_solid_angle;
      return PhotonStart{origin, sample.direction, weight};
    }
    default: {
      const Vec2 q = lamp.type == SPPM_LIGHT_ELLIPSE ? sample_disk(u.first()) : Vec2{2 * u[0] - 1, 2 * u[1] - 1};
      const Vec3 origin = lamp.position + lamp.x * q.x + lamp.y * q.y;
      const auto sample = sample_surface_direction(origin, lamp.axis, targets, u.second(), target);
      if (!sample) return std::nullopt;
      return PhotonStart{origin, sample->direction, lamp.emission * (sample->cos_over_pdf * static_cast<float>(lamp.area))};
    }
  }
}

std::optional<PhotonStart> Lights::emit_triangles(const TriangleSet& set, const Targets* targets, const Sample4& u,
                                                  const Sample4& v) const {
  float choice = v[1];
  const size_t i = set.choice.sample(choice);
  const EmissiveTriangle& t = set.triangles[i];
  const Vec2 b = sample_triangle(u.first());
  const Vec3 e1 = t.p[1] - t.p[0], e2 = t.p[2] - t.p[0], cross_product = cross(e1, e2);
  const float l = length(cross_product);
  if (!(l > 0)) return std::nullopt;
  const Vec3 normal = choice < 0.5f ? cross_product / l : -cross_product / l;
  const Vec3 origin = t.p[0] * (1 - b.x - b.y) + t.p[1] * b.x + t.p[2] * b.y + normal * clearance(t.reach, e1, e2);
  const auto sample = sample_surface_direction(origin, normal, targets, u.second(), v[2]);
  if (!sample) return std::nullopt;
  const float weight = 2 * sample->cos_over_pdf * static_cast<float>(t.area) / set.choice.probability(i);
  return PhotonStart{origin, sample->direction, triangle_emission(t, b) * weight};
}

std::optional<PhotonStart> Lights::emit_entry(Entry entry, const Targets* targets, const Sample4& u, const Sample4& v) const {
  switch (entry.kind) {
    case Kind::kLamp: return emit_lamp(lamps_[entry.index], targets, u, v[2]);
    case Kind::kTriangles: return emit_triangles(triangle_sets_[entry.index], targets, u, v);
    default: {
      float pdf = 0;
      const Vec3 toward = sample_world_direction(u.second(), pdf);
      if (!(pdf > 0)) return std::nullopt;
      return emit_from_infinity(toward, world_radiance(toward) / pdf, targets, u.first(), v[2]);
    }
  }
}

// Luminance of the power that leaves toward the targets, from few samples [W].
double Lights::aimed_power(Entry entry) const {
  constexpr uint64_t kSamples = 32, kStream = 0x61696d;
  double sum = 0;
  for (uint64_t i = 0; i < kSamples; ++i) {
    Sampler sampler(kStream, i);
    const Sample4 u = sampler.next(), v = sampler.next();
    if (const auto start = emit_entry(entry, &targets_, u, v)) sum += static_cast<double>(luminance(start->weight));
  }
  return sum / static_cast<double>(kSamples);
}

std::optional<PhotonStart> Lights::emit(const Distribution& lights, const Targets* targets, const Sample4& u, const Sample4& v) const {
  if (lights.empty()) return std::nullopt;
  float choice = v[0];
  const size_t i = lights.sample(choice);
  auto start = emit_entry(entries_[i], targets, u, v);
  if (!start || is_black(start->weight)) return std::nullopt;
  start->weight *= 1 / lights.probability(i);
  return start;
}

// ------------------------------------------------------------ environment

namespace {

Vec2 direction_to_map(Vec3 d) {
  return {0.5f - std::atan2(d.y, d.x) / (2 * kPi), 0.5f + std::atan2(d.z, std::sqrt(d.x * d.x + d.y * d.y)) / kPi};
}

Vec3 map_to_direction(Vec2 uv) {
  const float phi = (0.5f - uv.x) * 2 * kPi, theta = (uv.y - 0.5f) * kPi;
  return {std::cos(theta) * std::cos(phi), std::cos(theta) * std::sin(phi), std::sin(theta)};
}

}  // namespace

Vec3 Lights::world_radiance(Vec3 d) const {
  if (world_image_ == 0) return world_factor_;
  const auto& r = world_rotation_;
  const Vec3 turned{r[0] * d.x + r[1] * d.y + r[2] * d.z, r[3] * d.x + r[4] * d.y + r[5] * d.z, r[6] * d.x + r[7] * d.y + r[8] * d.z};
  const Image& image = textures_->image(world_image_);
  Vec2 uv = direction_to_map(turned);
  const float half_texel = 0.5f / static_cast<float>(image.height());
  uv.y = std::clamp(uv.y, half_texel, 1 - half_texel);  // around the sphere it repeats, from pole to pole it does not
  return world_factor_ * max(image.sample(uv, SPPM_LINEAR_FILTER, SPPM_REPEAT).color, {});
}

void Lights::build_world_distribution() {
  if (world_image_ == 0) {
    world_integral_ = 4 * M_PI * static_cast<double>(luminance(world_factor_));
    return;
  }
  const Image& image = textures_->image(world_image_);
  map_width_ = static_cast<int>(std::clamp<int64_t>(image.width(), 1, kLargestMap));
  map_height_ = static_cast<int>(std::clamp<int64_t>(image.height(), 1, kLargestMap / 2));
  std::vector<double> cells(static_cast<size_t>(map_width_ * map_height_), 0.0);
  double sum = 0;
  // Bilinear lookup spreads a texel over its neighbours, so each adds to the cells that its footprint meets.
  for (int64_t y = 0; y < image.height(); ++y) {
    for (int64_t x = 0; x < image.width(); ++x) {
      const double value = static_cast<double>(std::max(0.0f, luminance(world_factor_ * image.texel(x, y).color)));
      for (int dy = -1; dy <= 1; ++dy)
        for (int dx = -1; dx <= 1; ++dx) {
          const int64_t px = ((x + dx) % image.width() + image.width()) % image.width();
          const int64_t py = std::clamp<int64_t>(y + dy, 0, image.height() - 1);
          const int64_t cell = py * map_height_ / image.height() * map_width_ + px * map_width_ / image.width();
          cells[static_cast<size_t>(cell)] += value * (dx == 0 && dy == 0 ? 0.5 : 0.0625);
        }
    }
  }
  std::vector<double> rows;
  const double texels_per_cell = static_cast<double>(image.width() * image.height()) / (map_width_ * map_height_);
  for (int y = 0; y < map_height_; ++y) {
    const double solid = 2 * M_PI / map_width_ * (std::sin(M_PI * ((y + 1.0) / map_height_ - 0.5)) - std::sin(M_PI * (static_cast<double>(y) / map_height_ - 0.5)));
    std::span<double> row(cells.data() + y * map_width_, static_cast<size_t>(map_width_));
    for (double& c : row) c *= solid / texels_per_cell;
    map_columns_.emplace_back(row);
    rows.push_back(map_columns_.back().total());
    sum += rows.back();
  }
  map_rows_ = Distribution(rows);
  world_integral_ = sum;
}

Vec3 Lights::sample_world_direction(Vec2 u, float& pdf) const {
  if (world_image_ == 0) {
    pdf = 1 / (4 * kPi);
    return sample_sphere(u);
  }
  pdf = 0;
  if (map_rows_.empty()) return {0, 0, 1};
  float in_row = u.y, in_column = u.x;
  const size_t row = map_rows_.sample(in_row);
  const size_t column = map_columns_[row].sample(in_column);
  // Uniform over the cell's solid angle: uniform in sin(theta).
  const float h = static_cast<float>(map_height_);
  const float lo = std::sin(kPi * (static_cast<float>(row) / h - 0.5f)), hi = std::sin(kPi * (static_cast<float>(row + 1) / h - 0.5f));
  const float v = std::asin(std::clamp(lo + (hi - lo) * in_row, -1.0f, 1.0f)) / kPi + 0.5f;
  const Vec3 d = map_to_direction({(static_cast<float>(column) + in_column) / static_cast<float>(map_width_), v});
  const auto& r = world_rotation_;
  const Vec3 world{r[0] * d.x + r[3] * d.y + r[6] * d.z, r[1] * d.x + r[4] * d.y + r[7] * d.z, r[2] * d.x + r[5] * d.y + r[8] * d.z};
  const float cell_solid_angle = 2 * kPi / static_cast<float>(map_width_) * (hi - lo);
  pdf = map_rows_.probability(row) * map_columns_[row].probability(column) / cell_solid_angle;
  return world;
}

float Lights::world_direction_pdf(Vec3 d) const {
  if (world_image_ == 0) return 1 / (4 * kPi);
  if (map_rows_.empty()) return 0;
  const auto& r = world_rotation_;
  const Vec2 uv = direction_to_map(
      {r[0] * d.x + r[1] * d.y + r[2] * d.z, r[3] * d.x + r[4] * d.y + r[5] * d.z, r[6] * d.x + r[7] * d.y + r[8] * d.z});
  const auto row = static_cast<size_t>(std::clamp(static_cast<int>(uv.y * static_cast<float>(map_height_)), 0, map_height_ - 1));
  const auto column = static_cast<size_t>(std::clamp(static_cast<int>(uv.x * static_cast<float>(map_width_)), 0, map_width_ - 1));
  if (map_columns_[row].empty()) return 0;
  const float h = static_cast<float>(map_height_);
  const float lo = std::sin(kPi * (static_cast<float>(row) / h - 0.5f)), hi = std::sin(kPi * (static_cast<float>(row + 1) / h - 0.5f));
  return map_rows_.probability(row) * map_columns_[row].probability(column) * static_cast<float>(map_width_) / (2 * kPi * (hi - lo));
}

}  // namespace sppm
