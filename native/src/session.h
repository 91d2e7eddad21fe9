// A render: settings, the state of every pixel, and the iteration that improves it.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <vector>

#include "film.h"
#include "scene.h"

namespace sppm {

class Session {
 public:
  Session(std::shared_ptr<Scene> scene, const SppmSettings& settings);  // throws Error

  // One iteration; throws Error(SPPM_CANCELLED) and leaves all sums alone if cancelled.
  void step();
  void cancel() { cancel_ = true; }
  SppmProgress progress() const;
  void read_pass(SppmPass pass, float* out, uint64_t count) const;
  void write_exr(const std::string& path) const;

 private:
  void check_cancelled(bool completed);
  void iterate(SppmProgress& done);
  std::vector<PhotonBatch> plan_batches() const;
  void plan_budget(const RayCounts& camera, std::span<const PhotonBatch> batches, std::span<const RayCounts> photons);
  PhotonRules rules(std::span<const PhotonBatch> batches) const;
  void decide_indirect(SppmProgress& done);
  void start_budget();
  void timed(const std::function<void(SppmProgress&)>& part);
  void check_camera() const;
  uint64_t pixels() const { return size_[0] * size_[1]; }
  uint64_t memory() const;

  std::shared_ptr<Scene> scene_;  // of which nothing but the time changes here
  std::array<uint64_t, 2> size_;  // width, height of the region [pixels]
  SppmSettings settings_;
  std::string snapshot_path_;
  PathSettings path_;
  SppmIndirect indirect_;
  std::array<uint64_t, 3> budget_{};   // paths an iteration of each Emission
  std::array<uint64_t, 3> emitted_{};  // and so far
  double shrink_ = 1;                  // see RadiusRule
  Threads threads_;
  Film film_;

  CameraSamples samples_;
  PhotonMaps maps_;
  PhotonBlocks blocks_;

  uint64_t iteration_ = 0;
  std::atomic<bool> cancel_{false};
  mutable std::mutex progress_mutex_;
  SppmProgress progress_{};
};

}  // namespace sppm
