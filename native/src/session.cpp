#include "session.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <span>
#include <utility>
#include <vector>

#include "pass_info.h"
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
  require(std::isfinite(s.filter_width) && s.filter_width > 0 && s.filter_width <= 100,
          "settings: filter_width must be above 0 and at most 100");
  require(s.gamma > 0 && s.gamma < 1, "settings: gamma must be between 0 and 1");
  require(std::isfinite(s.time_limit) && s.time_limit >= 0, "settings: time_limit must be finite and at least 0");
  require(s.threads <= 4096, "settings: threads must be at most 4096");
  require(s.indirect <= SPPM_INDIRECT_AUTO, "settings: indirect must be an SppmIndirect");
  require(s.radius_rule <= SPPM_RADIUS_PASS_INDEXED, "settings: radius_rule must be an SppmRadiusRule");
  return s;
}

// Photons and camera paths should take about the same time, but caustic photons never more than this share of it: it is taken from other
// light, and caustics gain from more camera samples too. Beyond these shares of the pixels neither helps the other.
constexpr double kCausticRays = 0.5, kFewestPhotons = 1.0 / 16, kMostPhotons = 16;

// AUTO: photons serve where most pixels find this many of them in their first disk.
constexpr double kEnoughPhotons = 3, kEnoughPixels = 0.6;

// Another session's step may set the camera of a scene that moves.
std::array<uint64_t, 2> size_of(Scene& scene) {
  std::unique_lock<std::mutex> turn;
  if (scene.moves()) turn = std::unique_lock(scene.turn);
  return {scene.camera.region_width, scene.camera.region_height};
}

const char* kIndirectNames[] = {"PHOTONS", "PATHS", "AUTO"};
const char* kRadiusRuleNames[] = {"PROGRESSIVE", "DENSITY", "PASS_INDEXED"};

}  // namespace

Session::Session(std::shared_ptr<Scene> scene, const SppmSettings& settings)
    : scene_(std::move(scene)),
      size_(size_of(*scene_)),
      settings_(checked(settings)),
      snapshot_path_(settings.snapshot_path ? settings.snapshot_path : ""),
      path_{settings.seed, settings.max_depth, static_cast<float>(settings.filter_width), settings.pixel_filter == SPPM_BOX,
            settings.transparent_film != 0, false, false, DataPasses(settings)},
      indirect_(static_cast<SppmIndirect>(settings.indirect)),
      threads_(settings.threads),
      film_(pixels(), path_.data) {
  settings_.snapshot_path = nullptr;  // the caller's memory
  progress_.struct_size = sizeof progress_;
  progress_.indirect = settings_.indirect;
  path_.trace_indirect = indirect_ == SPPM_INDIRECT_PATHS;
  start_budget();
}

void Session::start_budget() { budget_.fill(settings_.photons_per_iteration > 0 ? settings_.photons_per_iteration : pixels()); }

void Session::check_cancelled(bool completed) {
  if (completed) return;
  cancel_ = false;
  throw Error(SPPM_CANCELLED, "the iteration was cancelled");
}

// What must be sent so that each path is counted once.
std::vector<PhotonBatch> Session::plan_batches() const {
  std::vector<PhotonBatch> batches;
  const auto add = [&](Emission emission, bool aimed) {
    const auto e = static_cast<size_t>(emission);
    batches.push_back({emission, aimed, emitted_[e], budget_[e]});
  };
  if (scene_->lights.none()) return batches;
  const bool aim = settings_.aim_photons != 0;
  if (!path_.trace_indirect && !aim) {
    add(Emission::kAll, false);
    return batches;
  }
  if (scene_->lights.can_aim()) add(Emission::kSpecular, aim);
  if (!path_.trace_indirect) add(Emission::kRest, false);
  if (settings_.photons_per_iteration > 0)
    for (PhotonBatch& batch : batches) batch.count = std::max<uint64_t>(1, batch.count / batches.size());
  return batches;
}

