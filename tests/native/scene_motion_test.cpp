// What is moved in a committed scene renders, to the bits, as a scene that was built so.
#include <doctest/doctest.h>

#include <array>

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

SppmClosureDesc closure(SppmClosureType type, float color) {
  SppmClosureDesc c{};
  c.struct_size = sizeof c;
  c.type = type, c.ior = 1.5f;
  for (int i = 0; i < 3; ++i) c.weight.value[i] = 1, c.color.value[i] = c.color2.value[i] = color;
  return c;
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

uint32_t add_instance(Scene& scene, uint32_t mesh, uint32_t material, const Affine& transform, bool movable) {
  SppmInstanceDesc i{};
  i.struct_size = sizeof i;
  i.mesh = mesh, i.material_count = 1, i.materials = &material, i.movable = movable;
  std::copy(transform.m.begin(), transform.m.end(), i.transform);
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

std::shared_ptr<Scene> build(const Places& p, Ids& ids) {
  auto scene = std::make_shared<Scene>();
  const auto material = [&](SppmClosureType type, float color) {
    const SppmClosureDesc c = closure(type, color);
    return scene->materials.add(material_of(c));
  };
  const uint32_t white = material(SPPM_DIFFUSE, 0.6f), clear = material(SPPM_DIELECTRIC, 1), bright = material(SPPM_EMISSION, 2);
  const uint32_t small = add_box(*scene, 0.2f);
  ids.walls = add_instance(*scene, add_box(*scene, 1), white, {}, false);
  ids.glass = add_instance(*scene, add_box(*scene, 0.3f), clear, p.glass, true);
  ids.block = add_instance(*scene, small, white, p.block, true);
  add_instance(*scene, small, white, place({0.7f, 0.7f, -0.8f}), false);
  ids.glow = add_instance(*scene, add_box(*scene, 0.1f), bright, p.glow, true);
  ids.lamp = scene->lights.add_lamp(lamp(p));
  scene->set_camera(camera(p));
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

std::vector<std::vector<float>> render(const std::shared_ptr<Scene>& scene) {
  SppmSettings s{};
  s.struct_size = sizeof s;
  s.iterations = 2, s.max_depth = 12, s.filter_width = 1.5, s.gamma = 0.8, s.threads = 2, s.photons_per_iteration = 4000;
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
  flat.glass = place({0, 0.3f, -0.6f}, {1, 1, 0}), flat.block = place({0.3f, 0, -0.6f}, {1, 0, 1}), flat.glow = place({0, 0, 0.4f}, {1, 1, 0});
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
  scene->move_instance(ids.glass, there.m.data());
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
