#include "fuzz_scene.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace {

template <typename Desc>
Desc blank() {
  Desc d{};
  d.struct_size = sizeof d;
  return d;
}

constexpr uint32_t kSlots = 3;

}  // namespace

FuzzScene::FuzzScene(Chance& chance, bool scrambled) : chance_(chance), scrambled_(scrambled) {
  if (!accept(sppm_scene_create(&scene_))) return;
  scale_ = chance.magnitude(-4, 4);
  if (chance.one_in(3))
    for (float& c : center_) c = chance.around_zero(scale_ * chance.magnitude(0, 5));
  const auto times = [&](uint32_t most, void (FuzzScene::*add)()) {
    for (uint32_t n = chance.below(most + 1); n > 0; --n) (this->*add)();
  };
  times(2, &FuzzScene::add_image);
  times(8, &FuzzScene::add_texture);
  times(4, &FuzzScene::add_material);
  times(4, &FuzzScene::add_mesh);
  times(6, &FuzzScene::add_instance);
  times(4, &FuzzScene::add_light);
  if (chance.one_in(2)) set_world();
  set_camera();
  const SppmStatus status = sppm_scene_commit(scene_, chance.below(3));
  committed_ = accept(status);
}

FuzzScene::~FuzzScene() { sppm_scene_destroy(scene_); }

bool FuzzScene::accept(SppmStatus status) {
  const bool refused = status == SPPM_INVALID_ARGUMENT || status == SPPM_INVALID_STATE;
  if (status != SPPM_OK && !(refused && scrambled_) && problem_.empty())
    problem_ = "status " + std::to_string(status) + ", " + sppm_last_message();
  return status == SPPM_OK;
}

void FuzzScene::place(float (&point)[3]) {
  for (int i = 0; i < 3; ++i) point[i] = center_[i] + chance_.around_zero(scale_);
}

// Rigid, or with scales that may mirror or squeeze flat.
void FuzzScene::transform(float (&m)[12], bool rigid) {
  const float a = chance_.around_zero(3.2f), b = chance_.one_in(2) ? chance_.around_zero(3.2f) : 0;
  const float axes[3][3] = {{std::cos(a), std::sin(a) * std::cos(b), std::sin(a) * std::sin(b)},
                            {-std::sin(a), std::cos(a) * std::cos(b), std::cos(a) * std::sin(b)},
                            {0, -std::sin(b), std::cos(b)}};
  float at[3];
  place(at);
  for (int column = 0; column < 3; ++column) {
    const float s = rigid ? 1 : chance_.any_of({1.0f, 1.0f, 1.0f, -1.0f, 0.0f, 1e-6f, 100.0f, chance_.magnitude(-2, 2)});
    for (int row = 0; row < 3; ++row) m[4 * row + column] = axes[column][row] * s;
  }
  for (int row = 0; row < 3; ++row) m[4 * row + 3] = at[row];
}

std::vector<float> FuzzScene::motion(bool rigid) {
  std::vector<float> places;
  for (uint32_t keys = chance_.one_in(3) ? chance_.below(4) : 0; keys > 0; --keys) {
    float m[12];
    transform(m, rigid);
    places.insert(places.end(), m, m + 12);
  }
  if (scramble()) chance_.scramble_element(places);
  return places;
}

void FuzzScene::color(float (&c)[3], float most) {
  const float level = chance_.any_of({0.0f, 1.0f, most, most * chance_.from_to(0, 1)});
  for (float& x : c) x = chance_.one_in(4) ? 0 : level * (chance_.one_in(2) ? 1 : chance_.from_to(0, 1));
}

SppmParam FuzzScene::param(float most) {
  SppmParam p{};
  color(p.value, most);
  if (textures_ > 0 && chance_.one_in(3)) p.texture = 1 + chance_.below(textures_);
  return p;
}

