// What may change in a committed scene: places, lamps, the camera, each set from outside or by the time in the shutter.
#include <algorithm>
#include <cmath>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "scene.h"
#include "status.h"

namespace sppm {
namespace {

Affine to_affine(const float* m, const std::string& where) {
  Affine transform;
  for (size_t i = 0; i < transform.m.size(); ++i) require(std::isfinite(m[i]), where + "transform must be finite");
  std::copy(m, m + transform.m.size(), transform.m.begin());
  return transform;
}

Motion to_motion(const float* keys, uint32_t count, const std::string& where) {
  require(keys != nullptr, where + "motion is null");
  std::vector<Affine> places;
  for (uint32_t k = 0; k < count; ++k) places.push_back(to_affine(keys + 12 * k, where + "motion: "));
  return Motion(places);
}

// What lies between two keys, or the nearer key where they are so unlike that in floats nothing between them can be used: an axis that
// is mirrored has no length half way. What was accepted must not stop a render later.
template <typename Between, typename Key>
auto between_or_key(Between between, Key key) {
  try {
    return between();
  } catch (const Error&) {
    return key();
  }
}

// What of a camera changes from one key to the next.
SppmCameraDesc between(const SppmCameraDesc& a, const SppmCameraDesc& b, const Affine& transform, float share) {
  SppmCameraDesc d = a;
  const auto mix = [share](float& value, float next) { value += (next - value) * share; };
  std::copy(transform.m.begin(), transform.m.end(), d.transform);
  for (int i = 0; i < 4; ++i) mix(d.window[i], b.window[i]);
  mix(d.clip_near, b.clip_near), mix(d.clip_far, b.clip_far);
  const auto ratio = [](float r) { return r > 0 ? r : 1; };
  d.aperture_ratio = ratio(a.aperture_ratio);
  mix(d.aperture_radius, b.aperture_radius), mix(d.aperture_ratio, ratio(b.aperture_ratio)), mix(d.focal_distance, b.focal_distance);
  return d;
}

}  // namespace

void Scene::set_camera(const SppmCameraDesc& desc) {
  camera = Camera(desc);
  camera_keys_.clear();
  camera_motion_ = {};
  has_camera_ = true;
}

void Scene::set_camera_motion(std::span<const SppmCameraDesc> keys) {
  require(!keys.empty(), "camera: there must be a key");
  std::vector<Affine> places;
  for (const SppmCameraDesc& key : keys) {
    const Camera looks_through(key), first(keys[0]);
    require(key.projection == keys[0].projection && key.width == keys[0].width && key.height == keys[0].height &&
                looks_through.region_x == first.region_x && looks_through.region_y == first.region_y &&
                looks_through.region_width == first.region_width && looks_through.region_height == first.region_height,
            "camera: projection, size and region must be the same in all keys");
    places.push_back(to_affine(key.transform, "camera: "));
  }
  set_camera(keys[0]);
  if (keys.size() < 2) return;
  camera_keys_.assign(keys.begin(), keys.end());
  camera_motion_ = Motion(places);
}

void Scene::add_motion(uint32_t instance, const SppmInstanceDesc& desc, const std::string& where) {
  if (desc.motion_count > 0) moving_instances_.push_back({instance, to_motion(desc.motion, desc.motion_count, where)});
}

std::optional<Scene::MovingLamp> Scene::moving_lamp(const SppmLightDesc& desc) {
  if (desc.motion_count == 0) return std::nullopt;
  const std::string where = std::string("light '") + (desc.name ? desc.name : "") + "': ";
  SppmLightDesc still = desc;
  for (uint32_t k = 0; desc.motion && k < desc.motion_count; ++k) {
    SppmLightDesc key = desc;
    std::copy_n(desc.motion + 12 * k, 12, key.transform);
    Lamp{key};  // is checked here and not in the middle of a render
  }
  still.motion = nullptr, still.motion_count = 0, still.name = nullptr;  // the caller's memory
  return MovingLamp{0, still, to_motion(desc.motion, desc.motion_count, where)};
}

uint32_t Scene::add_lamp(const SppmLightDesc& desc) {
  std::optional<MovingLamp> moving = moving_lamp(desc);
  const uint32_t id = lights.add_lamp(desc);
  if (moving) moving->id = id, moving_lamps_.push_back(*std::move(moving));
  return id;
}

void Scene::move_instance(uint32_t id, const float transform[12]) {
  require(id >= 1 && id <= instances_.size(), "instance " + std::to_string(id) + " is not of this scene");
  require(instances_[id - 1].movable, "instance " + std::to_string(id) + " was added without `movable`");
  const Affine place = to_affine(transform, "instance " + std::to_string(id) + ": ");
  std::erase_if(moving_instances_, [id](const MovingInstance& m) { return m.index == id - 1; });
  move(id - 1, place);
}

void Scene::move(uint32_t index, const Affine& place) {
  instances_[index].placed = place;
  moved_instances_.push_back(index);
}

void Scene::set_lamp(uint32_t id, const SppmLightDesc& desc) {
  std::optional<MovingLamp> moving = moving_lamp(desc);
  require(lights.has_lamp(id), "light " + std::to_string(id) + " is not of this scene");
  changed_lamps_.emplace_back(id, Lamp(desc));
  std::erase_if(moving_lamps_, [id](const MovingLamp& m) { return m.id == id; });
  if (moving) moving->id = id, moving_lamps_.push_back(*std::move(moving));
}

void Scene::update(const Threads& threads) {
  std::sort(moved_instances_.begin(), moved_instances_.end());
  moved_instances_.erase(std::unique(moved_instances_.begin(), moved_instances_.end()), moved_instances_.end());
  bool lights_change = !changed_lamps_.empty();
  for (const auto& [id, lamp] : changed_lamps_) lights.set_lamp(id, lamp);
  for (const uint32_t i : moved_instances_) {
    settle(instances_[i]);
    if (instances_[i].identity) meshes_[instances_[i].mesh]->make_facets(threads);
    collect_emitters(instances_[i]);
    lights_change |= instances_[i].light != kNone || !instances_[i].casters.empty();
  }
  threads.for_each(1, [&](uint64_t) {
    for (const uint32_t i : moved_instances_) accel_.place(i, placement(instances_[i]));
    if (!moved_instances_.empty()) accel_.commit();
  });
  // The sun and the world shine on the whole scene.
  if (lights_change || lit_bounds_ != accel_.bounds()) commit_lights();
  moved_instances_.clear();
  changed_lamps_.clear();
}

void Scene::set_time(double time, const Threads& threads) {
  for (const MovingInstance& m : moving_instances_) move(m.index, m.motion.at(time));
  for (const MovingLamp& m : moving_lamps_) {
    const auto lamp_at = [&m](const Affine& place) {
      SppmLightDesc lamp = m.lamp;
      std::copy(place.m.begin(), place.m.end(), lamp.transform);
      return Lamp(lamp);
    };
    changed_lamps_.emplace_back(m.id, between_or_key([&] { return lamp_at(m.motion.at(time)); },
                                                     [&] { return lamp_at(m.motion.key_near(time)); }));
  }
  if (!camera_keys_.empty()) {
    const KeyTime t(time, camera_keys_.size());
    camera = between_or_key(
        [&] { return Camera(between(camera_keys_[t.key], camera_keys_[t.key + 1], camera_motion_.at(time), static_cast<float>(t.share))); },
        [&] { return Camera(camera_keys_[t.nearest()]); });
  }
  update(threads);
}

}  // namespace sppm
