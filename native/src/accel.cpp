#include "accel.h"

#if SPPM_EMBREE_MAJOR >= 4
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <map>
#include <vector>

#include "status.h"

namespace sppm {
namespace {

SppmStatus status_of(RTCError error) { return error == RTC_ERROR_OUT_OF_MEMORY ? SPPM_OUT_OF_MEMORY : SPPM_INTERNAL_ERROR; }

// Coordinates that Embree takes, in world and object space; its builds with assertions abort the process beyond 1.844e18.
constexpr float kLargestCoordinate = 1e11f, kLargestInverse = 1e6f;

// False for what overflowed on its way here: it meets nothing.
bool traceable(const Ray& ray) {
  const Vec3 o = abs(ray.origin), d = abs(ray.direction);
  const bool origin = o.x <= kLargestCoordinate && o.y <= kLargestCoordinate && o.z <= kLargestCoordinate;
  return origin && d.x <= 2 && d.y <= 2 && d.z <= 2 && ray.near >= 0 && ray.far >= ray.near;
}

RTCRayHit make_query(const Ray& ray) {
  RTCRayHit query{};
  query.ray.org_x = ray.origin.x, query.ray.org_y = ray.origin.y, query.ray.org_z = ray.origin.z;
  query.ray.dir_x = ray.direction.x, query.ray.dir_y = ray.direction.y, query.ray.dir_z = ray.direction.z;
  query.ray.tnear = ray.near, query.ray.tfar = ray.far;
  query.ray.mask = ray.kind;
  query.hit.geomID = query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  return query;
}

// The id of an instance, whether it is one for Embree too or was moved to world space: there, or in the scene `ground`.
uint32_t instance_of(uint32_t instance_id, uint32_t geometry_id, uint32_t ground) {
  return instance_id != RTC_INVALID_GEOMETRY_ID && instance_id != ground ? instance_id : geometry_id;
}

// What Embree hands to the filter of a query.
#if SPPM_EMBREE_MAJOR >= 4
using QueryContext = RTCRayQueryContext;
constexpr RTCSceneFlags kQueriesMayFilter = RTC_SCENE_FLAG_FILTER_FUNCTION_IN_ARGUMENTS;
#else
using QueryContext = RTCIntersectContext;
constexpr RTCSceneFlags kQueriesMayFilter = RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION;
#endif
struct TouchingContext {
  QueryContext embree;  // first, so that the filter finds what follows it
  const Touching* touching;
  uint32_t ground;
};

void reject_not_allowed(const RTCFilterFunctionNArguments* args) {
  const TouchingContext& context = *reinterpret_cast<const TouchingContext*>(args->context);
  const uint32_t instance = instance_of(RTCHitN_instID(args->hit, 1, 0, 0), RTCHitN_geomID(args->hit, 1, 0), context.ground);
  if (!context.touching->allows({instance, RTCHitN_primID(args->hit, 1, 0)}, RTCRayN_tfar(args->ray, 1, 0))) args->valid[0] = 0;
}

void trace(RTCScene scene, RTCRayHit& query, const Touching& touching, uint32_t ground) {
  TouchingContext context{{}, &touching, ground};
  const bool filters = touching.rule != Touching::Rule::kAll;
#if SPPM_EMBREE_MAJOR >= 4
  rtcInitRayQueryContext(&context.embree);
  RTCIntersectArguments arguments;
  rtcInitIntersectArguments(&arguments);
  arguments.context = &context.embree;
  if (filters) arguments.filter = reject_not_allowed, arguments.flags = RTC_RAY_QUERY_FLAG_INVOKE_ARGUMENT_FILTER;
  rtcIntersect1(scene, &query, &arguments);
#else
  rtcInitIntersectContext(&context.embree);
  if (filters) context.embree.filter = reject_not_allowed;
  rtcIntersect1(scene, &context.embree, &query);
#endif
}

void trace_shadows(RTCScene scene, const int* valid, RTCRay16& rays) {
#if SPPM_EMBREE_MAJOR >= 4
  rtcOccluded16(valid, scene, &rays);
#else
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcOccluded16(valid, scene, &context, &rays);
#endif
}

}  // namespace

struct Accel::Impl {
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;
  std::map<const Mesh*, RTCScene> instanced;
  // What stands still in world space, where something else moves: instanced by `scene` under the id `ground`, so that `scene` holds
  // instances alone and is built again at no cost to speak of.
  RTCScene still = nullptr;
  uint32_t ground = RTC_INVALID_GEOMETRY_ID;
  std::atomic<int64_t> memory{0};