SppmClosureDesc FuzzScene::closure() {
  auto c = blank<SppmClosureDesc>();
  c.type = 1 + chance_.below(6);
  c.flags = chance_.below(16);
  c.weight = param(1);
  c.color = param(c.type == SPPM_EMISSION ? chance_.magnitude(-6, 6) : chance_.one_in(10) ? 3 : 1);
  c.color2 = param(1);
  c.roughness = param(1);
  if (chance_.one_in(2)) c.roughness.value[0] = chance_.any_of({0.0f, 1e-3f, 0.009f, 0.011f, 0.05f, 1.0f});
  c.ior = chance_.any_of({1.5f, 1.0f, 0.5f, 3.0f, 1.33f, 1.0001f, 100.0f, 1e-3f});
  if (scramble()) chance_.scramble(c);
  return c;
}

void FuzzScene::add_image() {
  auto d = blank<SppmImageDesc>();
  d.width = 1 + chance_.below(9), d.height = 1 + chance_.below(9);
  std::vector<float> floats(d.width * d.height * 4);
  std::vector<uint8_t> bytes(floats.size());
  for (float& x : floats) x = chance_.any_of({0.0f, 1.0f, -1.0f, chance_.from_to(0, 1), chance_.magnitude(-6, 6)});
  for (uint8_t& x : bytes) x = static_cast<uint8_t>(chance_.bits());
  d.encoding = chance_.below(2);
  if (scramble()) chance_.scramble(d, &SppmImageDesc::width, &SppmImageDesc::height, &SppmImageDesc::name);
  if (scramble()) chance_.scramble_element(floats);
  d.pixels = nullptr, d.pixels_u8 = nullptr;
  if (!scramble() || chance_.one_in(2)) (chance_.one_in(2) ? (void)(d.pixels = floats.data()) : (void)(d.pixels_u8 = bytes.data()));
  uint32_t id = 0;
  if (accept(sppm_scene_add_image(scene_, &d, &id))) images_ = id;
}

void FuzzScene::add_texture() {
  auto d = blank<SppmTextureDesc>();
  d.type = chance_.below(5);
  if (images_ == 0 && (d.type == SPPM_TEXTURE_IMAGE || d.type == SPPM_TEXTURE_IMAGE_ALPHA)) d.type = SPPM_TEXTURE_CONSTANT;
  if (textures_ == 0 && d.type == SPPM_TEXTURE_MIX) d.type = SPPM_TEXTURE_ATTRIBUTE;
  for (float& v : d.value) v = chance_.around_zero(2);
  if (images_ > 0) d.image = 1 + chance_.below(images_);
  d.interpolation = chance_.below(2), d.extension = chance_.below(4), d.blend = chance_.below(8);
  if (chance_.one_in(3)) transform(d.mapping, false);
  if (textures_ > 0)
    for (uint32_t* child : {&d.a, &d.b, &d.factor}) *child = 1 + chance_.below(textures_);
  if (scramble()) chance_.scramble(d);
  uint32_t id = 0;
  if (accept(sppm_scene_add_texture(scene_, &d, &id))) textures_ = id;
}

void FuzzScene::add_material() {
  std::vector<SppmClosureDesc> closures(chance_.one_in(10) ? 16 : chance_.below(5));
  for (SppmClosureDesc& c : closures) c = closure();
  auto d = blank<SppmMaterialDesc>();
  d.closure_count = closures.size(), d.closures = closures.data(), d.name = "fuzz";
  uint32_t id = 0;
  if (accept(sppm_scene_add_material(scene_, &d, &id))) materials_ = id;
}

