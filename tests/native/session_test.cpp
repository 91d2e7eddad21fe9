#include "session.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <thread>
#include <vector>

#include "closures.h"
#include "pass_info.h"
#include "status.h"

using namespace sppm;

namespace {

constexpr uint64_t kSide = 24;

SppmSettings settings(uint32_t threads) {
  SppmSettings s{};
  s.struct_size = sizeof s;
  s.iterations = 8, s.max_depth = 24, s.filter_width = 1.5, s.gamma = 2.0 / 3, s.threads = threads, s.photons_per_iteration = 20000;
  s.passes = (1u << SPPM_PASS_COUNT) - 1;
  return s;
}

uint32_t add_material(Scene& scene, const std::vector<SppmClosureDesc>& closures) {
  SppmMaterialDesc m{};
  m.struct_size = sizeof m;
  m.closure_count = closures.size(), m.closures = closures.data();
  return scene.materials.add(m);
}

// The box from -half to half around `center`.
void add_box(Scene& scene, Vec3 center, float half, uint32_t material) {
  std::vector<float> positions;
  for (int i = 0; i < 8; ++i)
    for (const float x : {center.x + (i & 1 ? half : -half), center.y + (i & 2 ? half : -half), center.z + (i & 4 ? half : -half)})
      positions.push_back(x);
  const uint32_t indices[] = {0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6, 0, 1, 5, 0, 5, 4, 2, 6, 7, 2, 7, 3, 0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5};
  SppmMeshDesc d{};
  d.struct_size = sizeof d;
  d.vertex_count = 8, d.triangle_count = 12, d.positions = positions.data(), d.indices = indices;
  SppmInstanceDesc i{};
  i.struct_size = sizeof i;
  i.mesh = scene.add_mesh(d), i.material_count = 1, i.materials = &material;
  i.transform[0] = i.transform[5] = i.transform[10] = 1;
  scene.add_instance(i);
}

void add_lamp(Scene& scene, Vec3 at, float intensity) {
  SppmLightDesc d{};
  d.struct_size = sizeof d;
  d.type = SPPM_LIGHT_POINT;
  d.transform[0] = d.transform[5] = d.transform[10] = 1, d.transform[3] = at.x, d.transform[7] = at.y, d.transform[11] = at.z;
  for (float& e : d.emission) e = intensity;
  scene.lights.add_lamp(d);
}

void commit(Scene& scene, uint64_t side = kSide) {
  SppmCameraDesc d{};
  d.struct_size = sizeof d;
  d.transform[0] = d.transform[5] = d.transform[10] = 1, d.transform[11] = 0.8f;
  d.window[0] = d.window[2] = -1, d.window[1] = d.window[3] = 1;
  d.clip_far = 100, d.width = d.height = side;
  scene.set_camera(d);
  scene.commit(Threads(2));
}

std::vector<float> read(const Session& session, SppmPass pass, uint64_t side = kSide) {
  std::vector<float> out(side * side * kPasses[pass].channel_count());
  session.read_pass(pass, out.data(), out.size());
  return out;
}

std::vector<std::vector<float>> read_all(const Session& session) {
  std::vector<std::vector<float>> passes;
  for (uint32_t pass = 0; pass < SPPM_PASS_COUNT; ++pass) passes.push_back(read(session, static_cast<SppmPass>(pass)));
  return passes;
}

double mean(const std::vector<float>& values, uint32_t stride, uint32_t channel) {
  double sum = 0;
  for (size_t i = channel; i < values.size(); i += stride) sum += static_cast<double>(values[i]);
  return sum * stride / static_cast<double>(values.size());
}

// A closed room with a glass cube and a lamp.
std::shared_ptr<Scene> room() {
  auto scene = std::make_shared<Scene>();
  add_box(*scene, {}, 1, add_material(*scene, {closure(SPPM_DIFFUSE, 0.6f)}));
  add_box(*scene, {0.3f, -0.4f, -0.2f}, 0.3f, add_material(*scene, {closure(SPPM_DIELECTRIC, 1)}));
  add_lamp(*scene, {-0.2f, 0.7f, 0.1f}, 1);
  commit(*scene);
  return scene;
}

}  // namespace

