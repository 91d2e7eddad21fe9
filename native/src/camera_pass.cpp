#include "camera_pass.h"

#include <algorithm>
#include <array>
#include <utility>

#include "path.h"
#include "sampling.h"

namespace sppm {
namespace {

// Direct light up to the visible point takes 2^bits samples: a shadow ray costs a fraction of the path that comes with it.
constexpr uint32_t kLightSampleBits = 2;
// A pixel that found none in so many iterations takes one of them, until it finds some again.
constexpr uint8_t kDarkIterations = 16;
// A reflection more probable than this is left to the path.
constexpr float kMirror = 0.5f;
constexpr size_t kPathsTogether = 64;  // that are followed side by side
constexpr uint64_t kCameraStream = 0x63616d657261;  // tells a pixel's samples from a photon's

// Shadow rays, and what comes along them, until there are enough to trace them together.
class ShadowRays {
 public:
  ShadowRays(const Scene& scene, RayCounts& counts) : scene_(scene), counts_(counts) {}

  // Adds `value` to `sum` if nothing stands in the ray's way, or what is left of it; at the latest when `finish` is called.
  void add(const Ray& ray, Vec3 value, Vec3& sum) {
    rays_[count_] = ray, values_[count_] = value, sums_[count_] = &sum;
    if (++count_ == Scene::kPacket) trace();
  }
  // Adds what nothing hides when `finish` is called, so that the order of a sum does not depend on when packets are full.
  void add_unshadowed(Vec3 value, Vec3& sum) { unshadowed_.emplace_back(value, &sum); }
  void finish() {
    trace();
    for (const auto& [value, sum] : unshadowed_) *sum += value;
    unshadowed_.clear();
  }

 private:
  void trace() {
    if (count_ == 0) return;
    const auto left = scene_.transmittance({rays_.data(), count_}, counts_.shadow);
    for (size_t i = 0; i < count_; ++i) *sums_[i] += values_[i] * left[i];
    count_ = 0;
  }

  const Scene& scene_;
  RayCounts& counts_;
  size_t count_ = 0;
  std::array<Ray, Scene::kPacket> rays_;
  std::array<Vec3, Scene::kPacket> values_;
  std::array<Vec3*, Scene::kPacket> sums_;
  std::vector<std::pair<Vec3, Vec3*>> unshadowed_;
};

class CameraPath {
 public:
  // Writes to `sample`, which is cleared, and to `record` if there is one.
  CameraPath(const Scene& scene, const PathSettings& settings, Sampler sampler, Vec2 film, uint64_t pixel, CameraSample& sample,
             TilePoints& tile, ShadowRays& shadows, float* record)
      : scene_(scene), settings_(settings), sampler_(sampler), pixel_(pixel), sample_(sample), tile_(tile), shadows_(shadows),
        data_(settings.data, scene, record), ray_(first_ray(film.x, film.y)) {}

  // The ray that it goes on by.
  const Ray& ray() const { return ray_; }

  // Takes the path on, given what its ray meets; false at its end.
  bool advance(const std::optional<Hit>& hit) {
    const auto surface = arrive(hit);
    if (!surface) return false;
    switch (scatter(*surface, depth_ + 1 == settings_.max_depth)) {
      case Next::kEnd: return false;
      case Next::kThrough: return ++passes_ <= kMostPasses;
      default: return ++depth_, true;
    }
  }

 private:
  enum class Next { kEnd, kThrough, kBounce };

  Ray first_ray(float x, float y) {
    const Sample4 u = sampler_.next();
    const auto filtered = [&](float v) {
      return settings_.box_filter ? (v - 0.5f) * settings_.filter_reach : sample_blackman_harris(v) * 2 * settings_.filter_reach;
    };
    Ray ray = scene_.camera.ray(x + 0.5f + filtered(u[0]), y + 0.5f + filtered(u[1]), u.second());
    ray.kind = Ray::kCamera;
    return ray;
  }

  // The surface that the ray meets, after adding what it meets on its way: lamps, and environment or the surface's own light at its end.
  std::optional<SurfacePoint> arrive(const std::optional<Hit>& hit) {
    std::optional<SurfacePoint> surface;
    if (hit) surface.emplace(scene_.surface(ray_, *hit));
    const float distance = surface ? dot(surface->p - ray_.origin, ray_.direction) : kInfinity;
    const float near = since_scatter_;
    since_scatter_ += distance;
    const auto add = [&](const EmittedLight& light) { met_sum() += met(light, SPPM_PASS_EMISSION); };
    if (!camera_ray_ && !lamps_known_ && share_ > 0) scene_.lights.visit_lamps(scattered_at_, ray_.direction, near, since_scatter_, add);
    if (surface) {
      path_length_ += distance;
      if (!is_cut_out(*surface)) add(scene_.emitted(*surface, -ray_.direction, scattered_at_, since_scatter_));
    } else {
      leave_scene();
    }
    return surface;
  }

