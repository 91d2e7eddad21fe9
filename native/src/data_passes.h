// Passes that show data of the surfaces that a camera path meets, in place of its light. A pixel's record holds the floats of those that
// were asked for and nothing else.
#pragma once

#include <array>
#include <cstdint>

#include "scene.h"
#include "sppm/sppm.h"

namespace sppm {

// Which data passes there are, where they stand in a record, and what they are made with.
class DataPasses {
 public:
  DataPasses() = default;
  explicit DataPasses(const SppmSettings& settings);  // throws Error

  uint32_t size() const { return size_; }      // floats of a record
  uint32_t middle() const { return middle_; }  // of them, at its beginning, those that are found once
  bool any_averaged() const { return size_ > middle_; }
  bool wants(SppmPass pass) const { return place_[pass] >= 0; }
  // The pass's first float in a record, null if nobody asked for it.
  template <typename Float>
  Float* find(SppmPass pass, Float* record) const {
    return wants(pass) ? record + place_[pass] : nullptr;
  }
  // What a record holds where nothing is seen.
  void clear(float* record) const;
  // What the passes show of a record: float number `i` of `pass`.
  float shown(SppmPass pass, const float* record, uint32_t i) const;

  float alpha_threshold = 0;
  // 1 for a surface within the start of the mist, 0 for one that it hides.
  float clearness(float distance) const;
  // In the caller's frame.
  std::array<double, 3> place_of(Vec3 p) const { return {origin_[0] + p.x, origin_[1] + p.y, origin_[2] + p.z}; }

 private:
  std::array<int32_t, SPPM_PASS_COUNT> place_ = [] {
    std::array<int32_t, SPPM_PASS_COUNT> none;
    none.fill(-1);
    return none;
  }();
  uint32_t size_ = 0, middle_ = 0;
  float mist_start_ = 0, mist_depth_ = 0, mist_power_ = 1;
  std::array<double, 3> origin_{};
};

// Writes those that are found once: one ray through the middle of pixel x, y, to the first surface that is opaque enough, else the last.
void record_middle(const Scene& scene, const DataPasses& passes, float x, float y, float* record);

// Collects the others along one camera path.
class DataRecorder {
 public:
  // `record` has been cleared; null where nothing shall be recorded.
  DataRecorder(const DataPasses& passes, const Scene& scene, float* record)
      : passes_(passes), scene_(scene), record_(record),
        denoising_(record && (passes.wants(SPPM_PASS_DENOISING_ALBEDO) || passes.wants(SPPM_PASS_DENOISING_NORMAL))) {}

  // Whether light of the environment that the camera sees is asked for, whatever the picture shows of it.
  bool shows_environment() const { return record_ && (denoising_ || passes_.wants(SPPM_PASS_ENVIRONMENT)); }
  // Light that the path meets, times its throughput; `pass` is where it shows if the camera sees it, directly or through what is
  // transparent.
  void meet_light(Vec3 value, SppmPass pass, bool seen) {
    if (!record_) return;
    if (seen) add(pass, value);
    // As Cycles has it: what the surfaces before have tinted is tinted again.
    if (denoising_) add(SPPM_PASS_DENOISING_ALBEDO, value * feature_);
  }
  // A surface before the path has made its choice there; `throughput` is that of the path, up to it.
  void meet_surface(const SurfacePoint& s, const Bsdf& bsdf, Vec3 transparency, Vec3 wo, Vec3 throughput, bool seen) {
    if (!record_) return;
    if (seen) see_surface(s, bsdf, transparency, wo, throughput);
    if (denoising_) follow_features(bsdf, transparency, wo);
  }
  // The path waits for photons here and goes no further for the features.
  void stop_features(const Bsdf& bsdf, Vec3 wo);

 private:
  void add(SppmPass pass, Vec3 value) {
    if (float* at = passes_.find(pass, record_)) at[0] += value.x, at[1] += value.y, at[2] += value.z;
  }
  void see_surface(const SurfacePoint& s, const Bsdf& bsdf, Vec3 transparency, Vec3 wo, Vec3 throughput);
  void follow_features(const Bsdf& bsdf, Vec3 transparency, Vec3 wo);
  void note_features(Vec3 albedo, Vec3 normal);

  const DataPasses& passes_;
  const Scene& scene_;
  float* record_;
  bool surface_noted_ = false;
  bool denoising_;          // features are still looked for
  Vec3 feature_{1, 1, 1};   // tints of the specular surfaces so far
};

}  // namespace sppm
