#include <doctest/doctest.h>

#include <cmath>
#include <cstring>
#include <functional>
#include <string>
#include <vector>

#include "sppm/sppm.h"

namespace {

const float kPositions[] = {-1, -1, 0, 1, -1, 0, 0, 1, 0};
const uint32_t kIndices[] = {0, 1, 2};
const float kPixel[] = {1, 1, 1, 1};
const float kNan = std::nanf("");

template <typename Desc>
Desc blank() {
  Desc d{};
  d.struct_size = sizeof d;
  return d;
}

SppmImageDesc image() {
  auto d = blank<SppmImageDesc>();
  d.width = d.height = 1, d.pixels = kPixel;
  return d;
}

SppmMeshDesc mesh() {
  auto d = blank<SppmMeshDesc>();
  d.vertex_count = 3, d.triangle_count = 1, d.positions = kPositions, d.indices = kIndices;
  return d;
}

SppmLightDesc light() {
  auto d = blank<SppmLightDesc>();
  d.type = SPPM_LIGHT_POINT;
  d.transform[0] = d.transform[5] = d.transform[10] = 1;
  d.emission[0] = 1;
  return d;
}

SppmCameraDesc camera() {
  auto d = blank<SppmCameraDesc>();
  d.transform[0] = d.transform[5] = d.transform[10] = 1;
  d.window[0] = d.window[2] = -1, d.window[1] = d.window[3] = 1;
  d.clip_far = 10, d.width = 3, d.height = 2;
  return d;
}

SppmSettings settings() {
  auto d = blank<SppmSettings>();
  d.iterations = 2, d.max_depth = 4, d.filter_width = 1.5, d.gamma = 0.6, d.threads = 1;
  return d;
}

SppmClosureDesc closure() {
  auto d = blank<SppmClosureDesc>();
  d.type = SPPM_DIFFUSE;
  for (int c = 0; c < 3; ++c) d.weight.value[c] = 1, d.color.value[c] = 0.5f;
  return d;
}

// Fails, and says in which function and about what.
void refused(SppmStatus status, SppmStatus expected, const char* function, const char* about) {
  CHECK(status == expected);
  const std::string message = sppm_last_message();
  CHECK(message.find(function) == 0);
  INFO(message);
  CHECK(message.find(about) != std::string::npos);
}

// A scene that holds one of each, not committed.
struct Fixture {
  SppmScene* scene = nullptr;
  uint32_t material = 0, mesh_id = 0;

  Fixture() {
    REQUIRE(sppm_scene_create(&scene) == SPPM_OK);
    const SppmClosureDesc c = closure();
    auto m = blank<SppmMaterialDesc>();
    m.closure_count = 1, m.closures = &c;
    REQUIRE(sppm_scene_add_material(scene, &m, &material) == SPPM_OK);
    const SppmMeshDesc d = mesh();
    REQUIRE(sppm_scene_add_mesh(scene, &d, &mesh_id) == SPPM_OK);
    const SppmInstanceDesc i = instance();
    uint32_t id = 0;
    REQUIRE(sppm_scene_add_instance(scene, &i, &id) == SPPM_OK);
    const SppmLightDesc l = light();
    REQUIRE(sppm_scene_add_light(scene, &l, &id) == SPPM_OK);
    const SppmCameraDesc cam = camera();
    REQUIRE(sppm_scene_set_camera(scene, &cam) == SPPM_OK);
  }
  ~Fixture() { sppm_scene_destroy(scene); }
  SppmInstanceDesc instance() const {
    auto d = blank<SppmInstanceDesc>();
    d.mesh = mesh_id, d.material_count = 1, d.materials = &material;
    d.transform[0] = d.transform[5] = d.transform[10] = 1;
    return d;
  }
};

}  // namespace