void FuzzScene::add_mesh() {
  auto d = blank<SppmMeshDesc>();
  d.vertex_count = 3 + chance_.below(40), d.triangle_count = 1 + chance_.below(60), d.corner_count = 1 + chance_.below(30);
  std::vector<float> positions, normals(3 * d.corner_count), uvs(2 * d.corner_count), colors(3 * d.corner_count);
  const float thickness = chance_.any_of({1.0f, 1.0f, 0.0f, 1e-6f});
  for (uint64_t v = 0; v < d.vertex_count; ++v) {
    float p[3];
    place(p);
    p[2] = center_[2] + (p[2] - center_[2]) * thickness;
    positions.insert(positions.end(), p, p + 3);
  }
  std::vector<uint32_t> indices, corners, slots(d.triangle_count);
  for (uint64_t i = 0; i < 3 * d.triangle_count; ++i) {  // some triangles use a vertex twice, some come twice
    indices.push_back(chance_.below(static_cast<uint32_t>(d.vertex_count)));
    corners.push_back(chance_.below(static_cast<uint32_t>(d.corner_count)));
  }
  for (uint32_t& s : slots) s = chance_.below(kSlots);
  for (float& n : normals) n = chance_.any_of({0.0f, 1.0f, chance_.around_zero(1)});
  for (float& u : uvs) u = chance_.around_zero(chance_.any_of({1.0f, 1e6f}));
  for (float& c : colors) c = chance_.from_to(-0.1f, 1);
  if (scramble()) chance_.scramble_element(positions), chance_.scramble_element(normals), chance_.scramble_element(uvs);
  if (scramble()) chance_.scramble_element(indices), chance_.scramble_element(corners), chance_.scramble_element(slots);
  const auto given = [&](auto& values) { return chance_.one_in(2) ? values.data() : nullptr; };
  d.positions = positions.data(), d.indices = indices.data(), d.corners = corners.data();
  d.corner_normals = given(normals), d.corner_uvs = given(uvs), d.corner_colors = given(colors), d.material_slots = given(slots);
  if (scramble()) d.positions = nullptr;
  if (scramble()) d.corners = nullptr;
  uint32_t id = 0;
  if (accept(sppm_scene_add_mesh(scene_, &d, &id))) meshes_ = id;
}

void FuzzScene::add_instance() {
  if (meshes_ == 0 || materials_ == 0) return;
  auto d = blank<SppmInstanceDesc>();
  std::vector<uint32_t> materials(kSlots);
  for (uint32_t& m : materials) m = 1 + chance_.below(materials_);
  d.mesh = 1 + chance_.below(meshes_), d.material_count = kSlots, d.materials = materials.data();
  d.flags = chance_.one_in(3) ? chance_.below(4) : 0, d.index = chance_.below(40000);
  transform(d.transform, false);
  if (chance_.one_in(2)) std::fill(d.transform, d.transform + 12, 0.0f), d.transform[0] = d.transform[5] = d.transform[10] = 1;
  if (scramble()) chance_.scramble(d, &SppmInstanceDesc::material_count, &SppmInstanceDesc::materials, &SppmInstanceDesc::name,
                                      &SppmInstanceDesc::motion_count, &SppmInstanceDesc::motion);
  if (scramble()) chance_.scramble_element(materials);
  d.movable = chance_.below(2);
  const std::vector<float> places = motion(false);
  d.motion_count = static_cast<uint32_t>(places.size() / 12), d.motion = places.data();
  uint32_t id = 0;
  if (accept(sppm_scene_add_instance(scene_, &d, &id)) && d.movable) movable_.push_back(id);
}

void FuzzScene::move() {
  for (const uint32_t id : movable_) {
    float m[12];
    transform(m, false);
    if (scramble()) m[chance_.below(12)] = std::numeric_limits<float>::quiet_NaN();
    accept(sppm_scene_move_instance(scene_, id, m));
  }
  accept(sppm_scene_update(scene_, chance_.below(3)));
}

void FuzzScene::add_light() {
  auto d = blank<SppmLightDesc>();
  d.type = 1 + chance_.below(5), d.flags = chance_.below(8);
  transform(d.transform, true);
  color(d.emission, chance_.magnitude(-9, 9));
  d.radius = chance_.one_in(2) ? 0 : length();
  d.angle = chance_.any_of({1e-3f, 0.01f, 0.5f, 3.1f}), d.blend = chance_.from_to(0, 1);
  d.size_x = chance_.one_in(5) ? 0 : length(), d.size_y = length();
  if (scramble()) chance_.scramble(d, &SppmLightDesc::name, &SppmLightDesc::motion_count, &SppmLightDesc::motion);
  const std::vector<float> places = motion(true);
  d.motion_count = static_cast<uint32_t>(places.size() / 12), d.motion = places.data();
  uint32_t id = 0;
  accept(sppm_scene_add_light(scene_, &d, &id));
}