// After the first iteration: photons for about as many rays as camera paths take, caustic photons for half as many. Counted, not timed, so
// that pictures do not depend on the clock.
void Session::plan_budget(const RayCounts& camera, std::span<const PhotonBatch> batches, std::span<const RayCounts> photons) {
  if (settings_.photons_per_iteration > 0) return;
  const auto all = static_cast<double>(pixels());
  for (size_t b = 0; b < batches.size(); ++b) {
    const double per_path = std::max(1.0, static_cast<double>(photons[b].photon) / static_cast<double>(batches[b].count));
    const double share = batches[b].emission == Emission::kSpecular ? kCausticRays : 1 / static_cast<double>(batches.size());
    const double rays = share * static_cast<double>(camera.camera + camera.shadow);
    const double wanted = std::clamp(rays / per_path, kFewestPhotons * all, kMostPhotons * all);
    budget_[static_cast<size_t>(batches[b].emission)] = std::max<uint64_t>(1, static_cast<uint64_t>(wanted));
  }
}

void Session::iterate(SppmProgress& done) {
  if (scene_->moves()) scene_->set_time(pass_time(settings_.seed, iteration_), threads_);
  const std::vector<PhotonBatch> batches = plan_batches();
  path_.ask_at_glossy = scene_->lights.any_small() && std::ranges::any_of(batches, [](const PhotonBatch& b) {
    return b.emission == Emission::kSpecular;
  });
  // Where something moves a pixel's points of other times lie elsewhere.
  const bool knows_surfaces = settings_.radius_rule == SPPM_RADIUS_DENSITY && !scene_->moves() && !batches.empty();
  RayCounts camera;
  {
    const Stopwatch watch(done.seconds_camera);
    check_cancelled(run_camera_pass(*scene_, path_, iteration_, threads_, cancel_, samples_, camera));
    film_.start_radii(scene_->camera, samples_, settings_.initial_radius, threads_);
    if (knows_surfaces) film_.find_surfaces(scene_->camera, samples_, threads_);
  }
  std::vector<RayCounts> counts(batches.size());
  if (!batches.empty()) {
    {
      const Stopwatch watch(done.seconds_grid);
      film_.announce(samples_, maps_, rules(batches), threads_);
    }
    {
      const Stopwatch watch(done.seconds_photons);
      check_cancelled(run_photon_pass(*scene_, path_, batches, threads_, cancel_, maps_, blocks_, counts));
    }
    const Stopwatch watch(done.seconds_grid);
    for (size_t kind = 0; kind < kPhotonKinds; ++kind) maps_[kind].build(blocks_[kind], threads_);
  }
  const Stopwatch watch(done.seconds_gather);
  shrink_ *= RadiusRule::step(iteration_ + 1, settings_.gamma);
  done.dropped_samples += film_.update(scene_->camera, samples_, maps_, rules(batches), threads_);
  if (knows_surfaces) film_.learn_surfaces(scene_->camera, samples_, threads_);
  if (iteration_ == 0) plan_budget(camera, batches, counts);
  ++iteration_;
  for (const PhotonBatch& b : batches) emitted_[static_cast<size_t>(b.emission)] += b.count, done.photons_emitted += b.count;
  if (!batches.empty())
    for (const PhotonMap& map : maps_) done.photons_stored += map.stored();
  for (const RayCounts& c : counts) camera += c;
  done.rays_camera += camera.camera, done.rays_shadow += camera.shadow, done.rays_photon += camera.photon;
  done.dropped_samples += camera.dropped;
}

PhotonRules Session::rules(std::span<const PhotonBatch> batches) const {
  PhotonRules rules;
  for (RadiusRule& radius : rules) {
    radius.rule = static_cast<SppmRadiusRule>(settings_.radius_rule);
    radius.gamma = settings_.gamma;
    radius.shrink = shrink_;
    radius.pixels = pixels();
  }
  for (const PhotonBatch& b : batches) {
    if (b.emission != Emission::kRest) rules[kCaustic].paths += b.count, rules[kCaustic].paths_before += b.first;
    rules[kIndirect].paths += b.count, rules[kIndirect].paths_before += b.first;
  }
  return rules;
}

// An AUTO session that has too few photons for its pixels begins again with paths.
void Session::decide_indirect(SppmProgress& done) {
  const double counted = settings_.radius_rule == SPPM_RADIUS_PROGRESSIVE ? settings_.gamma : 1;  // of a photon
  indirect_ = film_.share_with(kIndirect, kEnoughPhotons * counted) >= kEnoughPixels ? SPPM_INDIRECT_PHOTONS : SPPM_INDIRECT_PATHS;
  if (indirect_ == SPPM_INDIRECT_PHOTONS) return;
  film_.clear();
  iteration_ = 0, shrink_ = 1;
  emitted_.fill(0);
  start_budget();
  done.photons_emitted = done.photons_stored = done.dropped_samples = 0;
  path_.trace_indirect = true;
}