TEST_CASE("the library tells its version and works with the Embree at hand") {
  CHECK(sppm_abi_version() == SPPM_ABI_VERSION);
  const std::string version = sppm_version();
  CHECK(version.find("Embree") != std::string::npos);
  CHECK(version.find("TBB") != std::string::npos);
  CHECK(sppm_self_test() == SPPM_OK);
}

TEST_CASE("null pointers are refused by every function") {
  constexpr auto bad = SPPM_INVALID_ARGUMENT;
  Fixture f;
  uint32_t id = 77;
  const auto im = image();
  const auto tex = blank<SppmTextureDesc>();
  const auto mat = blank<SppmMaterialDesc>();
  const auto me = mesh();
  const auto in = f.instance();
  const auto li = light();
  refused(sppm_scene_create(nullptr), bad, "sppm_scene_create", "scene");
  refused(sppm_scene_add_image(nullptr, &im, &id), bad, "sppm_scene_add_image", "scene");
  refused(sppm_scene_add_image(f.scene, nullptr, &id), bad, "sppm_scene_add_image", "desc");
  refused(sppm_scene_add_image(f.scene, &im, nullptr), bad, "sppm_scene_add_image", "id");
  refused(sppm_scene_add_texture(f.scene, nullptr, &id), bad, "sppm_scene_add_texture", "desc");
  refused(sppm_scene_add_texture(f.scene, &tex, nullptr), bad, "sppm_scene_add_texture", "id");
  refused(sppm_scene_add_material(f.scene, nullptr, &id), bad, "sppm_scene_add_material", "desc");
  refused(sppm_scene_add_material(f.scene, &mat, nullptr), bad, "sppm_scene_add_material", "id");
  refused(sppm_scene_add_mesh(f.scene, nullptr, &id), bad, "sppm_scene_add_mesh", "desc");
  refused(sppm_scene_add_mesh(f.scene, &me, nullptr), bad, "sppm_scene_add_mesh", "id");
  refused(sppm_scene_add_instance(f.scene, nullptr, &id), bad, "sppm_scene_add_instance", "desc");
  refused(sppm_scene_add_instance(f.scene, &in, nullptr), bad, "sppm_scene_add_instance", "id");
  refused(sppm_scene_add_light(f.scene, nullptr, &id), bad, "sppm_scene_add_light", "desc");
  refused(sppm_scene_add_light(f.scene, &li, nullptr), bad, "sppm_scene_add_light", "id");
  refused(sppm_scene_set_world(f.scene, nullptr), bad, "sppm_scene_set_world", "desc");
  refused(sppm_scene_set_camera(f.scene, nullptr), bad, "sppm_scene_set_camera", "desc");
  refused(sppm_scene_set_camera_motion(f.scene, nullptr, 2), bad, "sppm_scene_set_camera_motion", "desc");
  refused(sppm_scene_set_camera_motion(f.scene, nullptr, 0), bad, "sppm_scene_set_camera_motion", "key");
  refused(sppm_scene_commit(nullptr, 1), bad, "sppm_scene_commit", "scene");
  refused(sppm_scene_info(f.scene, nullptr), bad, "sppm_scene_info", "null");
  refused(sppm_scene_move_instance(nullptr, 1, nullptr), bad, "sppm_scene_move_instance", "scene");
  refused(sppm_scene_set_light(nullptr, 1, nullptr), bad, "sppm_scene_set_light", "scene");
  refused(sppm_scene_update(nullptr, 1), bad, "sppm_scene_update", "scene");
  refused(sppm_session_create(nullptr, nullptr, nullptr), bad, "sppm_session_create", "scene");
  refused(sppm_session_create(f.scene, nullptr, nullptr), bad, "sppm_session_create", "null");
  refused(sppm_session_step(nullptr), bad, "sppm_session_step", "session");
  refused(sppm_session_cancel(nullptr), bad, "sppm_session_cancel", "session");
  refused(sppm_session_progress(nullptr, nullptr), bad, "sppm_session_progress", "session");
  refused(sppm_session_read_pass(nullptr, 0, nullptr, 0), bad, "sppm_session_read_pass", "session");
  refused(sppm_session_write_exr(nullptr, "x"), bad, "sppm_session_write_exr", "session");
  refused(sppm_pass_channels(0, nullptr), bad, "sppm_pass_channels", "channels");
  refused(sppm_pass_channels(SPPM_PASS_COUNT, &id), bad, "sppm_pass_channels", "pass");
  CHECK(id == 77);  // untouched on failure
  sppm_scene_destroy(nullptr);
  sppm_session_destroy(nullptr);
}

