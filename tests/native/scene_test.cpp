#include "scene.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "accel.h"
#include "closures.h"
#include "sampling.h"
#include "status.h"

using namespace sppm;

namespace {

struct Shape {
  std::vector<float> positions;
  std::vector<uint32_t> indices;
  SppmMeshDesc desc() const {
    SppmMeshDesc d{};
    d.struct_size = sizeof d;
    d.vertex_count = positions.size() / 3, d.triangle_count = indices.size() / 3;
    d.positions = positions.data(), d.indices = indices.data();
    return d;
  }
};

// A sphere of unit radius around `center`, wound outward.
Shape sphere(Vec3 center, uint32_t rows, float radius = 1) {
  Shape s;
  const uint32_t columns = 2 * rows;
  for (uint32_t i = 0; i <= rows; ++i)
    for (uint32_t j = 0; j < columns; ++j) {
      const float theta = kPi * static_cast<float>(i) / static_cast<float>(rows),
                  phi = 2 * kPi * static_cast<float>(j) / static_cast<float>(columns);
      for (const float x : {center.x + radius * std::sin(theta) * std::cos(phi), center.y + radius * std::sin(theta) * std::sin(phi),
                            center.z + radius * std::cos(theta)})
        s.positions.push_back(x);
    }
  for (uint32_t i = 0; i < rows; ++i)
    for (uint32_t j = 0; j < columns; ++j) {
      const uint32_t a = i * columns + j, b = i * columns + (j + 1) % columns, c = a + columns, d = b + columns;
      if (i > 0) s.indices.insert(s.indices.end(), {a, c, b});
      if (i + 1 < rows) s.indices.insert(s.indices.end(), {b, c, d});
    }
  return s;
}

uint32_t add_material(Scene& scene, const std::vector<SppmClosureDesc>& closures) {
  SppmMaterialDesc m{};
  m.struct_size = sizeof m;
  m.closure_count = closures.size(), m.closures = closures.data();
  return scene.materials.add(m);
}

uint32_t add_material(Scene& scene, SppmClosureType type, float color) { return add_material(scene, {closure(type, color)}); }

void add_instance(Scene& scene, uint32_t mesh, uint32_t material, const Affine& transform) {
  SppmInstanceDesc d{};
  d.struct_size = sizeof d;
  d.mesh = mesh, d.material_count = 1, d.materials = &material;
  std::copy(transform.m.begin(), transform.m.end(), d.transform);
  scene.add_instance(d);
}

void commit(Scene& scene) {
  SppmCameraDesc d{};
  d.struct_size = sizeof d;
  d.transform[0] = d.transform[5] = d.transform[10] = 1;
  d.window[0] = d.window[2] = -1, d.window[1] = d.window[3] = 1;
  d.clip_far = 100, d.width = d.height = 4;
  scene.set_camera(d);
  scene.commit(Threads(1));
}

Affine turn_scale_move(Vec3 scale, Vec3 move) {
  const float c = 0.8f, s = 0.6f;
  return {{c * scale.x, -s * scale.y, 0, move.x, s * scale.x, c * scale.y, 0, move.y, 0, 0, scale.z, move.z}};
}

struct Aim {
  std::mt19937 random{13};
  std::uniform_real_distribution<float> uniform;
  Vec3 direction() { return normalize(sample_sphere({uniform(random), uniform(random)})); }
};

}  // namespace

TEST_CASE("an instance is hit like the same mesh moved, and normals point outward under any scale") {
  for (const Vec3 scale : {Vec3{1, 1, 1}, Vec3{2, 0.5f, 1}, Vec3{-1, 1, 1}, Vec3{-1, -2, -0.5f}}) {
    const Vec3 center{3, -1, 2};
    const Affine transform = turn_scale_move(scale, center), far = turn_scale_move({1, 1, 1}, {1000, 0, 0});
    const Shape shape = sphere({}, 12);
    Scene moved, instanced;
    const uint32_t a = moved.add_mesh(shape.desc()), b = instanced.add_mesh(shape.desc());
    add_instance(moved, a, add_material(moved, SPPM_DIFFUSE, 0.5f), transform);
    const uint32_t material = add_material(instanced, SPPM_DIFFUSE, 0.5f);
    add_instance(instanced, b, material, transform), add_instance(instanced, b, material, far);  // two uses: not moved
    commit(moved), commit(instanced);
    Aim aim;
    for (int i = 0; i < 500; ++i) {
      const Ray ray{center + aim.direction() * 6, {}, 0, kInfinity};
      const Ray towards{ray.origin, normalize(center + aim.direction() * 0.3f - ray.origin), 0, kInfinity};
      const auto x = moved.intersect(towards), y = instanced.intersect(towards);
      REQUIRE((x && y));
      CHECK(length(x->p - y->p) < 1e-4f);
      CHECK(length(x->ng - y->ng) < 1e-3f);
      CHECK(dot(x->ng, towards.direction) < 0);  // from outside, of a convex shape
      CHECK(dot(y->ng, towards.direction) < 0);
    }
  }
}