  Impl() {
    device = rtcNewDevice(nullptr);
    if (!device) throw Error(status_of(rtcGetDeviceError(nullptr)), "Embree cannot make a device");
    rtcSetDeviceMemoryMonitorFunction(
        device,
        [](void* user, ssize_t bytes, bool) {
          static_cast<Impl*>(user)->memory += bytes;
          return true;
        },
        this);
    scene = new_scene();
  }
  ~Impl() {
    for (auto& [mesh, part] : instanced) rtcReleaseScene(part);
    if (still) rtcReleaseScene(still);
    rtcReleaseScene(scene);
    rtcReleaseDevice(device);
  }
  RTCScene new_scene() const {
    RTCScene made = rtcNewScene(device);
    rtcSetSceneBuildQuality(made, RTC_BUILD_QUALITY_MEDIUM);
    rtcSetSceneFlags(made, kQueriesMayFilter);
    return made;
  }
  void check() const {
    const RTCError error = rtcGetDeviceError(device);
    if (error != RTC_ERROR_NONE) throw Error(status_of(error), "Embree failed with error " + std::to_string(error));
  }
  void attach(RTCScene target, RTCGeometry geometry, uint32_t id, bool hidden_from_camera = false) const {
    rtcSetGeometryMask(geometry, hidden_from_camera ? Ray::kOther : Ray::kCamera | Ray::kOther);
    rtcCommitGeometry(geometry);
    rtcAttachGeometryByID(target, geometry, id);
    rtcReleaseGeometry(geometry);
  }
  RTCGeometry triangles(RTCScene target, const Mesh& mesh) const {
    // Tests of edges and boxes without gaps, which cost: rays slip between needles otherwise.
    if (mesh.needles) rtcSetSceneFlags(target, kQueriesMayFilter | RTC_SCENE_FLAG_ROBUST);
    RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, mesh.positions.data(), 0, sizeof(Vec3),
                               mesh.positions.size() - 1);
    rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, mesh.indices.data(), 0, 12, mesh.indices.size());
    return geometry;
  }
  RTCScene part(const Mesh* mesh) {
    RTCScene& slot = instanced[mesh];
    if (!slot) {
      slot = new_scene();
      attach(slot, triangles(slot, *mesh), 0);
      rtcCommitScene(slot);
    }
    return slot;
  }
  void attach_instance(RTCScene of, const Affine& transform, uint32_t id, bool hidden_from_camera = false) const {
    RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_INSTANCE);
    rtcSetGeometryInstancedScene(geometry, of);
    rtcSetGeometryTransform(geometry, 0, RTC_FORMAT_FLOAT3X4_ROW_MAJOR, transform.m.data());
    attach(scene, geometry, id, hidden_from_camera);
  }
  void attach(const Placement& p, uint32_t id) {
    if (!p.identity) return attach_instance(part(p.mesh), p.transform, id, p.hidden_from_camera);
    const RTCScene target = still && !p.movable ? still : scene;
    attach(target, triangles(target, *p.mesh), id, p.hidden_from_camera);
  }
};

bool can_be_instanced(const Affine& m) {
  constexpr float kWorstCondition = 1e5f;  // of digits lost on the way to object space and back
  const Vec3 a = m.column(0), b = m.column(1), c = m.column(2);
  const float inverse_largest = max_component(max(abs(cross(b, c)), max(abs(cross(c, a)), abs(cross(a, b))))) / std::abs(m.determinant());
  const float largest = max_component(max(abs(a), max(abs(b), abs(c))));
  return inverse_largest <= kLargestInverse && inverse_largest * largest <= kWorstCondition &&
         max_component(abs(m.column(3))) <= kLargestCoordinate;
}

Accel::Accel() : impl_(std::make_unique<Impl>()) {}
Accel::~Accel() = default;

void Accel::build(std::span<const Placement> placements) {
  const bool moves = std::any_of(placements.begin(), placements.end(), [](const Placement& p) { return p.movable; });
  const bool stands = std::any_of(placements.begin(), placements.end(), [](const Placement& p) { return p.identity && !p.movable; });
  if (moves && stands) impl_->still = impl_->new_scene();
  for (uint32_t i = 0; i < placements.size(); ++i) impl_->attach(placements[i], i);
  if (impl_->still) {
    rtcCommitScene(impl_->still);
    impl_->ground = static_cast<uint32_t>(placements.size());
    impl_->attach_instance(impl_->still, {}, impl_->ground);
  }
  commit();
}

void Accel::place(uint32_t index, const Placement& placement) {
  rtcDetachGeometry(impl_->scene, index);
  impl_->attach(placement, index);
}

void Accel::commit() {
  rtcCommitScene(impl_->scene);
  impl_->check();
}