TEST_CASE("structs of another size are refused") {
  Fixture f;
  uint32_t id = 0;
  auto im = image();
  im.struct_size = 0;
  refused(sppm_scene_add_image(f.scene, &im, &id), SPPM_INVALID_ARGUMENT, "sppm_scene_add_image", "struct_size is 0");
  auto c = camera();
  c.struct_size += 8;
  refused(sppm_scene_set_camera(f.scene, &c), SPPM_INVALID_ARGUMENT, "sppm_scene_set_camera", "struct_size");
  auto one = closure();
  one.struct_size = 1;
  auto m = blank<SppmMaterialDesc>();
  m.closure_count = 1, m.closures = &one;
  refused(sppm_scene_add_material(f.scene, &m, &id), SPPM_INVALID_ARGUMENT, "sppm_scene_add_material", "struct_size");
}

TEST_CASE("fields out of range are named") {
  Fixture f;
  uint32_t id = 0;
  const auto material = [&](const std::function<void(SppmClosureDesc&)>& mistake, const char* about) {
    auto c = closure();
    mistake(c);
    auto m = blank<SppmMaterialDesc>();
    m.closure_count = 1, m.closures = &c, m.name = "Glass";
    refused(sppm_scene_add_material(f.scene, &m, &id), SPPM_INVALID_ARGUMENT, "sppm_scene_add_material", about);
    CHECK(std::string(sppm_last_message()).find("Glass") != std::string::npos);
  };
  material([](auto& c) { c.color.value[1] = kNan; }, "color");
  material([](auto& c) { c.weight.value[0] = -1; }, "weight");
  material([](auto& c) { c.roughness.value[0] = 2; }, "roughness");
  material([](auto& c) { c.color.texture = 9; }, "texture 9");
  material([](auto& c) { c.type = 0; }, "type");
  material([](auto& c) { c.type = SPPM_DIELECTRIC; }, "ior");
  auto many = blank<SppmMaterialDesc>();
  many.closure_count = 17;
  refused(sppm_scene_add_material(f.scene, &many, &id), SPPM_INVALID_ARGUMENT, "sppm_scene_add_material", "closure_count");

  const auto lamp = [&](const std::function<void(SppmLightDesc&)>& mistake, const char* about) {
    auto d = light();
    mistake(d);
    refused(sppm_scene_add_light(f.scene, &d, &id), SPPM_INVALID_ARGUMENT, "sppm_scene_add_light", about);
  };
  lamp([](auto& d) { d.type = 0; }, "type");
  lamp([](auto& d) { d.emission[2] = kNan; }, "emission");
  lamp([](auto& d) { d.emission[2] = -1; }, "emission");
  lamp([](auto& d) { d.radius = kNan; }, "radius");
  lamp([](auto& d) { d.transform[10] = 0; }, "transform");
  lamp([](auto& d) { d.type = SPPM_LIGHT_SPOT; }, "angle");
  lamp([](auto& d) { d.type = SPPM_LIGHT_SPOT, d.angle = 1, d.blend = kNan; }, "blend");
  lamp([](auto& d) { d.type = SPPM_LIGHT_RECTANGLE, d.size_x = -1; }, "size_x");

  auto in = f.instance();
  in.mesh = 5;
  refused(sppm_scene_add_instance(f.scene, &in, &id), SPPM_INVALID_ARGUMENT, "sppm_scene_add_instance", "mesh 5");
  in = f.instance(), in.material_count = 0;
  refused(sppm_scene_add_instance(f.scene, &in, &id), SPPM_INVALID_ARGUMENT, "sppm_scene_add_instance", "material_count");
  in = f.instance(), in.motion_count = 2;
  refused(sppm_scene_add_instance(f.scene, &in, &id), SPPM_INVALID_ARGUMENT, "sppm_scene_add_instance", "motion");
  in = f.instance(), in.flags = 4;
  refused(sppm_scene_add_instance(f.scene, &in, &id), SPPM_INVALID_ARGUMENT, "sppm_scene_add_instance", "flags");
  in = f.instance(), in.transform[3] = kNan;
  refused(sppm_scene_add_instance(f.scene, &in, &id), SPPM_INVALID_ARGUMENT, "sppm_scene_add_instance", "transform");

  auto world = blank<SppmWorldDesc>();
  world.image = 3;
  refused(sppm_scene_set_world(f.scene, &world), SPPM_INVALID_ARGUMENT, "sppm_scene_set_world", "image 3");
  world = blank<SppmWorldDesc>(), world.radiance[0] = kNan;
  refused(sppm_scene_set_world(f.scene, &world), SPPM_INVALID_ARGUMENT, "sppm_scene_set_world", "radiance");
  refused(sppm_scene_commit(f.scene, 5000), SPPM_INVALID_ARGUMENT, "sppm_scene_commit", "threads");
}