TEST_CASE("rays that leave a convex surface never meet it, and rays into it always do") {
  for (const float offset : {0.0f, 10.0f, 1000.0f})
    for (const uint32_t rows : {4u, 16u, 200u})
      for (const bool two : {false, true}) {
        const Vec3 center = splat(offset);
        Scene scene;
        const uint32_t material = add_material(scene, SPPM_DIFFUSE, 0.5f);
        const Shape shape = sphere(two ? Vec3{} : center, rows);
        const uint32_t mesh = scene.add_mesh(shape.desc());
        add_instance(scene, mesh, material, two ? turn_scale_move({1, 1, 1}, center) : Affine{});
        if (two) add_instance(scene, mesh, material, turn_scale_move({1, 1, 1}, center + Vec3{0, 0, 5000}));
        commit(scene);
        CAPTURE(offset);
        CAPTURE(rows);
        CAPTURE(two);
        Aim aim;
        int own = 0, leaks = 0;
        constexpr int n = 4000;
        for (int i = 0; i < n; ++i) {
          const Vec3 from = aim.direction();
          const auto s = scene.intersect({center + from * 3, normalize(aim.direction() * 0.15f - from), 0, kInfinity});
          REQUIRE(s);
          const Vec3 w = face_toward(aim.direction(), s->ng);
          own += scene.intersect(s->spawn(w)).has_value() && !(two && w.z > 0.99f);
          // Inward, but not so flat that the offset itself may pass a corner of the polyhedron.
          if (dot(w, s->ng) > 0.2f) leaks += !scene.intersect(s->spawn(-w)).has_value();
        }
        CHECK(own == 0);
        CHECK(leaks == 0);
      }
}

TEST_CASE("a packet of shadow rays, full or not, tells what its rays tell alone") {
  const Shape shape = sphere({}, 16);
  for (const auto type : {SPPM_TRANSPARENT, SPPM_DIFFUSE}) {
    Scene scene;
    const uint32_t mesh = scene.add_mesh(shape.desc());
    add_instance(scene, mesh, add_material(scene, type, 0.5f), turn_scale_move({1, 1, 1}, {0, 0, 0}));
    add_instance(scene, mesh, add_material(scene, SPPM_DIFFUSE, 0.5f), turn_scale_move({1, 1, 1}, {4, 0, 0}));
    commit(scene);
    std::mt19937 random(7);
    std::normal_distribution<float> normal;
    const auto vector = [&] { return Vec3{normal(random), normal(random), normal(random)}; };
    int hidden = 0, seen = 0;
    for (size_t size = 0; size <= Scene::kPacket; ++size)
      for (int repeat = 0; repeat < 20; ++repeat) {
        std::vector<Ray> packet;
        for (size_t i = 0; i < size; ++i) packet.push_back({vector() * 3, normalize(vector()), 0, i % 3 == 0 ? kInfinity : 2.0f});
        // What overflowed on its way meets nothing, wherever in the packet it is.
        if (size > 4) packet[4].origin.x = kInfinity;
        uint64_t rays = 0, rays_alone = 0;
        const auto left = scene.transmittance(packet, rays);
        for (size_t i = 0; i < size; ++i) {
          const Vec3 alone = scene.transmittance(packet[i], rays_alone);
          CHECK(left[i] == alone);
          ++(alone.x < 1 ? hidden : seen);
        }
        CHECK(rays == rays_alone);
      }
    CHECK(hidden > 100);
    CHECK(seen > 100);
  }
}

