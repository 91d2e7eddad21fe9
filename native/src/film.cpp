#include "film.h"

#include <numbers>
#include <numeric>

#include "gatherer.h"

namespace sppm {
namespace {

constexpr uint64_t kGrain = 1024;
// Positions carry about 24 bits; a search radius below a few of the last ones would select by rounding.
constexpr float kSmallestRadiusUlps = 32 * 0x1p-23f;

float smallest_radius(Vec3 p) { return std::max(kSmallestRadiusUlps * max_component(abs(p)), 1e-30f); }

// How much wider than its neighbour's a pixel's disk may be, in footprints a pixel.
constexpr float kWidening = 0.25f;

// Lowers a row to the least of its neighbouring row's values plus their distance.
void lower_by_row(float* row, const float* neighbor, uint64_t width, float slope) {
  const float diagonal = slope * std::numbers::sqrt2_v<float>;
  for (uint64_t x = 0; x < width; ++x) row[x] = std::min(row[x], neighbor[x] + slope);
  for (uint64_t x = 1; x < width; ++x) row[x] = std::min(row[x], neighbor[x - 1] + diagonal);
  for (uint64_t x = 1; x < width; ++x) row[x - 1] = std::min(row[x - 1], neighbor[x] + diagonal);
}

// Lowers values to the least of all others plus `slope` a pixel of distance: two sweeps of the chamfer distance transform.
void spread_least(std::vector<float>& values, uint64_t width, uint64_t height, float slope) {
  for (uint64_t y = 0; y < height; ++y) {
    float* row = values.data() + y * width;
    if (y > 0) lower_by_row(row, row - width, width, slope);
    for (uint64_t x = 1; x < width; ++x) row[x] = std::min(row[x], row[x - 1] + slope);
  }
  for (uint64_t y = height; y-- > 0;) {
    float* row = values.data() + y * width;
    if (y + 1 < height) lower_by_row(row, row + width, width, slope);
    for (uint64_t x = width - 1; x > 0; --x) row[x - 1] = std::min(row[x - 1], row[x] + slope);
  }
}

}  // namespace

Film::Film(uint64_t pixels, uint64_t passes) : pixels_(pixels) {
  if (passes >> SPPM_PASS_DEPTH & 1) depth_.assign(pixels, 0);
  if (passes >> SPPM_PASS_NORMAL & 1) normal_sum_.resize(pixels);
}

void Film::start_radii(const Camera& camera, const CameraSamples& samples, double initial_radius, const Threads& threads) {
  threads.for_blocks(pixels_.size(), kGrain, [&](uint64_t begin, uint64_t end) {
    for (uint64_t i = begin; i < end; ++i) {
      const VisiblePoint& vp = samples.pixels[i].point;
      Pixel& pixel = pixels_[i];
      if (!vp.valid() || pixel.footprint > 0) continue;
      const double footprint = initial_radius > 0 ? initial_radius / kFirstRadius : static_cast<double>(camera.footprint(vp.path_length));
      pixel.footprint = std::max(static_cast<float>(footprint), std::numeric_limits<float>::min());
      for (PhotonEstimate& e : pixel.photons) e.radius = std::max(kFirstRadius * footprint, static_cast<double>(smallest_radius(vp.p)));
    }
  });
}

void Film::announce(const CameraSamples& samples, PhotonMaps& maps, const Threads& threads) const {
  for (PhotonMap& map : maps) map.reset(pixels_.size());
  threads.for_blocks(pixels_.size(), kGrain, [&](uint64_t begin, uint64_t end) {
    for (uint64_t i = begin; i < end; ++i) {
      const VisiblePoint& vp = samples.pixels[i].point;
      if (!vp.valid()) continue;
      for (size_t kind = 0; kind < kPhotonKinds; ++kind) maps[kind].announce(vp.p, static_cast<float>(pixels_[i].photons[kind].radius));
    }
  });
}

uint64_t Film::update(const CameraSamples& samples, const PhotonMaps& maps, const PhotonRules& rules, uint64_t width,
                      const Threads& threads) {
  const bool first = iterations_++ == 0;
  const uint64_t height = pixels_.size() / width, tiles = tile_count(width, height);
  std::vector<uint64_t> dropped(tiles, 0);
  threads.for_each(tiles, [&](uint64_t tile) {
    visit_tile(tile, width, height, [&](uint64_t x, uint64_t y) {
      const uint64_t i = y * width + x;
      const CameraSample& sample = samples.pixels[i];
      Pixel& pixel = pixels_[i];
      pixel.direct[0] += static_cast<double>(sample.direct.x);
      pixel.direct[1] += static_cast<double>(sample.direct.y);
      pixel.direct[2] += static_cast<double>(sample.direct.z);
      pixel.photons[kIndirect].add(sample.indirect);
      pixel.alpha += static_cast<double>(sample.alpha);
      if (first && !depth_.empty()) depth_[i] = sample.depth;
      if (!normal_sum_.empty()) normal_sum_[i] += sample.normal;
      const VisiblePoint& vp = sample.point;
      if (!vp.valid()) return;
      const Lobe* lobe = vp.lobe == VisiblePoint::kLambert ? nullptr : &samples.lobes[tile][vp.lobe];
      for (size_t kind = 0; kind < kPhotonKinds; ++kind) {
        if (rules.paths[kind] == 0) continue;
        PhotonEstimate& estimate = pixel.photons[kind];
        Gatherer gatherer(vp, lobe);
        maps[kind].visit_within(vp.p, static_cast<float>(estimate.radius), [&](const PhotonGroup& group, uint32_t lanes) { gatherer.add(group, lanes); });
        estimate.update(gatherer.count(), gatherer.phi(), rules.paths[kind], rules.radius, static_cast<double>(pixel.footprint),
                        smallest_radius(vp.p));
        dropped[tile] += gatherer.dropped();
      }
    });
  });
  // Every batch of photons may become indirect light: without any there is no disk to limit.
  if (rules.radius.rule == SPPM_RADIUS_DENSITY && rules.paths[kIndirect] > 0) limit_radii(width, threads);
  return std::accumulate(dropped.begin(), dropped.end(), uint64_t{0});
}

// A pixel's disk that reaches a bright spot from beside it adds light that the spot's own small disks do not lack. So no disk may be so
// much wider than one near by that it reaches that one's.
void Film::limit_radii(uint64_t width, const Threads& threads) {
  const uint64_t height = pixels_.size() / width;
  threads.for_each(kPhotonKinds, [&](uint64_t kind) {
    std::vector<float> radii(pixels_.size());  // in footprints
    for (size_t i = 0; i < radii.size(); ++i) {
      const Pixel& p = pixels_[i];
      radii[i] = p.footprint > 0 ? static_cast<float>(p.photons[kind].radius) / p.footprint : kInfinity;
    }
    spread_least(radii, width, height, kWidening);
    for (size_t i = 0; i < radii.size(); ++i) {
      double& radius = pixels_[i].photons[kind].radius;
      if (radii[i] < kInfinity) radius = std::min(radius, static_cast<double>(radii[i] * pixels_[i].footprint));
    }
  });
}

void Film::clear() {
  std::fill(pixels_.begin(), pixels_.end(), Pixel{});
  std::fill(normal_sum_.begin(), normal_sum_.end(), Vec3{});
  iterations_ = 0;
}

double Film::share_with(PhotonKind kind, double least) const {
  uint64_t seen = 0, enough = 0;
  for (const Pixel& p : pixels_) {
    seen += p.footprint > 0;
    enough += p.photons[kind].count >= least;
  }
  return seen > 0 ? static_cast<double>(enough) / static_cast<double>(seen) : 0;
}

uint32_t Film::channels(SppmPass pass) {
  switch (pass) {
    case SPPM_PASS_COMBINED: return 4;
    case SPPM_PASS_DEPTH:
    case SPPM_PASS_RADIUS:
    case SPPM_PASS_PHOTONS: return 1;
    default: return 3;
  }
}

void Film::read(SppmPass pass, float* out) const {
  const double scale = iterations_ > 0 ? 1 / static_cast<double>(iterations_) : 0;
  const auto put = [&](Vec3 c) { *out++ = c.x, *out++ = c.y, *out++ = c.z; };
  for (uint64_t i = 0; i < pixels_.size(); ++i) {
    const Pixel& p = pixels_[i];
    const auto direct = [&] {
      return Vec3{static_cast<float>(p.direct[0] * scale), static_cast<float>(p.direct[1] * scale), static_cast<float>(p.direct[2] * scale)};
    };
    const auto& caustic = p.photons[kCaustic];
    const auto& indirect = p.photons[kIndirect];
    switch (pass) {
      case SPPM_PASS_COMBINED:
        put(direct() + caustic.radiance(iterations_) + indirect.radiance(iterations_));
        *out++ = static_cast<float>(p.alpha * scale);
        break;
      case SPPM_PASS_DEPTH: *out++ = depth_.empty() ? 0 : depth_[i]; break;
      case SPPM_PASS_NORMAL: put(normal_sum_.empty() ? Vec3{} : normal_sum_[i] * static_cast<float>(scale)); break;
      case SPPM_PASS_DIRECT: put(direct()); break;
      case SPPM_PASS_INDIRECT: put(indirect.radiance(iterations_)); break;
      case SPPM_PASS_CAUSTICS: put(caustic.radiance(iterations_)); break;
      case SPPM_PASS_RADIUS: *out++ = iterations_ > 0 ? static_cast<float>(caustic.count > 0 ? caustic.radius : indirect.radius) : 0; break;
      default: *out++ = static_cast<float>(caustic.count + indirect.count);
    }
  }
}

uint64_t Film::memory() const { return pixels_.size() * sizeof(Pixel) + depth_.size() * 4 + normal_sum_.size() * 12; }

}  // namespace sppm