TEST_CASE("calls at the wrong time are refused") {
  Fixture f;
  const auto s = settings();
  SppmSession* session = nullptr;
  auto info = blank<SppmSceneInfo>();
  refused(sppm_session_create(f.scene, &s, &session), SPPM_INVALID_STATE, "sppm_session_create", "committed");
  refused(sppm_scene_info(f.scene, &info), SPPM_INVALID_STATE, "sppm_scene_info", "committed");
  const auto l = light();
  const float transform[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
  refused(sppm_scene_move_instance(f.scene, 1, transform), SPPM_INVALID_STATE, "sppm_scene_move_instance", "committed");
  refused(sppm_scene_set_light(f.scene, 1, &l), SPPM_INVALID_STATE, "sppm_scene_set_light", "committed");
  refused(sppm_scene_update(f.scene, 1), SPPM_INVALID_STATE, "sppm_scene_update", "committed");
  REQUIRE(sppm_scene_commit(f.scene, 1) == SPPM_OK);
  refused(sppm_scene_commit(f.scene, 1), SPPM_INVALID_STATE, "sppm_scene_commit", "committed");
  uint32_t id = 0;
  refused(sppm_scene_add_light(f.scene, &l, &id), SPPM_INVALID_STATE, "sppm_scene_add_light", "committed");
  CHECK(sppm_scene_info(f.scene, &info) == SPPM_OK);
  CHECK(info.triangle_count == 1);
  const auto c = camera();
  CHECK(sppm_scene_set_camera(f.scene, &c) == SPPM_OK);
  CHECK(sppm_scene_set_light(f.scene, 1, &l) == SPPM_OK);
  CHECK(sppm_scene_update(f.scene, 1) == SPPM_OK);

  SppmScene* bare = nullptr;
  REQUIRE(sppm_scene_create(&bare) == SPPM_OK);
  refused(sppm_scene_commit(bare, 1), SPPM_INVALID_STATE, "sppm_scene_commit", "camera");
  sppm_scene_destroy(bare);
}

TEST_CASE("settings out of range are named") {
  Fixture f;
  REQUIRE(sppm_scene_commit(f.scene, 1) == SPPM_OK);
  const std::pair<std::function<void(SppmSettings&)>, const char*> mistakes[] = {
      {[](auto& s) { s.iterations = 0; }, "iterations"},       {[](auto& s) { s.gamma = 1; }, "gamma"},
      {[](auto& s) { s.alpha_threshold = 2; }, "alpha_threshold"}, {[](auto& s) { s.mist_depth = -1; }, "mist_depth"},
      {[](auto& s) { s.mist_power = -1; }, "mist_power"},      {[](auto& s) { s.origin[1] = std::nan(""); }, "origin"},
      {[](auto& s) { s.gamma = std::nan(""); }, "gamma"},      {[](auto& s) { s.max_depth = 0; }, "max_depth"},
      {[](auto& s) { s.max_depth = 5000; }, "max_depth"},      {[](auto& s) { s.filter_width = 0; }, "filter_width"},
      {[](auto& s) { s.pixel_filter = 2; }, "pixel_filter"},   {[](auto& s) { s.initial_radius = -1; }, "initial_radius"},
      {[](auto& s) { s.time_limit = -1; }, "time_limit"},      {[](auto& s) { s.threads = 5000; }, "threads"},
      {[](auto& s) { s.photons_per_iteration = ~0ull; }, "photons_per_iteration"}};
  for (const auto& [mistake, about] : mistakes) {
    auto s = settings();
    mistake(s);
    SppmSession* session = nullptr;
    refused(sppm_session_create(f.scene, &s, &session), SPPM_INVALID_ARGUMENT, "sppm_session_create", about);
    CHECK(session == nullptr);
  }
}

TEST_CASE("passes are read with the exact count, and only those asked for") {
  Fixture f;
  REQUIRE(sppm_scene_commit(f.scene, 1) == SPPM_OK);
  auto s = settings();
  s.passes = 1u << SPPM_PASS_DEPTH;
  SppmSession* session = nullptr;
  REQUIRE(sppm_session_create(f.scene, &s, &session) == SPPM_OK);
  sppm_scene_destroy(f.scene);  // the session keeps it
  f.scene = nullptr;
  std::vector<float> out(3 * 2 * 4, 1);
  CHECK(sppm_session_read_pass(session, SPPM_PASS_COMBINED, out.data(), out.size()) == SPPM_OK);
  for (float x : out) CHECK(x == 0);  // before the first iteration
  refused(sppm_session_read_pass(session, SPPM_PASS_COMBINED, out.data(), 7), SPPM_INVALID_ARGUMENT, "sppm_session_read_pass",
          "count is 7, must be 24");
  refused(sppm_session_read_pass(session, SPPM_PASS_NORMAL, out.data(), 18), SPPM_INVALID_ARGUMENT, "sppm_session_read_pass", "Normal");
  refused(sppm_session_read_pass(session, 99, out.data(), 18), SPPM_INVALID_ARGUMENT, "sppm_session_read_pass", "pass");
  refused(sppm_session_read_pass(session, 0, nullptr, 24), SPPM_INVALID_ARGUMENT, "sppm_session_read_pass", "out");
  refused(sppm_session_write_exr(session, "/nonexistent/x.exr"), SPPM_IO_ERROR, "sppm_session_write_exr", "/nonexistent/x.exr");
  for (int i = 1; i <= 3; ++i) {  // one more than asked for
    CHECK(sppm_session_step(session) == SPPM_OK);
    auto progress = blank<SppmProgress>();
    CHECK(sppm_session_progress(session, &progress) == SPPM_OK);
    CHECK(progress.iteration == static_cast<uint64_t>(i));
    CHECK(progress.photons_emitted == static_cast<uint64_t>(6 * i));
    CHECK((progress.finished != 0) == (i >= 2));
  }
  sppm_session_destroy(session);
}

TEST_CASE("the number of channels of each pass") {
  const uint32_t expected[SPPM_PASS_COUNT] = {4, 1, 3, 3, 3, 3, 1, 1, 3, 3, 1, 1, 1, 3, 3, 3, 3, 3};
  for (uint32_t pass = 0; pass < SPPM_PASS_COUNT; ++pass) {
    uint32_t channels = 0;
    CHECK(sppm_pass_channels(pass, &channels) == SPPM_OK);
    CHECK(channels == expected[pass]);
  }
}