void Session::check_camera() const {
  if (scene_->camera.region_width != size_[0] || scene_->camera.region_height != size_[1])
    throw Error(SPPM_INVALID_STATE, "the camera's picture has another size than when the session began");
}

void Session::step() {
  std::unique_lock<std::mutex> turn;
  if (scene_->moves()) turn = std::unique_lock(scene_->turn);
  check_camera();
  const bool undecided = indirect_ == SPPM_INDIRECT_AUTO;
  timed([&](SppmProgress& done) {
    iterate(done);
    if (undecided) decide_indirect(done);
  });
  if (undecided && path_.trace_indirect) timed([&](SppmProgress& done) { iterate(done); });
  if (!snapshot_path_.empty() && settings_.write_interval > 0 && iteration_ % settings_.write_interval == 0) write_exr(snapshot_path_);
}

// Runs a part of a step and adds what it has done to the progress.
void Session::timed(const std::function<void(SppmProgress&)>& part) {
  SppmProgress done{};
  {
    const Stopwatch all(done.seconds);
    part(done);
  }
  const std::lock_guard lock(progress_mutex_);
  progress_.iteration = iteration_;
  progress_.photons_emitted += done.photons_emitted, progress_.photons_stored += done.photons_stored;
  progress_.rays_camera += done.rays_camera, progress_.rays_shadow += done.rays_shadow, progress_.rays_photon += done.rays_photon;
  progress_.dropped_samples += done.dropped_samples;
  progress_.seconds += done.seconds;
  progress_.seconds_camera += done.seconds_camera, progress_.seconds_photons += done.seconds_photons;
  progress_.seconds_grid += done.seconds_grid, progress_.seconds_gather += done.seconds_gather;
  progress_.memory_bytes = memory();
  progress_.indirect = indirect_;
  progress_.finished = iteration_ >= settings_.iterations || (settings_.time_limit > 0 && progress_.seconds >= settings_.time_limit);
}

uint64_t Session::memory() const {
  uint64_t bytes = film_.memory() + samples_.memory();
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
  const uint64_t needed = pixels() * kPasses[pass].channel_count();
  require(count == needed, "count is " + std::to_string(count) + ", must be " + std::to_string(needed));
  require(pass == SPPM_PASS_COMBINED || settings_.passes >> pass & 1,
          std::string("pass ") + kPasses[pass].name + " was not requested in the settings");
  film_.read(pass, out);
}

void Session::write_exr(const std::string& path) const {
  std::vector<std::vector<float>> buffers;
  std::vector<ExrChannel> channels;
  buffers.reserve(SPPM_PASS_COUNT);
  for (int i = 0; i < SPPM_PASS_COUNT; ++i) {
    const auto pass = static_cast<SppmPass>(i);
    if (pass != SPPM_PASS_COMBINED && !(settings_.passes >> i & 1)) continue;
    const PassInfo& info = kPasses[pass];
    const uint32_t n = info.channel_count();
    buffers.emplace_back(pixels() * n);
    film_.read(pass, buffers.back().data());
    const std::string prefix = pass == SPPM_PASS_COMBINED ? "" : std::string(info.name) + ".";
    for (uint32_t c = 0; c < n; ++c) channels.push_back({prefix + info.channels[c], buffers.back().data() + c, n});
  }
  const SppmProgress p = progress();
  sppm::write_exr(path, static_cast<int64_t>(size_[0]), static_cast<int64_t>(size_[1]), channels,
                  {{"sppm:iterations", std::to_string(p.iteration)},
                   {"sppm:photons", std::to_string(p.photons_emitted)},
                   {"sppm:seconds", std::to_string(p.seconds)},
                   {"sppm:seed", std::to_string(settings_.seed)},
                   {"sppm:gamma", std::to_string(settings_.gamma)},
                   {"sppm:radius_rule", kRadiusRuleNames[settings_.radius_rule]},
                   {"sppm:indirect", kIndirectNames[p.indirect]},
                   {"sppm:aim_photons", settings_.aim_photons ? "1" : "0"},
                   {"sppm:max_depth", std::to_string(settings_.max_depth)},
                   {"sppm:initial_radius", std::to_string(settings_.initial_radius)},
                   {"sppm:dropped_samples", std::to_string(p.dropped_samples)}});
}

}  // namespace sppm