  // Where light goes that the ray meets.
  Vec3& met_sum() { return met_is_indirect_ ? sample_.indirect : sample_.direct; }

  // What the path brings of a light that the ray meets; `pass` shows it if the camera sees it.
  Vec3 met(const EmittedLight& light, SppmPass pass) {
    const float weight = mis_pdf_ > 0 ? mis_weight(mis_pdf_, light_samples_ * light.pdf_solid_angle) : 1.0f;
    const Vec3 value = beta_ * light.radiance * (share_ * weight);
    data_.meet_light(value, pass, camera_ray_);
    return value;
  }

  void leave_scene() {
    sample_.escaped = camera_ray_;
    const bool hidden = camera_ray_ && settings_.transparent_film;
    if (hidden) uncover(beta_);
    if (hidden && !data_.shows_environment()) return;
    const auto add = [&](const EmittedLight& light) {
      const Vec3 value = met(light, SPPM_PASS_ENVIRONMENT);
      if (!hidden) met_sum() += value;
    };
    if (lamps_known_)
      scene_.lights.visit_world(scattered_at_, ray_.direction, camera_ray_, add);
    else
      scene_.lights.visit_infinite(scattered_at_, ray_.direction, camera_ray_, add);
  }

  bool is_cut_out(const SurfacePoint& s) const { return camera_ray_ && scene_.is_holdout(s); }
  // What lies behind the picture shows here, with this share; where textures make transparency so, it is negative or not finite.
  void uncover(Vec3 share) { sample_.alpha = std::min(1.0f, std::max(0.0f, sample_.alpha - luminance(share))); }

  Next scatter(const SurfacePoint& s, bool last) {
    const Vec3 wo = -ray_.direction;
    const Vec3 transparency = scene_.transparency(s);
    if (is_cut_out(s)) {
      uncover(beta_ * (Vec3{1, 1, 1} - transparency));
      return pass_through(s, transparency);
    }
    if (final_) return pass_through(s, transparency);
    const Bsdf bsdf = scene_.bsdf(s);
    const LobeChoice choice(bsdf, transparency, wo);
    data_.meet_surface(s, bsdf, transparency, wo, beta_, camera_ray_);
    const uint32_t light_bits = waiting_ || !bsdf.rough() ? 0 : kLightSampleBits;
    float pick = add_direct_light(s, bsdf, choice, wo, light_bits);
    // Light there counts as met by the next ray, which the last vertex does not have.
    const uint32_t mirrored = waiting_ || last || !scene_.lights.can_be_met() ? 0 : add_mirrored_lamps(s, bsdf, choice, wo);
    const int chosen = choice.choose(bsdf, pick);
    if (chosen == LobeChoice::kNothing) return Next::kEnd;
    if (chosen == LobeChoice::kThrough) {
      beta_ *= transparency / choice.through;
      // What is seen through a surface by chance tells nothing of where that ends.
      if (!waiting_ && choice.through < 1) sample_.way = static_cast<uint8_t>((sample_.way * 5 + 3) & 15);
      return pass_on(s);
    }
    const Lobe& lobe = bsdf[chosen];
    const float probability = choice.probability[static_cast<size_t>(chosen)];
    share_ = share_of_paths(lobe);
    if (waiting_) {
      met_is_indirect_ = true;
    } else if (lobe.diffuse() || (last && lobe.photon_share() < 1)) {
      sample_.point = visible_point(s, bsdf, lobe, wo, probability);
      // Of a narrow lobe's light few photons would bring all.
      sample_.point.weight *= 1 - lobe.photon_share();
      data_.stop_features(bsdf, wo);
      waiting_ = true, asked_ = 1;
      final_ = !settings_.trace_indirect;
    } else if (settings_.ask_at_glossy && !lobe.smooth()) {
      ask_for_caustics(s, bsdf, lobe, wo, probability);
    }
    final_ |= last;
    // What the last ray is for is the second half of direct light.
    if (final_ && (lobe.smooth() || !scene_.lights.can_be_met())) return Next::kEnd;
    const Sample4 v = sampler_.next();
    const auto next = sample(lobe, bsdf.at, wo, {v[0], v[1], v[2]}, Transport::kRadiance);
    if (!next || is_black(next->weight)) return Next::kEnd;
    beta_ *= next->weight / probability;
    mis_pdf_ = next->smooth ? 0 : next->pdf_solid_angle * probability;
    light_samples_ = static_cast<float>(1u << light_bits);
    ray_ = lobe.diffuse() ? s.spawn(next->direction) : s.spawn_at_border(wo, next->direction);
    scattered_at_ = ray_.origin;
    since_scatter_ = ray_.touching.reach;
    camera_ray_ = false;
    const bool transmitted = dot(next->direction, s.ng) * dot(wo, s.ng) < 0;
    lamps_known_ = !transmitted && mirrored >> chosen & 1;
    if (!waiting_) sample_.way = static_cast<uint8_t>((sample_.way * 5 + 1 + transmitted) & 15);
    // Entering glass divides radiance by eta^2 and leaving multiplies it: not a reason to end a path.
    if (transmitted) index_scale_ *= square(dot(wo, s.ng) > 0 ? lobe.ior : 1 / lobe.ior);
    return survives(v[3]) ? Next::kBounce : Next::kEnd;
  }

