// What is moved in a committed scene, or moves while the shutter is open, renders, to the bits, as a scene that was built so.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <thread>
#include <vector>

#include "closures.h"
#include "pass_info.h"
#include "scene.h"
#include "session.h"
#include "status.h"

using namespace sppm;

namespace {

constexpr uint64_t kSide = 16;

SppmMaterialDesc material_of(const SppmClosureDesc& closure) {
  SppmMaterialDesc m{};
  m.struct_size = sizeof m;
  m.closure_count = 1, m.closures = &closure;
  return m;
}

// The box from -half to half.
uint32_t add_box(Scene& scene, float half) {
  std::vector<float> positions;
  for (int i = 0; i < 8; ++i)
    for (const int axis : {1, 2, 4}) positions.push_back(i & axis ? half : -half);
  const uint32_t indices[] = {0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6, 0, 1, 5, 0, 5, 4, 2, 6, 7, 2, 7, 3, 0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5};
  SppmMeshDesc d{};
  d.struct_size = sizeof d;
  d.vertex_count = 8, d.triangle_count = 12, d.positions = positions.data(), d.indices = indices;
  return scene.add_mesh(d);
}

uint32_t add_instance(Scene& scene, uint32_t mesh, uint32_t material, const Affine& transform, bool movable,
                      const std::vector<float>& way = {}) {
  SppmInstanceDesc i{};
  i.struct_size = sizeof i;
  i.mesh = mesh, i.material_count = 1, i.materials = &material, i.movable = movable;
  std::copy(transform.m.begin(), transform.m.end(), i.transform);
  i.motion = way.data(), i.motion_count = static_cast<uint32_t>(way.size() / 12);
  return scene.add_instance(i);
}

// Turned about z, scaled, moved.
Affine place(Vec3 at, Vec3 scale = {1, 1, 1}) {
  const float c = 0.8f, s = 0.6f;
  return {{c * scale.x, -s * scale.y, 0, at.x, s * scale.x, c * scale.y, 0, at.y, 0, 0, scale.z, at.z}};
}

// Where everything stands that can move.
struct Places {
  Affine glass, block, glow;  // the block has a twin of the same mesh that stands still
  Vec3 lamp;
  SppmLightType lamp_type = SPPM_LIGHT_POINT;
  float camera = 0.8f;
};

const Places kStart{place({0.3f, -0.4f, -0.2f}), place({-0.5f, 0.2f, -0.5f}), place({0.4f, 0.5f, 0.3f}), {-0.2f, 0.7f, 0.1f}};

// The way from one set of places to another, of those that move.
struct Ways {
  std::vector<float> glass, glow, lamp;
  Ways(const Places& from, const Places& to) {
    for (const Places* p : {&from, &to}) {
      glass.insert(glass.end(), p->glass.m.begin(), p->glass.m.end());
      glow.insert(glow.end(), p->glow.m.begin(), p->glow.m.end());
      const float at[12] = {1, 0, 0, p->lamp.x, 0, 1, 0, p->lamp.y, 0, 0, 1, p->lamp.z};
      lamp.insert(lamp.end(), at, at + 12);
    }
  }
};

SppmLightDesc lamp(const Places& p) {
  SppmLightDesc d{};
  d.struct_size = sizeof d;
  d.type = p.lamp_type, d.radius = 0.1f, d.size_x = d.size_y = 0.2f;
  d.transform[0] = d.transform[5] = d.transform[10] = 1, d.transform[3] = p.lamp.x, d.transform[7] = p.lamp.y, d.transform[11] = p.lamp.z;
  for (float& e : d.emission) e = 1;
  return d;
}

SppmCameraDesc camera(const Places& p) {
  SppmCameraDesc d{};
  d.struct_size = sizeof d;
  d.transform[0] = d.transform[5] = d.transform[10] = 1, d.transform[11] = p.camera;
  d.window[0] = d.window[2] = -1, d.window[1] = d.window[3] = 1;
  d.clip_far = 100, d.width = d.height = kSide;
  return d;
}

struct Ids {
  uint32_t glass, block, glow, lamp, walls;
};

std::shared_ptr<Scene> build(const Places& p, Ids& ids, const Places* end = nullptr) {
  const auto way = [&](std::vector<float> Ways::*of) { return end ? Ways(p, *end).*of : std::vector<float>{}; };
  auto scene = std::make_shared<Scene>();
  const auto material = [&](SppmClosureType type, float color) {
    const SppmClosureDesc c = closure(type, color);
    return scene->materials.add(material_of(c));
  };
  const uint32_t white = material(SPPM_DIFFUSE, 0.6f), clear = material(SPPM_DIELECTRIC, 1), bright = material(SPPM_EMISSION, 2);
  const uint32_t small = add_box(*scene, 0.2f);
  ids.walls = add_instance(*scene, add_box(*scene, 1), white, {}, false);
  ids.glass = add_instance(*scene, add_box(*scene, 0.3f), clear, p.glass, true, way(&Ways::glass));
  ids.block = add_instance(*scene, small, white, p.block, true);
  add_instance(*scene, small, white, place({0.7f, 0.7f, -0.8f}), false);
  ids.glow = add_instance(*scene, add_box(*scene, 0.1f), bright, p.glow, true, way(&Ways::glow));
  SppmLightDesc shining = lamp(p);
  const std::vector<float> lamp_way = way(&Ways::lamp);
  shining.motion = lamp_way.data(), shining.motion_count = static_cast<uint32_t>(lamp_way.size() / 12);
  ids.lamp = scene->add_lamp(shining);
  scene->set_camera(camera(p));
  if (end) scene->set_camera_motion(std::vector{camera(p), camera(*end)});
  scene->commit(Threads(2));
  return scene;
}

void move(Scene& scene, const Ids& ids, const Places& p) {
  scene.move_instance(ids.glass, p.glass.m.data());
  scene.move_instance(ids.block, p.block.m.data());
  scene.move_instance(ids.glow, p.glow.m.data());
  scene.set_lamp(ids.lamp, lamp(p));
  scene.set_camera(camera(p));
  scene.update(Threads(2));
}

std::vector<std::vector<float>> render(const std::shared_ptr<Scene>& scene, uint64_t iterations = 2, uint32_t threads = 2) {
  SppmSettings s{};
  s.struct_size = sizeof s;
  s.iterations = iterations, s.max_depth = 12, s.filter_width = 1.5, s.gamma = 0.8, s.threads = threads, s.photons_per_iteration = 4000;
  s.passes = (1u << SPPM_PASS_COUNT) - 1, s.radius_rule = SPPM_RADIUS_DENSITY, s.aim_photons = 1;
  Session session(scene, s);
  for (uint64_t i = 0; i < s.iterations; ++i) session.step();
  std::vector<std::vector<float>> passes;
  for (uint32_t pass = 0; pass < SPPM_PASS_COUNT; ++pass) {
    auto& out = passes.emplace_back(kSide * kSide * kPasses[pass].channel_count());
    session.read_pass(static_cast<SppmPass>(pass), out.data(), out.size());
  }
  return passes;
}

}  // namespace