TEST_CASE("a pixel's state takes at most 160 bytes, its camera sample 104, and a glossy surface on the way 56") {
  MESSAGE("bytes a pixel: ", sizeof(Pixel), ", its camera sample: ", sizeof(CameraSample), ", a glossy point: ", sizeof(GlossyPoint));
  CHECK(sizeof(Pixel) <= 160);
  CHECK(sizeof(CameraSample) <= 104);
  CHECK(sizeof(GlossyPoint) <= 56);
}

TEST_CASE("the picture does not depend on the number of threads, nor on the run") {
  const auto scene = room();
  std::vector<std::vector<float>> first;
  for (const uint32_t threads : {1u, 2u, 4u, 1u}) {
    Session session(scene, settings(threads));
    for (int i = 0; i < 3; ++i) session.step();
    for (int pass = 0; pass < SPPM_PASS_COUNT; ++pass) {
      const auto picture = read(session, static_cast<SppmPass>(pass));
      if (first.size() < SPPM_PASS_COUNT)
        first.push_back(picture);
      else
        CHECK(picture == first[static_cast<size_t>(pass)]);
    }
  }
  CHECK(mean(first[SPPM_PASS_CAUSTICS], 3, 0) > 0);
  CHECK(mean(first[SPPM_PASS_INDIRECT], 3, 0) > 0);
}

TEST_CASE("another seed gives another picture") {
  const auto scene = room();
  SppmSettings other = settings(1);
  other.seed = 1;
  Session a(scene, settings(1)), b(scene, other);
  a.step(), b.step();
  CHECK(read(a, SPPM_PASS_COMBINED) != read(b, SPPM_PASS_COMBINED));
}

TEST_CASE("a cancelled step leaves the sums, and the next one goes on as if it had not been") {
  const auto scene = room();
  Session plain(scene, settings(2)), disturbed(scene, settings(2));
  for (int i = 0; i < 3; ++i) plain.step();
  disturbed.step();
  const auto before = read_all(disturbed);
  disturbed.cancel();
  CHECK_THROWS_AS(disturbed.step(), Error);
  CHECK(disturbed.progress().iteration == 1);
  CHECK(read_all(disturbed) == before);
  disturbed.step();
  SppmSettings long_one = settings(2);
  long_one.photons_per_iteration = 20000000;
  Session slow(scene, long_one);
  std::thread stopper([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    slow.cancel();
  });
  CHECK_THROWS_AS(slow.step(), Error);
  stopper.join();
  for (const auto& pass : read_all(slow)) CHECK(std::all_of(pass.begin(), pass.end(), [](float x) { return x == 0; }));
  disturbed.step();
  CHECK(read_all(disturbed) == read_all(plain));
}

TEST_CASE("an empty scene, one without light, and one of a single pixel are rendered") {
  const auto empty = std::make_shared<Scene>();
  commit(*empty);
  Session nothing(empty, settings(1));
  nothing.step();
  CHECK(mean(read(nothing, SPPM_PASS_COMBINED), 4, 0) == 0);
  CHECK(mean(read(nothing, SPPM_PASS_COMBINED), 4, 3) == 1);
  CHECK(read(nothing, SPPM_PASS_DEPTH)[0] == 1e10f);

  const auto dark = std::make_shared<Scene>();
  add_box(*dark, {}, 1, add_material(*dark, {closure(SPPM_DIFFUSE, 0.5f)}));
  commit(*dark);
  Session night(dark, settings(1));
  night.step(), night.step();
  CHECK(mean(read(night, SPPM_PASS_COMBINED), 4, 0) == 0);
  CHECK(read(night, SPPM_PASS_DEPTH)[0] == doctest::Approx(1.8).epsilon(0.5));

  const auto tiny = std::make_shared<Scene>();
  add_box(*tiny, {}, 1, add_material(*tiny, {closure(SPPM_DIFFUSE, 0.5f)}));
  add_lamp(*tiny, {}, 1);
  commit(*tiny, 1);
  Session one(tiny, settings(4));
  for (int i = 0; i < 3; ++i) one.step();
  CHECK(read(one, SPPM_PASS_COMBINED, 1)[0] > 0);
}

