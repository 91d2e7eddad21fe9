#include "data_passes.h"

#include <algorithm>
#include <cmath>

#include "color.h"
#include "pass_info.h"
#include "status.h"

namespace sppm {
namespace {

constexpr float kNothing = 1e10f;  // depth where nothing is

float mean(Vec3 color) { return (color.x + color.y + color.z) / 3; }

// Rougher than this a lobe shows its own features, smoother ones those of what they mirror: Cycles' limit.
constexpr float kSpecularAlpha = 0.075f;

}  // namespace

DataPasses::DataPasses(const SppmSettings& s)
    : alpha_threshold(s.alpha_threshold), mist_start_(s.mist_start), mist_depth_(s.mist_depth), mist_power_(s.mist_power) {
  require(s.alpha_threshold >= 0 && s.alpha_threshold <= 1, "settings: alpha_threshold must be 0 to 1");
  require(std::isfinite(s.mist_start) && std::isfinite(s.mist_depth) && s.mist_depth >= 0,
          "settings: mist_start must be finite, mist_depth finite and at least 0");
  require(std::isfinite(s.mist_power) && s.mist_power >= 0, "settings: mist_power must be finite and at least 0");
  for (const double x : s.origin) require(std::abs(x) < 1e30, "settings: origin must be within 1e30");
  std::copy(s.origin, s.origin + 3, origin_.begin());
  for (const PassSource source : {PassSource::kMiddle, PassSource::kSurfaces}) {
    for (uint32_t pass = 0; pass < SPPM_PASS_COUNT; ++pass) {
      if (kPasses[pass].source != source || !(s.passes >> pass & 1)) continue;
      place_[pass] = static_cast<int32_t>(size_);
      size_ += kPasses[pass].channel_count();
    }
    if (source == PassSource::kMiddle) middle_ = size_;
  }
}

void DataPasses::clear(float* record) const {
  std::fill(record, record + size_, 0.0f);
  if (float* depth = find(SPPM_PASS_DEPTH, record)) *depth = kNothing;
}

float DataPasses::shown(SppmPass pass, const float* record, uint32_t i) const {
  const float value = find(pass, record)[i];
  // Kept as what is clear of it, so that it needs no sum of what is behind.
  return pass == SPPM_PASS_MIST ? std::clamp(1 - value, 0.0f, 1.0f) : value;
}

float DataPasses::clearness(float distance) const {
  if (mist_depth_ == 0) return 1;
  return 1 - std::pow(std::clamp((distance - mist_start_) / mist_depth_, 0.0f, 1.0f), mist_power_);
}

void record_middle(const Scene& scene, const DataPasses& passes, float x, float y, float* record) {
  Ray ray = scene.camera.ray(x + 0.5f, y + 0.5f, {0.5f, 0.5f});
  for (int i = 0; i <= kMostPasses; ++i) {
    const auto s = scene.intersect(ray);
    if (!s) return;
    const Vec3 transparency = scene.transparency(*s);
    if (!scene.is_holdout(*s)) {
      if (float* depth = passes.find(SPPM_PASS_DEPTH, record)) *depth = scene.camera.depth(s->p);
      const auto place = passes.place_of(s->p);
      if (float* position = passes.find(SPPM_PASS_POSITION, record))
        for (const double coordinate : place) *position++ = static_cast<float>(coordinate);
      if (float* index = passes.find(SPPM_PASS_OBJECT_INDEX, record)) *index = static_cast<float>(scene.object_index(*s));
      if (float* index = passes.find(SPPM_PASS_MATERIAL_INDEX, record)) *index = static_cast<float>(scene.materials.index(s->material));
      if (1 - mean(transparency) >= passes.alpha_threshold) return;
    }
    if (is_black(transparency)) return;
    ray = s->spawn_at_border(-ray.direction, ray.direction);
    ray.kind = Ray::kCamera;
  }
}

void DataRecorder::see_surface(const SurfacePoint& s, const Bsdf& bsdf, Vec3 transparency, Vec3 wo, Vec3 throughput) {
  const Vec3 opacity = Vec3{1, 1, 1} - transparency;
  if (!surface_noted_ && mean(opacity) >= passes_.alpha_threshold) {
    surface_noted_ = true;
    add(SPPM_PASS_NORMAL, face_toward(s.ns, wo));
    if (scene_.has_uv(s)) add(SPPM_PASS_UV, {s.attributes.uv.x, s.attributes.uv.y, 1});
  }
  if (float* mist = passes_.find(SPPM_PASS_MIST, record_))
    *mist += passes_.clearness(scene_.camera.distance(s.p)) * mean(throughput * opacity);
  if (passes_.wants(SPPM_PASS_DIFFUSE_COLOR)) {
    Vec3 color;
    for (const Lobe& lobe : bsdf)
      if (lobe.diffuse()) color += albedo(lobe, bsdf.at, wo);
    add(SPPM_PASS_DIFFUSE_COLOR, color * throughput);
  }
}

// Denoisers want to know what is seen in a mirror, not that there is one: where three quarters of what a surface scatters go by specular
// lobes, the path goes on for its features.
void DataRecorder::follow_features(const Bsdf& bsdf, Vec3 transparency, Vec3 wo) {
  Vec3 rough, specular = transparency;
  for (const Lobe& lobe : bsdf) (lobe.diffuse() || lobe.alpha > kSpecularAlpha ? rough : specular) += albedo(lobe, bsdf.at, wo);
  const float share = luminance(rough + specular);
  if (share == 0 || luminance(rough) * 4 > share)
    note_features(rough, share > 0 ? face_toward(bsdf.at.frame.n, wo) : Vec3{});
  else
    feature_ *= specular;
}

void DataRecorder::stop_features(const Bsdf& bsdf, Vec3 wo) {
  if (!denoising_) return;
  Vec3 sum;
  for (const Lobe& lobe : bsdf) sum += albedo(lobe, bsdf.at, wo);
  note_features(sum, face_toward(bsdf.at.frame.n, wo));
}

void DataRecorder::note_features(Vec3 albedo, Vec3 normal) {
  denoising_ = false;
  add(SPPM_PASS_DENOISING_ALBEDO, feature_ * albedo);
  add(SPPM_PASS_DENOISING_NORMAL, scene_.camera.in_view(normal));
}

}  // namespace sppm