TEST_CASE("what has been moved renders as if it had been built there") {
  Places away = kStart, mirrored = kStart, flat = kStart, far = kStart;
  away.glass = place({-0.3f, 0.3f, -0.4f}), away.block = place({0.1f, 0.1f, -0.6f}), away.glow = place({-0.6f, -0.5f, 0.2f}),
  away.lamp = {0.5f, 0.5f, 0.5f}, away.camera = 0.6f;
  mirrored.glass = place({0.2f, 0.2f, -0.4f}, {-1, 1.5f, 0.5f}), mirrored.block = place({0, -0.5f, -0.5f}, {1, 1, -2});
  mirrored.lamp_type = SPPM_LIGHT_RECTANGLE;
  flat.glass = place({0, 0.3f, -0.6f}, {1, 1, 0}), flat.block = place({0.3f, 0, -0.6f}, {1, 0, 1});
  flat.glow = place({0, 0, 0.4f}, {1, 1, 0});
  far.glow = place({0, 0, 30}), far.glass = place({0, 0.1f, -0.3f}, {0.5f, 0.5f, 0.5f}), far.lamp_type = SPPM_LIGHT_SUN;
  Ids ids{}, others{};
  const auto scene = build(kStart, ids);
  auto before = render(scene);
  for (const Places& p : {away, mirrored, flat, far, flat, kStart}) {
    move(*scene, ids, p);
    const auto built = build(p, others);
    const auto moved = render(scene);
    CHECK(moved != before);
    CHECK(moved == render(built));
    const SppmSceneInfo a = scene->info(), b = built->info();
    CHECK(a.light_power == b.light_power);
    for (int i = 0; i < 3; ++i) CHECK((a.bounds_min[i] == b.bounds_min[i] && a.bounds_max[i] == b.bounds_max[i]));
    before = moved;
  }
}