std::optional<Hit> Accel::intersect(const Ray& ray) const {
  std::optional<Hit> found;
  if (!traceable(ray)) return found;
  RTCRayHit query = make_query(ray);
  trace(impl_->scene, query, ray.touching, impl_->ground);
  if (query.hit.geomID != RTC_INVALID_GEOMETRY_ID)
    found = {query.ray.tfar, query.hit.u, query.hit.v, instance_of(query.hit.instID[0], query.hit.geomID, impl_->ground),
             query.hit.primID};
  return found;
}

uint32_t Accel::occluded(std::span<const Ray> rays) const {
  static_assert(kPacket == 16);
  alignas(64) std::array<int, kPacket> valid{};
  RTCRay16 query;
  for (size_t i = 0; i < rays.size(); ++i) {
    const Ray& ray = rays[i];
    if (!traceable(ray)) continue;
    valid[i] = -1;
    query.org_x[i] = ray.origin.x, query.org_y[i] = ray.origin.y, query.org_z[i] = ray.origin.z;
    query.dir_x[i] = ray.direction.x, query.dir_y[i] = ray.direction.y, query.dir_z[i] = ray.direction.z;
    query.tnear[i] = ray.near, query.tfar[i] = ray.far;
    query.time[i] = 0, query.mask[i] = ray.kind, query.flags[i] = 0;
  }
  trace_shadows(impl_->scene, valid.data(), query);
  uint32_t hidden = 0;
  for (size_t i = 0; i < rays.size(); ++i) hidden |= static_cast<uint32_t>(valid[i] && query.tfar[i] < 0) << i;
  return hidden;
}

Bounds Accel::bounds() const {
  RTCBounds b;
  rtcGetSceneBounds(impl_->scene, &b);
  Bounds bounds;
  if (b.lower_x <= b.upper_x) bounds = {{b.lower_x, b.lower_y, b.lower_z}, {b.upper_x, b.upper_y, b.upper_z}};
  return bounds;
}

uint64_t Accel::memory() const { return static_cast<uint64_t>(std::max<int64_t>(0, impl_->memory)); }

std::string embree_version() {
  return std::to_string(RTC_VERSION_MAJOR) + "." + std::to_string(RTC_VERSION_MINOR) + "." + std::to_string(RTC_VERSION_PATCH);
}

void check_embree() {
  const std::string advice = "; load this library with RTLD_LOCAL | RTLD_DEEPBIND";
  RTCDevice device = rtcNewDevice(nullptr);
  if (!device) throw Error(SPPM_UNSUPPORTED, "Embree cannot make a device" + advice);
  const auto found = rtcGetDeviceProperty(device, RTC_DEVICE_PROPERTY_VERSION_MAJOR);
  const bool has_masks = rtcGetDeviceProperty(device, RTC_DEVICE_PROPERTY_RAY_MASK_SUPPORTED) != 0;
  const bool has_filters = rtcGetDeviceProperty(device, RTC_DEVICE_PROPERTY_FILTER_FUNCTION_SUPPORTED) != 0;
  rtcReleaseDevice(device);
  if (found != RTC_VERSION_MAJOR)
    throw Error(SPPM_UNSUPPORTED, "built for Embree " + embree_version() + " but the process answers with Embree " +
                                      std::to_string(found) + advice);
  // Without them rays would meet what they must pass, and nothing would tell.
  if (!has_masks) throw Error(SPPM_UNSUPPORTED, "this Embree was built without ray masks (EMBREE_RAY_MASK)");
  if (!has_filters) throw Error(SPPM_UNSUPPORTED, "this Embree was built without filter functions (EMBREE_FILTER_FUNCTION)");
  const float positions[] = {-1, -1, 0, 1, -1, 0, 0, 1, 0, 0, 0, 0};
  const uint32_t indices[] = {0, 1, 2};
  SppmMeshDesc desc{};
  desc.struct_size = sizeof desc;
  desc.vertex_count = 4, desc.triangle_count = 1;
  desc.positions = positions, desc.indices = indices;
  Mesh mesh(desc);
  Accel accel;
  const Placement placement{&mesh, {}, true};
  accel.build({&placement, 1});
  const auto hit = accel.intersect({{0, 0, 2}, {0, 0, -1}});
  if (!hit || std::abs(hit->t - 2) > 1e-5f) throw Error(SPPM_UNSUPPORTED, "Embree does not find a triangle that is there" + advice);
  const Ray rays[] = {{{0, 0, 2}, {0, 0, -1}}, {{0, 0, 2}, {0, 0, 1}}};
  if (accel.occluded(rays) != 1) throw Error(SPPM_UNSUPPORTED, "Embree does not trace packets of rays (EMBREE_RAY_PACKETS)" + advice);
}

}  // namespace sppm