  Next pass_through(const SurfacePoint& s, Vec3 transparency) {
    beta_ *= transparency;
    if (is_black(beta_)) return Next::kEnd;
    return pass_on(s);
  }

  Next pass_on(const SurfacePoint& s) {
    const Ray::Kind kind = ray_.kind;
    ray_ = s.spawn_at_border(-ray_.direction, ray_.direction);
    ray_.kind = kind;
    return Next::kThrough;
  }

  bool survives(float u) {
    const float y = luminance(beta_) * index_scale_;
    if (!(y > 0)) return false;
    if (y >= 0.25f) return true;
    if (u >= y) return false;
    beta_ *= 1 / y;
    return true;
  }

  // Direct light by samples of the lights. Returns a number of the sampler's that they have left.
  float add_direct_light(const SurfacePoint& s, const Bsdf& bsdf, const LobeChoice& choice, Vec3 wo, uint32_t bits) {
    if (bits == 0) {
      const Sample4 u = sampler_.next();
      if (bsdf.rough()) add_light_sample(s, bsdf, choice, wo, u, 1, 1);
      return u[3];
    }
    // Which of them comes first is random, so it may stand for all. It has to be one of these: earlier iterations, which tell that the
    // pixel is dark, took points of the same sequence.
    const uint32_t all = 1u << bits, taken = sample_.dark_iterations < kDarkIterations ? all : 1;
    for (uint32_t i = 0; i < taken; ++i) add_light_sample(s, bsdf, choice, wo, sampler_.split(i, bits).next(), all, taken);
    sampler_.skip();
    return sampler_.next()[3];
  }

  // Each rough lobe shares the light with the direction that the path would take by that lobe.
  //   all: how many samples the light's part of the heuristic's weight is for; taken: how many there are.
  void add_light_sample(const SurfacePoint& s, const Bsdf& bsdf, const LobeChoice& choice, Vec3 wo, const Sample4& u, uint32_t all,
                        uint32_t taken) {
    const auto light = scene_.lights.sample_direct(s.p, u);
    if (!light) return;
    const float density = static_cast<float>(all) * light->pdf;
    Vec3 f;
    for (int i = 0; i < bsdf.count; ++i) {
      const Lobe& lobe = bsdf[i];
      const Vec3 value = evaluate(lobe, bsdf.at, wo, light->wi);
      if (is_black(value)) continue;
      const float other = choice.probability[static_cast<size_t>(i)] * pdf_solid_angle(lobe, bsdf.at, wo, light->wi);
      f += value * (share_of_paths(lobe) * (light->delta ? 1.0f : mis_weight(density, other)));
    }
    if (is_black(f)) return;
    const Vec3 value = beta_ * f * light->radiance * (std::abs(dot(light->wi, bsdf.at.frame.n)) / (static_cast<float>(taken) * light->pdf));
    Vec3& sum = waiting_ ? sample_.indirect : sample_.direct;
    if (light->casts_shadow)
      shadows_.add(light->end ? s.spawn_to(*light->end) : s.spawn(light->wi, light->distance), value, sum);
    else
      shadows_.add_unshadowed(value, sum);
  }