TEST_CASE("transparent surfaces dim what passes, opaque ones stop it") {
  const Shape shape = sphere({}, 16);
  for (const bool opaque : {false, true}) {
    Scene scene;
    const uint32_t mesh = scene.add_mesh(shape.desc());
    const uint32_t clear = add_material(scene, SPPM_TRANSPARENT, 0.5f), solid = add_material(scene, SPPM_DIFFUSE, 0.5f);
    add_instance(scene, mesh, clear, turn_scale_move({1, 1, 1}, {0, 0, 0}));
    add_instance(scene, mesh, opaque ? solid : clear, turn_scale_move({1, 1, 1}, {4, 0, 0}));
    commit(scene);
    CHECK(scene.has_transparent());
    uint64_t rays = 0;
    const Vec3 origin{-3, 0.1f, 0.1f};
    CHECK(scene.transmittance({origin, {1, 0, 0}, 0, 1}, rays).x == 1);
    CHECK(scene.transmittance({origin, {1, 0, 0}, 0, 3}, rays).x == 0.5f);
    CHECK(scene.transmittance({origin, {1, 0, 0}, 0, 5}, rays).x == 0.25f);
    CHECK(scene.transmittance({origin, {1, 0, 0}, 0, 50}, rays).x == (opaque ? 0 : 0.0625f));
    CHECK(scene.transmittance({origin, {1, 0, 0}}, rays).x == (opaque ? 0 : 0.0625f));
    CHECK(scene.transmittance({origin, {-1, 0, 0}}, rays).x == 1);
    CHECK(rays >= 10);
  }
}

TEST_CASE("a scene checks what is put together, and tells what it holds") {
  Scene scene;
  CHECK_THROWS_AS(scene.commit(Threads(1)), Error);  // no camera
  const uint32_t mesh = scene.add_mesh(sphere({}, 4).desc()), material = add_material(scene, SPPM_EMISSION, 1);
  CHECK_THROWS_AS(add_instance(scene, 2, material, {}), Error);
  CHECK_THROWS_AS(add_instance(scene, mesh, 2, {}), Error);
  CHECK_THROWS_AS(add_instance(scene, mesh, 0, {}), Error);
  add_instance(scene, mesh, material, {});
  commit(scene);
  const SppmSceneInfo info = scene.info();
  CHECK(info.triangle_count == 48);
  CHECK(info.light_count == 1);
  CHECK(info.bounds_max[2] == doctest::Approx(1));
  CHECK(info.light_power > 0);
  CHECK_THROWS_AS(scene.commit(Threads(1)), Error);
}

TEST_CASE("an emitter seen along a ray has the density that direct light has") {
  Scene scene;
  const uint32_t mesh = scene.add_mesh(sphere({0, 0, 4}, 6).desc());
  add_instance(scene, mesh, add_material(scene, SPPM_EMISSION, 2), {});
  commit(scene);
  int compared = 0;
  for (uint64_t i = 0; i < 500; ++i) {
    const auto light = scene.lights.sample_direct({}, Sampler(1, i).next());
    if (!light) continue;
    const auto s = scene.intersect({{}, light->wi});
    if (!s || std::abs(length(s->p) - light->distance) > 1e-3f) continue;  // the far side
    const EmittedLight e = scene.emitted(*s, -light->wi, {}, length(s->p));
    CHECK(e.radiance == light->radiance);
    CHECK(static_cast<double>(e.pdf_solid_angle / light->pdf) == doctest::Approx(1).epsilon(2e-3));
    ++compared;
  }
  CHECK(compared > 100);
}

TEST_CASE("the ray tracer that the process reaches is the one built for") { CHECK_NOTHROW(check_embree()); }

TEST_CASE("rays respect their ends") {
  Scene scene;
  add_instance(scene, scene.add_mesh(sphere({}, 16).desc()), add_material(scene, SPPM_DIFFUSE, 1), {});
  commit(scene);
  const Vec3 origin{0.1f, 0.1f, 5}, down{0, 0, -1};
  CHECK_FALSE(scene.intersect({origin, down, 0, 3.9f}));
  CHECK(scene.intersect({origin, down, 0, 4.1f})->p.z > 0);
  CHECK(scene.intersect({origin, down, 4.5f, 10})->p.z < 0);
  CHECK_FALSE(scene.intersect({origin, down, 7, 10}));
}

