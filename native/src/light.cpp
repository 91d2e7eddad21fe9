#include "light.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "color.h"
#include "status.h"

namespace sppm {
namespace {

// A strong light may be hidden where a weak one is all there is: this share of the choices takes all lights alike.
constexpr float kAlike = 0.25f;

// In proportion to `weights` but for kAlike, which those above 0 share alike.
Distribution defensive_mixture(const std::vector<double>& weights) {
  const double total = std::accumulate(weights.begin(), weights.end(), 0.0);
  const auto lit = static_cast<double>(std::count_if(weights.begin(), weights.end(), [](double w) { return w > 0; }));
  constexpr auto kShare = static_cast<double>(kAlike);
  std::vector<double> mix;
  for (const double w : weights) mix.push_back(w > 0 ? (1 - kShare) * w / total + kShare / lit : 0);
  return Distribution(mix);
}

}  // namespace

// ------------------------------------------------------------ the list of lights

uint32_t Lights::add_lamp(const SppmLightDesc& desc) {
  lamps_.emplace_back(desc);
  return static_cast<uint32_t>(lamps_.size());
}

void Lights::set_world(const SppmWorldDesc& desc) {
  Environment world(desc, textures_);
  world_.reset();
  if (world.integral() > 0) world_ = std::move(world);
}

uint32_t Lights::add_triangles(std::vector<EmissiveTriangle> triangles) {
  meshes_.emplace_back(std::move(triangles), materials_);
  return static_cast<uint32_t>(meshes_.size() - 1);
}

void Lights::set_triangles(uint32_t light, std::vector<EmissiveTriangle> triangles) {
  meshes_[light] = EmissiveMesh(std::move(triangles), materials_);
}

void Lights::commit(const Bounds& bounds, Targets targets) {
  targets_ = std::move(targets);
  center_ = bounds.empty() ? Vec3{} : bounds.center();
  radius_ = bounds.radius() * 1.001f;
  const std::vector<double> powers = build_entries();
  build_lamp_boxes();
  power_ = std::accumulate(powers.begin(), powers.end(), 0.0);
  by_power_ = defensive_mixture(powers);
  lit_entries_.clear();
  for (uint32_t i = 0; i < entries_.size(); ++i)
    if (powers[i] > 0) lit_entries_.push_back(i);
  by_aimed_power_ = {};
  if (!targets_.empty()) {
    std::vector<double> aimed;
    // An estimate from few samples may miss what a light does to a target: none that shines is left out.
    for (size_t i = 0; i < entries_.size(); ++i)
      aimed.push_back(powers[i] > 0 ? std::max(aimed_power(entries_[i]), std::numeric_limits<double>::min()) : 0.0);
    by_aimed_power_ = defensive_mixture(aimed);
  }
  build_choice();
  met_ = world_ || !suns_.empty() || !sized_lamps_.empty();
  for (const EmissiveMesh& mesh : meshes_) met_ |= !mesh.dark();
}

std::vector<double> Lights::build_entries() {
  entries_.clear(), lamp_entry_.clear(), mesh_entry_.clear();
  sized_lamps_.clear(), suns_.clear();
  small_ = without_size_ = false;
  std::vector<double> powers;
  const auto add = [&](Kind kind, uint32_t index, double power) {
    entries_.push_back({kind, index});
    powers.push_back(power);
    return static_cast<uint32_t>(entries_.size() - 1);
  };
  for (uint32_t i = 0; i < lamps_.size(); ++i) {
    const Lamp& lamp = lamps_[i];
    const double power = lamp.power(radius_);
    lamp_entry_.push_back(add(Kind::kLamp, i, power));
    small_ |= power > 0 && lamp.small_in(radius_);
    without_size_ |= power > 0 && !lamp.sized();
    if (power > 0 && lamp.sized() && !(lamp.flags & SPPM_LIGHT_HIDDEN_FROM_SPECULAR)) (lamp.sun() ? suns_ : sized_lamps_).push_back(i);
  }
  for (uint32_t i = 0; i < meshes_.size(); ++i) mesh_entry_.push_back(add(Kind::kMesh, i, meshes_[i].power()));
  if (world_) world_entry_ = add(Kind::kWorld, 0, M_PI * static_cast<double>(square(radius_)) * world_->integral());
  return powers;
}

void Lights::build_lamp_boxes() {
  std::vector<Bounds> boxes;
  for (const uint32_t i : sized_lamps_) boxes.push_back(lamps_[i].box());
  lamp_boxes_.build(boxes);
}

// ------------------------------------------------------------ the choice of one

void Lights::build_choice() {
  std::vector<LightBounds> near(entries_.size());
  std::vector<double> far;
  far_entries_.clear();
  for (uint32_t i = 0; i < entries_.size(); ++i) {
    const Entry& entry = entries_[i];
    double irradiance = 0;
    if (entry.kind == Kind::kLamp) {
      const Lamp& lamp = lamps_[entry.index];
      near[i] = lamp.bounds();
      if (lamp.sun()) irradiance = static_cast<double>(luminance(lamp.emission));
    } else if (entry.kind == Kind::kMesh) {
      near[i] = meshes_[entry.index].bounds();
    } else {
      irradiance = world_->integral() / 4;  // of a hemisphere of the mean radiance
    }
    if (irradiance <= 0) continue;
    far_entries_.push_back(i);
    far.push_back(irradiance);
  }
  near_.build(near);
  far_ = Distribution(far);
}

std::optional<LightTree::Choice> Lights::choose(Vec3 p, float& u) const {
  if (lit_entries_.size() == 1) return LightTree::Choice{lit_entries_[0], 1};
  const auto rest = [&u](float below, float share) { u = std::min((u - below) / share, 0x1.fffffep-1f); };
  const auto alike = [&] {
    rest(0, kAlike);
    const float scaled = u * static_cast<float>(lit_entries_.size());
    const size_t i = std::min(static_cast<size_t>(scaled), lit_entries_.size() - 1);
    u = std::min(scaled - static_cast<float>(i), 0x1.fffffep-1f);
    return lit_entries_[i];
  };
  const auto by_irradiance = [&]() -> std::optional<uint32_t> {
    rest(kAlike, 1 - kAlike);
    const float near = near_share(p);
    if (u < near) {
      rest(0, near);
      const auto choice = near_.sample(p, u);
      return choice ? std::optional(choice->light) : std::nullopt;
    }
    rest(near, 1 - near);
    return far_.empty() ? std::nullopt : std::optional(far_entries_[far_.sample(u)]);
  };
  const std::optional<uint32_t> entry = u < kAlike ? alike() : by_irradiance();
  if (!entry) return std::nullopt;
  return LightTree::Choice{*entry, probability(*entry, p)};
}

float Lights::near_share(Vec3 p) const {
  const float near = near_.irradiance(p), total = near + static_cast<float>(far_.total());
  return total > 0 ? near / total : 0;
}

float Lights::probability(uint32_t entry, Vec3 p) const {
  if (lit_entries_.size() == 1) return 1;
  const float alike = kAlike / static_cast<float>(lit_entries_.size()), near = near_share(p);
  for (size_t i = 0; i < far_entries_.size(); ++i)
    if (far_entries_[i] == entry) return alike + (1 - kAlike) * (1 - near) * far_.probability(i);
  return alike + (1 - kAlike) * near * near_.probability(entry, p);
}

// ------------------------------------------------------------ toward a point, along a ray

std::optional<DirectSample> Lights::sample_direct(Vec3 p, const Sample4& u) const {
  if (none()) return std::nullopt;
  float fresh = u[2];
  const auto choice = choose(p, fresh);
  if (!choice) return std::nullopt;
  const Entry entry = entries_[choice->light];
  auto s = entry.kind == Kind::kLamp   ? lamps_[entry.index].sample_direct(p, u.first())
           : entry.kind == Kind::kMesh ? meshes_[entry.index].sample_direct(p, u.first(), fresh)
                                       : std::optional(world_->sample_direct(u.first()));
  if (!s || !(s->pdf > 0) || !std::isfinite(s->pdf) || is_black(s->radiance)) return std::nullopt;
  s->pdf *= choice->probability;
  if (entry.kind == Kind::kLamp) s->delta |= lamps_[entry.index].direct_only();
  return s;
}

std::optional<EmittedLight> Lights::lamp_along(uint32_t i, Vec3 origin, Vec3 direction, float near, float far) const {
  const Lamp& lamp = lamps_[i];
  const auto distance = lamp.distance_along(origin, direction, near, far);
  if (!distance) return std::nullopt;
  // Infinite where direct light takes all: the weight of a rough surface's ray is then 0.
  const float choice = lamp.direct_only() ? kInfinity : probability(lamp_entry_[i], origin);
  EmittedLight light = lamp.emitted(origin, direction, *distance, choice);
  light.distance = *distance;
  return light;
}

float Lights::triangle_pdf_area(uint32_t light, uint32_t triangle, Vec3 p) const {
  const EmissiveMesh& mesh = meshes_[light];
  if (!(mesh.triangles[triangle].area > 0) || mesh.dark()) return 0;
  return mesh.pdf_area(triangle, probability(mesh_entry_[light], p));
}

// ------------------------------------------------------------ outward

std::optional<PhotonStart> Lights::emit_entry(Entry entry, const Targets* targets, const Sample4& u, const Sample4& v) const {
  const PhotonAim aim{targets, center_, radius_};
  switch (entry.kind) {
    case Kind::kLamp: return sppm::emit(lamps_[entry.index], aim, u, v[2]);
    case Kind::kMesh: return sppm::emit(meshes_[entry.index], aim, u, v);
    default: return sppm::emit(*world_, aim, u, v[2]);
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

}  // namespace sppm