TEST_CASE("a transparent film shows the lamp's scene over nothing") {
  const auto scene = std::make_shared<Scene>();
  SppmWorldDesc world{};
  world.struct_size = sizeof world;
  for (float& r : world.radiance) r = 0.5f;
  scene->lights.set_world(world);
  commit(*scene);
  SppmSettings s = settings(1);
  Session opaque(scene, s);
  s.transparent_film = 1;
  Session clear(scene, s);
  opaque.step(), clear.step();
  CHECK(mean(read(opaque, SPPM_PASS_COMBINED), 4, 0) == doctest::Approx(0.5));
  CHECK(mean(read(opaque, SPPM_PASS_COMBINED), 4, 3) == 1);
  CHECK(mean(read(clear, SPPM_PASS_COMBINED), 4, 0) == 0);
  CHECK(mean(read(clear, SPPM_PASS_COMBINED), 4, 3) == 0);
}

TEST_CASE("in a closed box that glows with L and reflects a, everything looks L / (1 - a)") {
  for (const float a : {0.3f, 0.6f, 0.8f}) {
    CAPTURE(a);
    const auto scene = std::make_shared<Scene>();
    add_box(*scene, {}, 1, add_material(*scene, {closure(SPPM_DIFFUSE, a), closure(SPPM_EMISSION, 2)}));
    commit(*scene);
    SppmSettings s = settings(2);
    s.photons_per_iteration = 50000, s.max_depth = 200, s.initial_radius = 0.05;
    Session session(scene, s);
    for (int i = 0; i < 20; ++i) session.step();
    const double expected = 2 / (1 - static_cast<double>(a));
    const double photons = static_cast<double>(a * a) * expected, direct = 2 * (1 + static_cast<double>(a));
    // A million photons of half of which stay: the noise of the mean is below 0.3 %; the radius at the edges of the box costs up to 2 %.
    CHECK(mean(read(session, SPPM_PASS_DIRECT), 3, 0) == doctest::Approx(direct).epsilon(0.005).scale(0));
    CHECK(mean(read(session, SPPM_PASS_INDIRECT), 3, 0) == doctest::Approx(photons).epsilon(0.03).scale(0));
    CHECK(mean(read(session, SPPM_PASS_COMBINED), 4, 0) == doctest::Approx(expected).epsilon(0.02).scale(0));
    CHECK(mean(read(session, SPPM_PASS_CAUSTICS), 3, 0) == 0);
  }
}

TEST_CASE("a glass cube in a uniform glow without absorption cannot be seen") {
  // Radiance 1 comes from everywhere outside, so it does from the glass: what enters divides by n^2 and leaves times n^2.
  for (const float roughness : {0.0f, 0.2f}) {
    const auto scene = std::make_shared<Scene>();
    SppmClosureDesc glass = closure(SPPM_DIELECTRIC, 1);
    glass.roughness.value[0] = roughness;
    add_box(*scene, {0.1f, 0, -1}, 0.7f, add_material(*scene, {glass}));
    SppmWorldDesc world{};
    world.struct_size = sizeof world;
    for (float& r : world.radiance) r = 1;
    scene->lights.set_world(world);
    commit(*scene);
    SppmSettings s = settings(2);
    s.max_depth = 1000, s.photons_per_iteration = 1;
    Session session(scene, s);
    for (int i = 0; i < 32; ++i) session.step();
    CAPTURE(roughness);
    // Rough glass loses a few per mille to the microfacets.
    CHECK(mean(read(session, SPPM_PASS_COMBINED), 4, 0) == doctest::Approx(1).epsilon(roughness > 0 ? 0.02 : 0.01));
  }
}

TEST_CASE("what overflows is left out and counted, and every pass stays finite") {
  for (const float intensity : {1.0f, 1e20f}) {
    const auto scene = std::make_shared<Scene>();
    add_box(*scene, {}, 1, add_material(*scene, {closure(SPPM_DIFFUSE, intensity == 1 ? 0.5f : 1e25f)}));
    add_lamp(*scene, {0, 0.5f, 0}, intensity);
    commit(*scene);
    Session session(scene, settings(2));
    session.step(), session.step();
    CHECK((session.progress().dropped_samples > 0) == (intensity > 1));
    for (int pass = 0; pass < SPPM_PASS_COUNT; ++pass)
      for (const float x : read(session, static_cast<SppmPass>(pass))) CHECK(std::isfinite(x));
  }
}