void FuzzScene::set_world() {
  auto d = blank<SppmWorldDesc>();
  color(d.radiance, chance_.magnitude(-6, 6));
  d.image = chance_.below(images_ + 1);
  if (chance_.one_in(2)) d.rotation[1] = 1, d.rotation[3] = -1, d.rotation[8] = 1;
  d.hidden_from_camera = chance_.below(2);
  if (scramble()) chance_.scramble(d);
  accept(sppm_scene_set_world(scene_, &d));
}

void FuzzScene::set_camera() {
  auto d = blank<SppmCameraDesc>();
  d.projection = chance_.below(2);
  transform(d.transform, true);
  const float width = chance_.magnitude(-3, 1) * (d.projection == SPPM_ORTHOGRAPHIC ? scale_ : 1), shift = chance_.around_zero(width);
  d.window[0] = shift - width, d.window[1] = shift + width, d.window[2] = -width, d.window[3] = width * chance_.magnitude(-1, 1);
  d.clip_near = chance_.one_in(2) ? 0 : length(), d.clip_far = d.clip_near + length() * chance_.magnitude(0, 6);
  if (chance_.one_in(2)) d.aperture_radius = length(), d.aperture_ratio = chance_.from_to(0, 3), d.focal_distance = length();
  d.width = 1 + chance_.below(24), d.height = 1 + chance_.below(24);
  if (chance_.one_in(3)) d.region_x = d.width / 2, d.region_width = d.width - d.region_x, d.region_height = d.height;
  if (scramble()) chance_.scramble(d, &SppmCameraDesc::width, &SppmCameraDesc::height);
  if (!accept(sppm_scene_set_camera(scene_, &d))) return;
  pixels_ = d.region_width == 0 ? d.width * d.height : d.region_width * d.region_height;
  if (chance_.one_in(3)) set_camera_motion(d);
}

// Keys that turn, zoom and focus; they are alike in what a picture cannot change on its way.
void FuzzScene::set_camera_motion(const SppmCameraDesc& camera) {
  std::vector<SppmCameraDesc> keys(1 + chance_.below(3), camera);
  for (SppmCameraDesc& key : keys) {
    transform(key.transform, true);
    const float zoom = chance_.magnitude(-1, 1);
    for (float& edge : key.window) edge *= zoom;
    if (chance_.one_in(2)) key.aperture_radius = length(), key.focal_distance = length();
    if (scramble()) chance_.scramble(key, &SppmCameraDesc::width, &SppmCameraDesc::height);
  }
  accept(sppm_scene_set_camera_motion(scene_, keys.data(), static_cast<uint32_t>(keys.size())));
}

SppmSettings FuzzScene::settings() {
  auto s = blank<SppmSettings>();
  s.iterations = 1 + chance_.below(3), s.photons_per_iteration = chance_.any_of({0u, 1u, 100u, 5000u});
  s.initial_radius = chance_.one_in(2) ? 0 : static_cast<double>(length());
  s.max_depth = chance_.any_of({1u, 2u, 8u, 24u, 200u});
  s.pixel_filter = chance_.below(2), s.filter_width = static_cast<double>(chance_.magnitude(-2, 2));
  s.gamma = static_cast<double>(chance_.any_of({0.01f, 0.5f, 0.666f, 0.999f}));
  s.seed = chance_.bits(), s.threads = 1 + chance_.below(3), s.transparent_film = chance_.below(2);
  s.passes = (1u << SPPM_PASS_COUNT) - 1;
  s.alpha_threshold = chance_.any_of({0.0f, 0.5f, 1.0f}), s.mist_start = chance_.around_zero(length()), s.mist_depth = length();
  s.mist_power = chance_.any_of({1.0f, 2.0f, 0.5f, 0.0f});
  if (scramble())
    chance_.scramble(s, &SppmSettings::photons_per_iteration, &SppmSettings::threads, &SppmSettings::passes, &SppmSettings::write_interval,
                     &SppmSettings::snapshot_path);
  return s;
}