  // Lamps that smooth surfaces mirror: of glass that reflects a twentieth the path would find them once in twenty times. Not the
  // environment, which is there by most ways: the others would miss it.
  // Returns a bit for each lobe that this was done for, which are those that the path seldom takes to reflect.
  uint32_t add_mirrored_lamps(const SurfacePoint& s, const Bsdf& bsdf, const LobeChoice& choice, Vec3 wo) {
    uint32_t done = 0;
    for (int i = 0; i < bsdf.count; ++i) {
      const Lobe& lobe = bsdf[i];
      const float chosen = choice.probability[static_cast<size_t>(i)];
      if (!lobe.smooth() || lobe.type == LobeType::kRefraction || !(chosen > 0)) continue;
      const auto mirrored = sample(lobe, bsdf.at, wo, {0, 0, 0}, Transport::kRadiance);  // by 0 it reflects if it can
      if (!mirrored || dot(mirrored->direction, s.ng) * dot(wo, s.ng) <= 0 || chosen * mirrored->probability > kMirror) continue;
      done |= 1u << i;
      const Vec3 weight = beta_ * mirrored->weight * (mirrored->probability * share_of_paths(lobe));
      Ray ray = s.spawn_at_border(wo, mirrored->direction);
      const auto add = [&](const EmittedLight& light) {
        if (is_black(light.radiance)) return;
        ray.far = light.distance;
        shadows_.add(ray, weight * light.radiance, sample_.direct);
      };
      scene_.lights.visit_lamps(ray.origin, ray.direction, ray.touching.reach, kInfinity, add);
      scene_.lights.visit_suns(ray.origin, ray.direction, add);
    }
    return done;
  }

  // Of a lamp's light that the lobe scatters toward the path, what photons do not carry to surfaces before.
  float share_of_paths(const Lobe& lobe) const { return 1 - asked_ * lobe.photon_share(); }

  void ask_for_caustics(const SurfacePoint& s, const Bsdf& bsdf, const Lobe& lobe, Vec3 wo, float probability) {
    const float share = lobe.asked_share(scene_.lights.any_without_size());
    if (share == 0) return;
    tile_.glossy.push_back({visible_point(s, bsdf, lobe, wo, probability), pixel_});
    tile_.glossy.back().point.caustic_share *= share;
    asked_ += (1 - asked_) * share;
  }

  VisiblePoint visible_point(const SurfacePoint& s, const Bsdf& bsdf, const Lobe& lobe, Vec3 wo, float probability) {
    VisiblePoint vp;
    vp.p = s.p;
    vp.path_length = path_length_;
    // Diffuse surfaces have all that comes to them; what a glossy one sees through glass may be seen by another before.
    vp.caustic_share = lobe.diffuse() ? 1 : 1 - asked_;
    vp.wo = pack_direction(wo);
    const Vec3 ng = face_toward(s.ng, wo);
    vp.ng = pack_direction(ng);
    vp.ns = pack_direction(face_toward(s.ns, ng));
    vp.weight = beta_ / probability;
    if (lobe.type == LobeType::kDiffuse) {
      // Its f is the same for every photon: evaluated once, straight above.
      vp.weight *= evaluate(lobe, bsdf.at, wo, ng);
    } else {
      vp.lobe = static_cast<uint32_t>(tile_.lobes.size());
      tile_.lobes.push_back(lobe);
      // The point's frame is turned toward wo, so glass seen from inside is glass of the inverse index there.
      if (dot(wo, s.ng) < 0 && transmits(lobe.type)) {
        tile_.lobes.back().ior = 1 / lobe.ior;
        std::swap(tile_.lobes.back().multiple_scattering, tile_.lobes.back().multiple_scattering_inside);
      }
    }
    return vp;
  }

  const Scene& scene_;
  const PathSettings& settings_;
  Sampler sampler_;
  uint64_t pixel_;
  CameraSample& sample_;
  TilePoints& tile_;
  ShadowRays& shadows_;
  DataRecorder data_;