TEST_CASE("nothing moves before the update, and only what may") {
  Ids ids{};
  const auto scene = build(kStart, ids);
  const auto before = render(scene);
  const Affine there = place({0, 0, -0.5f});
  Places other_lamp = kStart;
  other_lamp.lamp = {0.5f, 0.5f, 0.5f};
  scene->move_instance(ids.glass, there.m.data());
  scene->set_lamp(ids.lamp, lamp(other_lamp));
  CHECK(render(scene) == before);
  scene->update(Threads(1));
  CHECK(render(scene) != before);
  CHECK_THROWS_WITH_AS(scene->move_instance(ids.walls, there.m.data()), doctest::Contains("movable"), Error);
  CHECK_THROWS_AS(scene->move_instance(0, there.m.data()), Error);
  CHECK_THROWS_AS(scene->move_instance(99, there.m.data()), Error);
  CHECK_THROWS_AS(scene->set_lamp(2, lamp(kStart)), Error);
  std::array<float, 12> broken = there.m;
  broken[5] = std::nanf("");
  CHECK_THROWS_WITH_AS(scene->move_instance(ids.glass, broken.data()), doctest::Contains("finite"), Error);
}

TEST_CASE("moving back and forth takes no memory") {
  Places flat = kStart;
  flat.glass = place({0, 0.3f, -0.6f}, {1, 1, 0});
  Ids ids{};
  const auto scene = build(kStart, ids);
  const auto back_and_forth = [&](int times) {
    for (int i = 0; i < times; ++i) move(*scene, ids, flat), move(*scene, ids, kStart);
    return scene->info().memory_bytes;
  };
  const uint64_t after_few = back_and_forth(3);
  CHECK(back_and_forth(50) == after_few);
}

TEST_CASE("a session's picture keeps its size") {
  Ids ids{};
  const auto scene = build(kStart, ids);
  SppmSettings s{};
  s.struct_size = sizeof s;
  s.iterations = 2, s.max_depth = 4, s.filter_width = 1.5, s.gamma = 0.8, s.threads = 1;
  Session session(scene, s);
  session.step();
  SppmCameraDesc larger = camera(kStart);
  larger.width = 2 * kSide;
  scene->set_camera(larger);
  CHECK_THROWS_AS(session.step(), Error);
  scene->set_camera(camera(kStart));
  CHECK_NOTHROW(session.step());
}

