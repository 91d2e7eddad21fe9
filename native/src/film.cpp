#include "film.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>

#include "gatherer.h"
#include "pass_info.h"

namespace sppm {
namespace {

// What a pixel's visible points find of one kind of photons in an iteration.
struct Found {
  Gathered gathered;
  uint64_t dropped = 0, points = 0;
  float smallest_radius = 0;  // that all positions can tell

  // `creases()` tells where the point's surface ends; it is asked only where there are photons.
  template <typename FindCreases>
  void ask(const VisiblePoint& vp, const Kernel& kernel, const std::vector<Lobe>& lobes, const PhotonMap& map, float share, uint64_t paths,
           FindCreases creases) {
    Gatherer gatherer(vp, kernel, vp.lobe == VisiblePoint::kLambert ? nullptr : &lobes[vp.lobe]);
    const Creases* ends = nullptr;
    map.visit_within(kernel.region(), [&](const PhotonGroup& group, uint32_t lanes) {
      if (!ends) ends = &creases();
      gatherer.add(group, lanes, [&](Vec3 p) { return ends->hold(p); });
    });
    const float on_surface = ends ? ends->share(kernel) : 1;
    gathered.add(gatherer.count(), gatherer.phi() * share, kernel.area() * static_cast<double>(on_surface), paths);
    dropped += gatherer.dropped(), ++points;
    smallest_radius = std::max(smallest_radius, sppm::smallest_radius(vp.p));
  }
};

}  // namespace

Film::Film(uint64_t pixels, const DataPasses& data) : pixels_(pixels), passes_(data), data_(pixels * data.size()) {}

void Film::start_radii(const Camera& camera, const CameraSamples& samples, double initial_radius, const Threads& threads) {
  const auto start = [&](Pixel& pixel, const VisiblePoint& vp) {
    if (pixel.footprint > 0) return;
    const double footprint = initial_radius > 0 ? initial_radius / kFirstRadius : static_cast<double>(camera.footprint(vp.path_length));
    pixel.footprint = std::max(static_cast<float>(footprint), std::numeric_limits<float>::min());
    for (size_t kind = 0; kind < kPhotonKinds; ++kind)
      pixel.photons[kind].radius = std::max(kFirstRadius * footprint, static_cast<double>(smallest_radius(vp.p)));
  };
  threads.for_blocks(pixels_.size(), kGrain, [&](uint64_t begin, uint64_t end) {
    for (uint64_t i = begin; i < end; ++i) {
      if (samples.pixels[i].point.valid()) start(pixels_[i], samples.pixels[i].point);
    }
  });
  threads.for_each(samples.tiles.size(), [&](uint64_t tile) {
    for (const GlossyPoint& g : samples.tiles[tile].glossy) start(pixels_[g.pixel], g.point);
  });
}

void Film::announce(const CameraSamples& samples, PhotonMaps& maps, const PhotonRules& rules, const Threads& threads) const {
  for (PhotonMap& map : maps) map.reset(pixels_.size());
  threads.for_blocks(pixels_.size(), kGrain, [&](uint64_t begin, uint64_t end) {
    for (uint64_t i = begin; i < end; ++i) {
      const VisiblePoint& vp = samples.pixels[i].point;
      if (!vp.valid()) continue;
      for (size_t kind = 0; kind < kPhotonKinds; ++kind)
        if (rules[kind].paths > 0)
          maps[kind].announce(Kernel(vp, samples.pixels[i].ellipse, static_cast<float>(pixels_[i].photons[kind].radius)).region());
    }
  });
  threads.for_each(samples.tiles.size(), [&](uint64_t tile) {
    for (const GlossyPoint& g : samples.tiles[tile].glossy)
      maps[kCaustic].announce({g.point.p, static_cast<float>(pixels_[g.pixel].photons[kCaustic].radius)});
  });
}

uint64_t Film::update(const Camera& camera, CameraSamples& samples, const PhotonMaps& maps, const PhotonRules& rules,
                      const Threads& threads) {
  add_data(samples, threads);
  ++iterations_;
  const uint64_t width = camera.region_width, height = camera.region_height, tiles = tile_count(width, height);
  std::vector<uint64_t> dropped(tiles, 0);
  threads.for_each(tiles, [&](uint64_t tile) {
    const TilePoints& points = samples.tiles[tile];
    auto glossy = points.glossy.begin();
    visit_tile(tile, width, height, [&](uint64_t x, uint64_t y) {
      const uint64_t i = y * width + x;
      CameraSample& sample = samples.pixels[i];
      Pixel& pixel = pixels_[i];
      sample.dark_iterations = is_black(sample.direct) ? std::min<uint8_t>(sample.dark_iterations, 254) + 1 : 0;
      pixel.direct[0] += static_cast<double>(sample.direct.x);
      pixel.direct[1] += static_cast<double>(sample.direct.y);
      pixel.direct[2] += static_cast<double>(sample.direct.z);
      pixel.photons[kIndirect].add(sample.indirect);
      pixel.alpha += (sample.alpha - pixel.alpha) / static_cast<float>(iterations_);
      std::array<Found, kPhotonKinds> found;
      std::optional<Creases> near;
      const auto find_creases = [&]() -> const Creases& {
        if (!near) near = pixel.spread.near_edge ? creases(camera, samples, x, y) : Creases{};
        return *near;
      };
      const auto ask = [&](const VisiblePoint& vp, const PixelEllipse& ellipse, size_t kind, auto creases) {
        if (rules[kind].paths == 0) return;
        const float share = kind == kCaustic ? vp.caustic_share : 1;
        const Kernel kernel(vp, ellipse, static_cast<float>(pixel.photons[kind].radius));
        found[kind].ask(vp, kernel, points.lobes, maps[kind], share, rules[kind].paths, creases);
      };
      for (size_t kind = 0; kind < kPhotonKinds && sample.point.valid(); ++kind) ask(sample.point, sample.ellipse, kind, find_creases);
      const Creases none{};
      for (; glossy != points.glossy.end() && glossy->pixel == i; ++glossy)
        ask(glossy->point, {}, kCaustic, [&]() -> const Creases& { return none; });
      for (size_t kind = 0; kind < kPhotonKinds; ++kind) {
        const Found& f = found[kind];
        if (f.points == 0) continue;
        pixel.photons[kind].update(f.gathered, rules[kind], static_cast<double>(pixel.footprint), f.smallest_radius);
        dropped[tile] += f.dropped;
      }
    });
  });
  if (rules[kIndirect].rule == SPPM_RADIUS_DENSITY) {
    choose_radii(camera, samples, rules, threads);
    limit_radii(rules, width, threads);
  }
  return std::accumulate(dropped.begin(), dropped.end(), uint64_t{0});
}

// Takes the records of an iteration over into means, which lose no digits however many there are.
void Film::add_data(const CameraSamples& samples, const Threads& threads) {
  const uint64_t size = passes_.size(), begin = iterations_ == 0 ? 0 : passes_.middle();
  if (begin == size) return;
  const float share = 1 / static_cast<float>(iterations_ + 1);
  threads.for_blocks(pixels_.size(), kGrain, [&](uint64_t first, uint64_t last) {
    for (uint64_t i = first; i < last; ++i)
      for (uint64_t k = i * size + begin; k < (i + 1) * size; ++k) {
        const float value = std::isfinite(samples.data[k]) ? samples.data[k] : 0.0f;
        data_[k] += (value - data_[k]) * share;
      }
  });
}

void Film::clear() {
  std::fill(pixels_.begin(), pixels_.end(), Pixel{});
  std::fill(data_.begin(), data_.end(), 0.0f);
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

void Film::read_data(SppmPass pass, float* out) const {
  for (uint64_t i = 0; i < pixels_.size(); ++i)
    for (uint32_t channel = 0; channel < kPasses[pass].channel_count(); ++channel)
      *out++ = iterations_ > 0 ? passes_.shown(pass, data_.data() + i * passes_.size(), channel) : 0;
}

void Film::read(SppmPass pass, float* out) const {
  if (kPasses[pass].source != PassSource::kLight) return read_data(pass, out);
  const double scale = iterations_ > 0 ? 1 / static_cast<double>(iterations_) : 0;
  const auto put = [&](Vec3 c) { *out++ = c.x, *out++ = c.y, *out++ = c.z; };
  for (uint64_t i = 0; i < pixels_.size(); ++i) {
    const Pixel& p = pixels_[i];
    const auto direct = [&] {
      return Vec3{static_cast<float>(p.direct[0] * scale), static_cast<float>(p.direct[1] * scale),
                  static_cast<float>(p.direct[2] * scale)};
    };
    const auto& caustic = p.photons[kCaustic];
    const auto& indirect = p.photons[kIndirect];
    switch (pass) {
      case SPPM_PASS_COMBINED:
        put(direct() + caustic.radiance(iterations_) + indirect.radiance(iterations_));
        *out++ = p.alpha;
        break;
      case SPPM_PASS_DIRECT: put(direct()); break;
      case SPPM_PASS_INDIRECT: put(indirect.radiance(iterations_)); break;
      case SPPM_PASS_CAUSTICS: put(caustic.radiance(iterations_)); break;
      case SPPM_PASS_RADIUS: *out++ = iterations_ > 0 ? static_cast<float>(caustic.count > 0 ? caustic.radius : indirect.radius) : 0; break;
      default: *out++ = static_cast<float>(caustic.count + indirect.count);
    }
  }
}

uint64_t Film::memory() const { return pixels_.size() * sizeof(Pixel) + data_.size() * sizeof(float); }

}  // namespace sppm
