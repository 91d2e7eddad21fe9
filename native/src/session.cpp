#include "session.h"

#include <chrono>

#include "status.h"

namespace sppm {
namespace {

using Clock = std::chrono::steady_clock;

// Adds the time until its end to `total`.
class Stopwatch {
 public:
  explicit Stopwatch(double& total) : total_(total), begin_(Clock::now()) {}
  ~Stopwatch() { total_ += std::chrono::duration<double>(Clock::now() - begin_).count(); }

 private:
  double& total_;
  Clock::time_point begin_;
};

const SppmSettings& checked(const SppmSettings& s) {
  require(s.iterations >= 1, "settings: iterations is 0, must be at least 1");
  require(s.photons_per_iteration <= uint64_t{1} << 31, "settings: photons_per_iteration must be at most 2^31");
  require(std::isfinite(s.initial_radius) && s.initial_radius >= 0 && s.initial_radius < 1e18,
          "settings: initial_radius must be finite and at least 0");
  require(s.max_depth >= 1 && s.max_depth <= 1024, "settings: max_depth must be 1 to 1024");
  require(s.pixel_filter <= SPPM_BOX, "settings: pixel_filter must be an SppmPixelFilter");
  require(std::isfinite(s.filter_width) && s.filter_width > 0 && s.filter_width <= 100, "settings: filter_width must be above 0 and at most 100");
  require(s.gamma > 0 && s.gamma < 1, "settings: gamma must be between 0 and 1");
  require(std::isfinite(s.time_limit) && s.time_limit >= 0, "settings: time_limit must be finite and at least 0");
  require(s.threads <= 4096, "settings: threads must be at most 4096");
  return s;
}

const char* kPassNames[SPPM_PASS_COUNT] = {"Combined", "Depth", "Normal", "Direct", "Indirect", "Caustics", "Radius", "Photons"};

}  // namespace

Session::Session(std::shared_ptr<const Scene> scene, const SppmSettings& settings)
    : scene_(std::move(scene)),
      settings_(checked(settings)),
      snapshot_path_(settings.snapshot_path ? settings.snapshot_path : ""),
      path_{settings.seed, settings.max_depth, static_cast<float>(settings.filter_width), settings.pixel_filter == SPPM_BOX,
            settings.transparent_film != 0},
      photons_per_iteration_(settings.photons_per_iteration > 0 ? settings.photons_per_iteration
                                                                : scene_->camera.region_width * scene_->camera.region_height),
      threads_(settings.threads),
      film_(scene_->camera.region_width * scene_->camera.region_height, settings.passes) {
  settings_.snapshot_path = nullptr;  // the caller's memory
  progress_.struct_size = sizeof progress_;
}

void Session::check_cancelled(bool completed) {
  if (completed) return;
  cancel_ = false;
  throw Error(SPPM_CANCELLED, "the iteration was cancelled");
}

void Session::step() {
  RayCounts counts;
  SppmProgress times{};
  {
    const Stopwatch all(times.seconds);
    {
      const Stopwatch watch(times.seconds_camera);
      check_cancelled(run_camera_pass(*scene_, path_, iteration_, threads_, cancel_, samples_, counts));
      film_.start_radii(scene_->camera, samples_, settings_.initial_radius, threads_);
    }
    {
      const Stopwatch watch(times.seconds_grid);
      film_.announce(samples_, maps_, threads_);
    }
    {
      const Stopwatch watch(times.seconds_photons);
      check_cancelled(run_photon_pass(*scene_, path_, emitted(), photons_per_iteration_, threads_, cancel_, maps_, blocks_, counts));
    }
    {
      const Stopwatch watch(times.seconds_grid);
      for (size_t kind = 0; kind < kPhotonKinds; ++kind) maps_[kind].build(blocks_[kind], threads_);
    }
    {
      const Stopwatch watch(times.seconds_gather);
      counts.dropped += film_.gather(samples_, maps_, scene_->camera.region_width, threads_, found_);
    }
    {
      const Stopwatch watch(times.seconds_update);
      film_.update(samples_, found_, settings_.gamma, threads_);
    }
  }
  ++iteration_;
  {
    const std::lock_guard lock(progress_mutex_);
    progress_.iteration = iteration_;
    progress_.photons_emitted = emitted();
    for (const PhotonMap& map : maps_) progress_.photons_stored += map.stored();
    progress_.rays_camera += counts.camera, progress_.rays_shadow += counts.shadow, progress_.rays_photon += counts.photon;
    progress_.dropped_samples += counts.dropped;
    progress_.seconds += times.seconds;
    progress_.seconds_camera += times.seconds_camera, progress_.seconds_photons += times.seconds_photons;
    progress_.seconds_grid += times.seconds_grid, progress_.seconds_gather += times.seconds_gather;
    progress_.seconds_update += times.seconds_update;
    progress_.memory_bytes = memory();
    progress_.finished = iteration_ >= settings_.iterations || (settings_.time_limit > 0 && progress_.seconds >= settings_.time_limit);
  }
  if (!snapshot_path_.empty() && settings_.write_interval > 0 && iteration_ % settings_.write_interval == 0) write_exr(snapshot_path_);
}

uint64_t Session::memory() const {
  uint64_t bytes = film_.memory() + samples_.memory() + found_.capacity() * sizeof(Film::Found);
  for (const PhotonMap& map : maps_) bytes += map.memory();
  for (const auto& kind : blocks_)
    for (const PhotonMap::Block& b : kind)
      bytes += b.photons.capacity() * sizeof(Photon) + b.keys.capacity() * sizeof(CellKey) + b.owners.capacity() * 4;
  return bytes;
}

SppmProgress Session::progress() const {
  const std::lock_guard lock(progress_mutex_);
  return progress_;
}

void Session::read_pass(SppmPass pass, float* out, uint64_t count) const {
  const uint64_t needed = scene_->camera.region_width * scene_->camera.region_height * Film::channels(pass);
  require(count == needed, "count is " + std::to_string(count) + ", must be " + std::to_string(needed));
  require(pass == SPPM_PASS_COMBINED || settings_.passes >> pass & 1,
          std::string("pass ") + kPassNames[pass] + " was not requested in the settings");
  film_.read(pass, iteration_, emitted(), out);
}

void Session::write_exr(const std::string& path) const {
  const uint64_t width = scene_->camera.region_width, height = scene_->camera.region_height;
  std::vector<std::vector<float>> buffers;
  std::vector<ExrChannel> channels;
  buffers.reserve(SPPM_PASS_COUNT);
  for (int i = 0; i < SPPM_PASS_COUNT; ++i) {
    const auto pass = static_cast<SppmPass>(i);
    if (pass != SPPM_PASS_COMBINED && !(settings_.passes >> i & 1)) continue;
    const uint32_t n = Film::channels(pass);
    buffers.emplace_back(width * height * n);
    film_.read(pass, iteration_, emitted(), buffers.back().data());
    const std::string letters = n == 1 ? (pass == SPPM_PASS_DEPTH ? "Z" : "V") : pass == SPPM_PASS_NORMAL ? "XYZ" : "RGBA";
    for (uint32_t c = 0; c < n; ++c) {
      const std::string prefix = pass == SPPM_PASS_COMBINED ? "" : std::string(kPassNames[i]) + ".";
      channels.push_back({prefix + letters[c], buffers.back().data() + c, n});
    }
  }
  const SppmProgress p = progress();
  sppm::write_exr(path, static_cast<int64_t>(width), static_cast<int64_t>(height), channels,
                  {{"sppm:iterations", std::to_string(p.iteration)},
                   {"sppm:photons", std::to_string(p.photons_emitted)},
                   {"sppm:seconds", std::to_string(p.seconds)},
                   {"sppm:seed", std::to_string(settings_.seed)},
                   {"sppm:gamma", std::to_string(settings_.gamma)},
                   {"sppm:max_depth", std::to_string(settings_.max_depth)},
                   {"sppm:initial_radius", std::to_string(settings_.initial_radius)},
                   {"sppm:dropped_samples", std::to_string(p.dropped_samples)}});
}

}  // namespace sppm