TEST_CASE("each pass of a moving scene shows it as it is at the time of the pass") {
  Places end = kStart;
  end.glass = place({-0.3f, 0.3f, -0.4f}, {1.2f, 1, 1}), end.glow = place({-0.6f, -0.5f, 0.2f}), end.lamp = {0.5f, 0.5f, 0.5f};
  end.camera = 0.6f;
  Ids ids{};
  const auto moving = build(kStart, ids, &end);
  CHECK(moving->moves());
  const double time = pass_time(0, 0);
  const auto share = static_cast<float>(time);
  Places then = kStart;
  then.glass = Motion(std::vector{kStart.glass, end.glass}).at(time), then.glow = Motion(std::vector{kStart.glow, end.glow}).at(time);
  then.lamp = lerp(kStart.lamp, end.lamp, share), then.camera = kStart.camera + (end.camera - kStart.camera) * share;
  const auto still = build(then, ids);
  CHECK_FALSE(still->moves());
  const auto moved = render(moving, 1), built = render(still, 1);
  for (size_t pass = 0; pass < moved.size(); ++pass) {
    double difference = 0;  // the lamp's and the camera's places differ by roundings
    for (size_t i = 0; i < moved[pass].size(); ++i) difference += std::abs(static_cast<double>(moved[pass][i] - built[pass][i]));
    CAPTURE(pass);
    CHECK(difference / static_cast<double>(moved[pass].size()) < 1e-3);
  }
  CHECK(render(moving, 4) != render(still, 4));
}

TEST_CASE("a moving scene renders the same for any number of threads, and again, and in turns") {
  Places end = kStart;
  end.glass = place({-0.3f, 0.3f, -0.4f}), end.camera = 0.6f;
  Ids ids{};
  const auto scene = build(kStart, ids, &end);
  const auto once = render(scene, 3, 1);
  CHECK(render(scene, 3, 3) == once);
  std::vector<std::vector<float>> other;
  std::thread beside([&] { other = render(scene, 3, 1); });
  CHECK(render(scene, 3, 1) == once);
  beside.join();
  CHECK(other == once);
}

TEST_CASE("motions are checked, and a place given from outside ends them") {
  Ids ids{};
  Places end = kStart;
  end.glass = place({-0.3f, 0.3f, -0.4f});
  const auto scene = build(kStart, ids, &end);
  const SppmCameraDesc keys[] = {camera(kStart), [] { auto d = camera(kStart); return d.width = 3, d; }()};
  CHECK_THROWS_WITH_AS(scene->set_camera_motion(keys), doctest::Contains("size"), Error);
  CHECK_THROWS_AS(scene->set_camera_motion({}), Error);
  SppmLightDesc wrong = lamp(kStart);
  wrong.motion_count = 1;
  CHECK_THROWS_WITH_AS(scene->set_lamp(ids.lamp, wrong), doctest::Contains("motion is null"), Error);
  for (const uint32_t id : {ids.glass, ids.glow}) scene->move_instance(id, kStart.glass.m.data());
  scene->set_lamp(ids.lamp, lamp(kStart));
  scene->set_camera(camera(kStart));
  CHECK_FALSE(scene->moves());
}

TEST_CASE("keys so unlike that between them nothing can be used render as the nearer one") {
  Ids ids{};
  const auto scene = build(kStart, ids);
  SppmLightDesc turning = lamp(kStart);
  turning.type = SPPM_LIGHT_RECTANGLE;
  std::vector<float> way(24, 0.0f);
  for (const size_t i : {0u, 5u, 10u}) way[i] = 1, way[12 + i] = -1;  // mirrored: half way it has no axis
  turning.motion = way.data(), turning.motion_count = 2;
  scene->set_lamp(ids.lamp, turning);
  std::vector<SppmCameraDesc> keys{camera(kStart), camera(kStart)};
  for (float& m : keys[1].transform) m = -m;
  keys[1].transform[11] = 0.6f;
  scene->set_camera_motion(keys);
  CHECK_NOTHROW(scene->set_time(0.5, Threads(1)));
  CHECK(scene->camera.ray(8, 8, {}).origin.z == 0.6f);
  CHECK_NOTHROW(scene->set_time(0.25, Threads(1)));
  CHECK(scene->camera.ray(8, 8, {}).origin.z == doctest::Approx(0.75));
}
