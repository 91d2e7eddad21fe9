#include "photon_pass.h"

#include <algorithm>

#include "path.h"
#include "sampling.h"

namespace sppm {
namespace {

constexpr uint64_t kPhotonStream = 0x70686f746f6e;
constexpr uint64_t kBlock = 4096;

void store(PhotonMap::Block& block, const PhotonMap& map, const Photon& photon) {
  const size_t before = block.keys.size();
  map.occupancy().visit_marked(photon.p, [&](CellKey key) { block.keys.push_back(key); });
  if (block.keys.size() == before) return;
  block.owners.resize(block.keys.size(), static_cast<uint32_t>(block.photons.size()));
  block.photons.push_back(photon);
}

class PhotonPath {
 public:
  PhotonPath(const Scene& scene, const PathSettings& settings, const PhotonBatch& batch, const PhotonMaps& maps,
             std::array<PhotonMap::Block*, kPhotonKinds> blocks, RayCounts& counts)
      : scene_(scene), settings_(settings), batch_(batch), maps_(maps), blocks_(blocks), counts_(counts) {}

  void follow(Sampler sampler) const {
    const Sample4 u = sampler.next(), v = sampler.next();
    const auto start = batch_.aimed ? scene_.lights.emit_aimed(u, v) : scene_.lights.emit(u, v);
    if (!start) return;
    Vec3 beta = start->weight * (1 / static_cast<float>(batch_.count));
    Ray ray{start->origin, start->direction};
    PhotonKind kind = batch_.emission == Emission::kRest ? kIndirect : kCaustic;
    int passes = 0;
    for (uint32_t depth = 0; depth < settings_.max_depth;) {
      ++counts_.photon;
      const auto surface = scene_.intersect(ray);
      if (!surface) return;
      const Vec3 wi = -ray.direction;
      const Bsdf bsdf = scene_.bsdf(*surface);
      const bool first = depth == 0;
      if (!first) deposit(*surface, bsdf, beta, wi, kind);  // the first hit is direct light
      const Vec3 transparency = scene_.transparency(*surface);
      const auto share = [&](const Lobe& lobe) { return first ? share_of(lobe) : 1.0f; };
      const LobeChoice choice(bsdf, transparency, wi, share);
      const Sample4 w = sampler.next();
      float pick = w[3];
      const int chosen = choice.choose(bsdf, pick);
      if (chosen == LobeChoice::kNothing) return;
      if (chosen == LobeChoice::kThrough) {
        if (++passes > kMostPasses) return;
        beta *= transparency / choice.through;
        ray = surface->spawn_at_border(wi, ray.direction);
        continue;
      }
      const Lobe& lobe = bsdf[chosen];
      const auto next = sample(lobe, bsdf.at, wi, {w[0], w[1], w[2]}, Transport::kPhoton);
      if (!next) return;
      const Vec3 scattered = beta * next->weight * (share(lobe) / choice.probability[static_cast<size_t>(chosen)]);
      if (!is_finite(scattered)) {
        ++counts_.dropped;
        return;
      }
      // Absorption ends paths rather than thinning them: those that go on keep their luminance. What is aimed at a target has its
      // reflectance in the choice of the target.
      const float before = luminance(beta), after = luminance(scattered);
      if (!(after > 0)) return;
      const float survival = first && batch_.aimed ? 1.0f : std::min(1.0f, after / before);
      if (pick >= survival) return;
      beta = scattered / survival;
      if (lobe.diffuse()) kind = kIndirect;
      ray = lobe.diffuse() ? surface->spawn(next->direction) : surface->spawn_at_border(wi, next->direction);
      ++depth;
    }
  }

 private:
  float share_of(const Lobe& lobe) const {
    switch (batch_.emission) {
      case Emission::kSpecular: return lobe.photon_share();
      case Emission::kRest: return 1 - lobe.photon_share();
      default: return 1;
    }
  }

  void deposit(const SurfacePoint& s, const Bsdf& bsdf, Vec3 beta, Vec3 wi, PhotonKind kind) const {
    if (!bsdf.rough()) return;
    if (!is_finite(beta)) {
      ++counts_.dropped;
      return;
    }
    store(*blocks_[kind], maps_[kind], {s.p, beta, pack_direction(wi), pack_direction(face_toward(s.ng, wi))});
  }

  const Scene& scene_;
  const PathSettings& settings_;
  const PhotonBatch& batch_;
  const PhotonMaps& maps_;
  std::array<PhotonMap::Block*, kPhotonKinds> blocks_;
  RayCounts& counts_;
};

}  // namespace

bool run_photon_pass(const Scene& scene, const PathSettings& settings, std::span<const PhotonBatch> batches, const Threads& threads,
                     const std::atomic<bool>& cancel, const PhotonMaps& maps, PhotonBlocks& blocks, std::span<RayCounts> counts) {
  struct Task {
    size_t batch;
    uint64_t begin, end;
  };
  std::vector<Task> tasks;
  for (size_t b = 0; b < batches.size(); ++b)
    for (uint64_t begin = 0; begin < batches[b].count; begin += kBlock)
      tasks.push_back({b, begin, std::min(begin + kBlock, batches[b].count)});
  for (auto& kind : blocks) kind.resize(tasks.size());
  std::vector<RayCounts> task_counts(tasks.size());
  threads.for_each(tasks.size(), [&](uint64_t t) {
    const PhotonBatch& batch = batches[tasks[t].batch];
    std::array<PhotonMap::Block*, kPhotonKinds> mine{&blocks[kCaustic][t], &blocks[kIndirect][t]};
    for (PhotonMap::Block* block : mine) block->photons.clear(), block->keys.clear(), block->owners.clear();
    if (cancel.load(std::memory_order_relaxed)) return;
    const PhotonPath path(scene, settings, batch, maps, mine, task_counts[t]);
    const uint64_t stream = hash64(settings.seed ^ kPhotonStream, static_cast<uint64_t>(batch.emission));
    for (uint64_t i = tasks[t].begin; i < tasks[t].end; ++i) path.follow(Sampler(stream, batch.first + i));
  });
  for (size_t t = 0; t < tasks.size(); ++t) counts[tasks[t].batch] += task_counts[t];
  return !cancel.load();
}

}  // namespace sppm