TEST_CASE("a smooth emitter under a coat looks the same whether a ray meets it or it is sampled as a light") {
  for (const bool turned : {false, true})
    for (const bool mirrored : {false, true}) {
      CAPTURE(turned);
      CAPTURE(mirrored);
      Scene scene;
      const Shape ball = sphere({}, 6);
      SppmMeshDesc desc = ball.desc();
      desc.corner_count = desc.vertex_count, desc.corners = desc.indices, desc.corner_normals = desc.positions;
      const uint32_t mesh = scene.add_mesh(desc);
      std::vector<SppmClosureDesc> closures{closure(SPPM_COAT, 1), closure(SPPM_EMISSION, 1)};
      closures[0].flags = SPPM_CLOSURE_ATTENUATE;
      const uint32_t glow = add_material(scene, closures);
      const Affine place = turn_scale_move({mirrored ? -1.0f : 1.0f, 2, 0.7f}, {});
      add_instance(scene, mesh, glow, place);
      if (turned) add_instance(scene, mesh, glow, turn_scale_move({1, 1, 1}, {0, 0, 5}));  // then neither is moved to world space
      commit(scene);
      std::mt19937 random(4);
      std::uniform_real_distribution<float> uniform(-1, 1);
      float least = 1, most = 0;
      for (uint64_t i = 0; i < 2000; ++i) {
        const Vec3 from = normalize(Vec3{uniform(random), uniform(random), uniform(random)}) * 4;
        const auto light = scene.lights.sample_direct(from, Sampler(6, i).next());
        REQUIRE(light);
        const auto s = scene.intersect({from, light->wi});
        if (!s || std::abs(length(s->p - from) - light->distance) > 1e-4f) continue;  // it shines from the other side
        const float seen = scene.emitted(*s, -light->wi, from, light->distance).radiance.x;
        CHECK(light->radiance.x == doctest::Approx(seen).epsilon(2e-3));
        least = std::min(least, seen), most = std::max(most, seen);
      }
      CHECK(least < 0.8f);
      CHECK(most > 0.95f);
    }
}

TEST_CASE("shadow rays reach an emitting triangle from anywhere, and see what is just in front of it") {
  for (const float offset : {0.0f, 100.0f})
    for (const bool two : {false, true})
      for (const bool covered : {false, true}) {
        CAPTURE(offset);
        CAPTURE(two);
        CAPTURE(covered);
        Scene scene;
        // The mesh lies far from its own origin where it is instanced twice.
        const Vec3 center = splat(offset), own = two ? Vec3{300, -200, 100} : Vec3{};
        Shape plate;
        for (const Vec3 p : {Vec3{-0.5f, -0.5f, 0}, Vec3{0.5f, -0.5f, 0}, Vec3{0.1f, 0.5f, 0}})
          for (const float x : {p.x + own.x, p.y + own.y, p.z + own.z}) plate.positions.push_back(x);
        plate.indices = {0, 1, 2};
        const uint32_t mesh = scene.add_mesh(plate.desc());
        const uint32_t glow = add_material(scene, SPPM_EMISSION, 1), wall = add_material(scene, SPPM_DIFFUSE, 0.5f);
        const auto move = [&](Vec3 to) { return Affine{{1, 0, 0, to.x - own.x, 0, 1, 0, to.y - own.y, 0, 0, 1, to.z - own.z}}; };
        add_instance(scene, mesh, glow, move(center));
        if (two) add_instance(scene, mesh, wall, move(center - Vec3{0, 0, 5000}));
        // The floor that is lit, and what covers the emitter at a hundred thousandth of the distance, or of the coordinates if larger.
        Shape floor, cover;
        for (const Vec3 p : {Vec3{-80, -80, -10}, Vec3{80, -80, -10}, Vec3{0, 90, -10}})
          for (const float x : {p.x + center.x, p.y + center.y, p.z + center.z}) floor.positions.push_back(x);
        floor.indices = {0, 1, 2};
        add_instance(scene, scene.add_mesh(floor.desc()), wall, {});
        const float gap = 1e-5f * std::max(10.0f, offset + length(own));
        for (const Vec3 p : {Vec3{-80, -80, -gap}, Vec3{80, -80, -gap}, Vec3{0, 90, -gap}})
          for (const float x : {p.x + center.x, p.y + center.y, p.z + center.z}) cover.positions.push_back(x);
        cover.indices = {0, 1, 2};
        if (covered) add_instance(scene, scene.add_mesh(cover.desc()), wall, {});
        commit(scene);
        std::mt19937 random(4);
        std::uniform_real_distribution<float> uniform(-1, 1);
        int tried = 0, reached = 0;
        for (uint64_t i = 0; i < 4000; ++i) {
          const float spread = i % 2 ? 1.0f : 20.0f;  // from below, and at grazing angles
          const Vec3 from = center + Vec3{uniform(random) * spread, uniform(random) * spread, -5};
          const auto s = scene.intersect({from, {0, 0, -1}});
          REQUIRE(s);
          const auto light = scene.lights.sample_direct(s->p, Sampler(6, i).next());
          REQUIRE((light && light->end));
          uint64_t rays = 0;
          ++tried;
          reached += scene.transmittance(s->spawn_to(*light->end), rays).x > 0;
        }
        CHECK(reached == (covered ? 0 : tried));
      }
}