  Ray ray_;
  Vec3 beta_{1, 1, 1};
  float index_scale_ = 1;    // takes the eta^2 out of beta again
  float mis_pdf_ = 0;        // of the last scattered direction; 0: direct light had no part in it
  float light_samples_ = 1;  // of direct light where that was scattered
  Vec3 scattered_at_;        // where the ray got its direction
  float since_scatter_ = 0;  // distance from there to where it has come
  bool met_is_indirect_ = false;  // light that the ray meets
  bool lamps_known_ = false;  // those that the ray meets have been added already
  float share_ = 1;          // of that light; the rest is carried by photons
  float asked_ = 0;          // share of the caustic light for which photons are asked at surfaces before
  float path_length_ = 0;    // from the camera [m]
  bool camera_ray_ = true;   // not scattered yet
  bool waiting_ = false;     // the path has made its visible point
  bool final_ = false;       // the ray only looks for lights
  uint32_t depth_ = 0;
  int passes_ = 0;
};

// Follows paths to their ends, all of them a ray at a time: while one waits for a division or for memory another goes on.
void follow(const Scene& scene, std::vector<CameraPath>& paths, ShadowRays& shadows, RayCounts& counts) {
  std::vector<CameraPath*> going;
  for (CameraPath& path : paths) going.push_back(&path);
  std::vector<std::optional<Hit>> hits(paths.size());
  while (!going.empty()) {
    counts.camera += going.size();
    for (size_t i = 0; i < going.size(); ++i) hits[i] = scene.trace(going[i]->ray());
    size_t kept = 0;
    for (size_t i = 0; i < going.size(); ++i)
      if (going[i]->advance(hits[i])) going[kept++] = going[i];
    going.resize(kept);
    // So that a pixel's sum has the same order wherever the others are.
    shadows.finish();
  }
}

}  // namespace

uint64_t CameraSamples::memory() const {
  uint64_t bytes = pixels.capacity() * sizeof(CameraSample) + data.capacity() * sizeof(float);
  for (const auto& tile : tiles) bytes += tile.lobes.capacity() * sizeof(Lobe) + tile.glossy.capacity() * sizeof(GlossyPoint);
  return bytes;
}

bool run_camera_pass(const Scene& scene, const PathSettings& settings, uint64_t iteration, const Threads& threads,
                     const std::atomic<bool>& cancel, CameraSamples& samples, RayCounts& counts) {
  const Camera& camera = scene.camera;
  const uint64_t tiles = tile_count(camera.region_width, camera.region_height);
  samples.pixels.resize(camera.region_width * camera.region_height);
  samples.tiles.resize(tiles);
  const DataPasses& data = settings.data;
  // What is found once is found in the first iteration.
  const bool first = iteration == 0 && data.middle() > 0, has_records = data.any_averaged() || first;
  samples.data.resize(has_records ? samples.pixels.size() * data.size() : 0);
  std::vector<RayCounts> tile_counts(tiles);
  threads.for_each(tiles, [&](uint64_t tile) {
    TilePoints& points = samples.tiles[tile];
    points.lobes.clear(), points.glossy.clear();
    if (cancel.load(std::memory_order_relaxed)) return;
    ShadowRays shadows(scene, tile_counts[tile]);
    std::vector<CameraPath> paths;
    paths.reserve(kPathsTogether);
    const auto follow_all = [&] {
      follow(scene, paths, shadows, tile_counts[tile]);
      paths.clear();
    };
    visit_tile(tile, camera.region_width, camera.region_height, [&](uint64_t x, uint64_t y) {
      // Named by its place in the full image, so that a cropped render shows the same pixels.
      const uint64_t px = x + camera.region_x, py = y + camera.region_y, pixel = y * camera.region_width + x;
      const auto film_x = static_cast<float>(px), film_y = static_cast<float>(py);
      float* record = nullptr;
      if (has_records) {
        record = samples.data.data() + pixel * data.size();
        data.clear(record);
        if (first) record_middle(scene, data, film_x, film_y, record);
      }
      const Sampler sampler(hash64(settings.seed ^ kCameraStream, px << 32 | py), iteration);
      CameraSample& sample = samples.pixels[pixel];
      const uint8_t dark = iteration == 0 ? 0 : sample.dark_iterations;
      sample = CameraSample{};
      sample.dark_iterations = dark;
      paths.emplace_back(scene, settings, sampler, Vec2{film_x, film_y}, pixel, sample, points, shadows,
                         data.any_averaged() ? record : nullptr);
      if (paths.size() == kPathsTogether) follow_all();
    });
    follow_all();
    std::ranges::stable_sort(points.glossy, {}, &GlossyPoint::pixel);
    visit_tile(tile, camera.region_width, camera.region_height, [&](uint64_t x, uint64_t y) {
      const uint64_t pixel = y * camera.region_width + x;
      CameraSample& sample = samples.pixels[pixel];
      if (is_finite(sample.direct + sample.indirect) && is_finite(sample.point.weight) && is_finite(sample.point.p)) return;
      sample = CameraSample{};
      std::erase_if(points.glossy, [&](const GlossyPoint& g) { return g.pixel == pixel; });
      ++tile_counts[tile].dropped;
    });
  });
  for (const RayCounts& c : tile_counts) counts += c;
  return !cancel.load();
}

}  // namespace sppm
