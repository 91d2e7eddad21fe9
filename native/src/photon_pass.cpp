#include "photon_pass.h"

#include <algorithm>

#include "path.h"
#include "sampling.h"

namespace sppm {
namespace {

constexpr uint64_t kPhotonStream = 0x70686f746f6e;
constexpr uint64_t kBlock = 4096;
constexpr size_t kWalks = 128;  // paths that are followed together: what they carry fits the first cache

void store(PhotonMap::Block& block, const PhotonMap& map, const Photon& photon) {
  const size_t before = block.keys.size();
  map.occupancy().visit_marked(photon.p, [&](CellKey key) { block.keys.push_back(key); });
  if (block.keys.size() == before) return;
  block.owners.resize(block.keys.size(), static_cast<uint32_t>(block.photons.size()));
  block.photons.push_back(photon);
}

class PhotonPaths {
 public:
  PhotonPaths(const Scene& scene, const PathSettings& settings, const PhotonBatch& batch, const PhotonMaps& maps,
              std::array<PhotonMap::Block*, kPhotonKinds> blocks, RayCounts& counts)
      : scene_(scene), settings_(settings), batch_(batch), maps_(maps), blocks_(blocks), counts_(counts) {}

  // Follows the paths [begin, end) of the sequence, many of them a ray at a time: while one waits for a division or for memory another
  // goes on.
  void follow(uint64_t stream, uint64_t begin, uint64_t end) const {
    std::vector<Walk> walks;
    walks.reserve(kWalks);
    std::array<std::optional<Hit>, kWalks> hits;
    for (;;) {
      while (walks.size() < kWalks && begin < end)
        if (const auto walk = start(Sampler(stream, begin++))) walks.push_back(*walk);
      if (walks.empty()) return;
      counts_.photon += walks.size();
      for (size_t i = 0; i < walks.size(); ++i) hits[i] = scene_.trace(walks[i].ray);
      size_t kept = 0;
      for (size_t i = 0; i < walks.size(); ++i)
        if (hits[i] && advance(walks[i], *hits[i])) walks[kept++] = walks[i];
      walks.erase(walks.begin() + static_cast<std::ptrdiff_t>(kept), walks.end());
    }
  }

 private:
  struct Walk {  // a path on its way
    Sampler sampler;
    Ray ray;
    Vec3 beta;
    PhotonKind kind;
    uint32_t depth;
    int passes;
  };

  // Empty if no light is there to start from.
  std::optional<Walk> start(Sampler sampler) const {
    std::optional<Walk> walk;
    const Sample4 u = sampler.next(), v = sampler.next();
    const auto start = batch_.aimed ? scene_.lights.emit_aimed(u, v) : scene_.lights.emit(u, v);
    if (!start) return walk;
    walk.emplace(Walk{sampler, {start->origin, start->direction}, start->weight * (1 / static_cast<float>(batch_.count)),
                      batch_.emission == Emission::kRest ? kIndirect : kCaustic, 0, 0});
    return walk;
  }

  // Takes the path to its next ray; false where it ends.
  bool advance(Walk& walk, const Hit& hit) const {
    const SurfacePoint surface = scene_.surface(walk.ray, hit);
    const Vec3 wi = -walk.ray.direction;
    const Bsdf bsdf = scene_.bsdf(surface);
    const bool first = walk.depth == 0;
    if (!first) deposit(surface, bsdf, walk.beta, wi, walk.kind);  // the first hit is direct light
    const Vec3 transparency = scene_.transparency(surface);
    const auto share = [&](const Lobe& lobe) { return first ? share_of(lobe) : 1.0f; };
    const LobeChoice choice(bsdf, transparency, wi, share);
    const Sample4 w = walk.sampler.next();
    float pick = w[3];
    const int chosen = choice.choose(bsdf, pick);
    if (chosen == LobeChoice::kNothing) return false;
    if (chosen == LobeChoice::kThrough) {
      if (++walk.passes > kMostPasses) return false;
      walk.beta *= transparency / choice.through;
      walk.ray = surface.spawn_at_border(wi, walk.ray.direction);
      return true;
    }
    const Lobe& lobe = bsdf[chosen];
    const auto next = sample(lobe, bsdf.at, wi, {w[0], w[1], w[2]}, Transport::kPhoton);
    if (!next) return false;
    const Vec3 scattered = walk.beta * next->weight * (share(lobe) / choice.probability[static_cast<size_t>(chosen)]);
    if (!is_finite(scattered)) {
      ++counts_.dropped;
      return false;
    }
    // Absorption ends paths rather than thinning them: those that go on keep their luminance. What is aimed at a target has its
    // reflectance in the choice of the target.
    const float before = luminance(walk.beta), after = luminance(scattered);
    if (!(after > 0)) return false;
    const float survival = first && batch_.aimed ? 1.0f : std::min(1.0f, after / before);
    if (pick >= survival) return false;
    walk.beta = scattered / survival;
    if (lobe.diffuse()) walk.kind = kIndirect;
    walk.ray = lobe.diffuse() ? surface.spawn(next->direction) : surface.spawn_at_border(wi, next->direction);
    return ++walk.depth < settings_.max_depth;
  }

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
    const PhotonPaths paths(scene, settings, batch, maps, mine, task_counts[t]);
    const uint64_t stream = hash64(settings.seed ^ kPhotonStream, static_cast<uint64_t>(batch.emission));
    paths.follow(stream, batch.first + tasks[t].begin, batch.first + tasks[t].end);
  });
  for (size_t t = 0; t < tasks.size(); ++t) counts[tasks[t].batch] += task_counts[t];
  return !cancel.load();
}

}  // namespace sppm
