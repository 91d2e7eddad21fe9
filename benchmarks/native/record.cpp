// Stands between the renderer and Embree by the linker's --wrap: calls of rtcNAME arrive at __wrap_rtcNAME, and Embree's own is
// __real_rtcNAME. The renderer's objects are the product's, unchanged.
#include "record.h"

#include <embree3/rtcore.h>
#include <pmmintrin.h>
#include <xmmintrin.h>

#include <algorithm>
#include <atomic>
#include <memory>
#include <mutex>
#include <vector>

extern "C" {
void __real_rtcIntersect1(RTCScene, RTCIntersectContext*, RTCRayHit*);
void __real_rtcOccluded1(RTCScene, RTCIntersectContext*, RTCRay*);
void __real_rtcIntersect16(const int*, RTCScene, RTCIntersectContext*, RTCRayHit16*);
void __real_rtcOccluded16(const int*, RTCScene, RTCIntersectContext*, RTCRay16*);
}

namespace {

constexpr int kWidth = 16;

struct Packet {
  alignas(64) int valid[kWidth];
  RTCRay16 rays;
};

struct Call {
  RTCScene scene;
  uint32_t context_flags;
  bool is_packet, is_shadow;
};

// What one thread asked for; single rays and packets apart, in the order of `calls`.
struct Log {
  std::vector<Call> calls;
  std::vector<RTCRay> singles;
  std::vector<Packet> packets;

  void clear() { calls.clear(), singles.clear(), packets.clear(); }
};

std::atomic<bool> recording{false};
std::mutex logs_mutex;
std::vector<std::unique_ptr<Log>> logs;  // of all threads there ever were: a thread keeps a pointer to its own

Log& own_log() {
  thread_local Log* log = nullptr;
  if (!log) {
    const std::lock_guard lock(logs_mutex);
    log = logs.emplace_back(std::make_unique<Log>()).get();
  }
  return *log;
}

void note(RTCScene scene, const RTCIntersectContext& context, const RTCRay& ray, bool is_shadow) {
  if (!recording.load(std::memory_order_relaxed)) return;
  Log& log = own_log();
  log.calls.push_back({scene, context.flags, false, is_shadow});
  log.singles.push_back(ray);
}

void note(RTCScene scene, const RTCIntersectContext& context, const int* valid, const RTCRay16& rays, bool is_shadow) {
  if (!recording.load(std::memory_order_relaxed)) return;
  Log& log = own_log();
  log.calls.push_back({scene, context.flags, true, is_shadow});
  Packet& packet = log.packets.emplace_back();
  std::copy_n(valid, kWidth, packet.valid);
  packet.rays = rays;
}

uint64_t active(const Packet& packet) { return static_cast<uint64_t>(kWidth - std::count(packet.valid, packet.valid + kWidth, 0)); }

uint64_t trace(const Call& call, RTCIntersectContext& context, const RTCRay& ray) {
  if (call.is_shadow) {
    RTCRay query = ray;
    __real_rtcOccluded1(call.scene, &context, &query);
    return query.tfar < 0;
  }
  RTCRayHit query;
  query.ray = ray;
  query.hit.geomID = query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  __real_rtcIntersect1(call.scene, &context, &query);
  return query.hit.geomID != RTC_INVALID_GEOMETRY_ID;
}

uint64_t trace(const Call& call, RTCIntersectContext& context, const Packet& packet) {
  uint64_t hits = 0;
  if (call.is_shadow) {
    RTCRay16 query = packet.rays;
    __real_rtcOccluded16(packet.valid, call.scene, &context, &query);
    for (int i = 0; i < kWidth; ++i) hits += packet.valid[i] && query.tfar[i] < 0;
    return hits;
  }
  RTCRayHit16 query;
  query.ray = packet.rays;
  std::fill_n(query.hit.geomID, kWidth, RTC_INVALID_GEOMETRY_ID);
  std::fill_n(query.hit.instID[0], kWidth, RTC_INVALID_GEOMETRY_ID);
  __real_rtcIntersect16(packet.valid, call.scene, &context, &query);
  for (int i = 0; i < kWidth; ++i) hits += packet.valid[i] && query.hit.geomID[i] != RTC_INVALID_GEOMETRY_ID;
  return hits;
}

uint64_t trace(const Log& log) {
  uint64_t hits = 0;
  const RTCRay* single = log.singles.data();
  const Packet* packet = log.packets.data();
  for (const Call& call : log.calls) {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = static_cast<RTCIntersectContextFlags>(call.context_flags);
    hits += call.is_packet ? trace(call, context, *packet++) : trace(call, context, *single++);
  }
  return hits;
}

}  // namespace

extern "C" {

void __wrap_rtcIntersect1(RTCScene scene, RTCIntersectContext* context, RTCRayHit* query) {
  note(scene, *context, query->ray, false);
  __real_rtcIntersect1(scene, context, query);
}

void __wrap_rtcOccluded1(RTCScene scene, RTCIntersectContext* context, RTCRay* ray) {
  note(scene, *context, *ray, true);
  __real_rtcOccluded1(scene, context, ray);
}

void __wrap_rtcIntersect16(const int* valid, RTCScene scene, RTCIntersectContext* context, RTCRayHit16* query) {
  note(scene, *context, valid, query->ray, false);
  __real_rtcIntersect16(valid, scene, context, query);
}

void __wrap_rtcOccluded16(const int* valid, RTCScene scene, RTCIntersectContext* context, RTCRay16* rays) {
  note(scene, *context, valid, *rays, true);
  __real_rtcOccluded16(valid, scene, context, rays);
}

void record_begin(void) {
  for (const auto& log : logs) log->clear();
  recording = true;
}

void record_end(void) { recording = false; }

void record_count(uint64_t* intersect, uint64_t* occluded) {
  *intersect = *occluded = 0;
  for (const auto& log : logs) {
    const Packet* packet = log->packets.data();
    for (const Call& call : log->calls) *(call.is_shadow ? occluded : intersect) += call.is_packet ? active(*packet++) : 1;
  }
}

uint64_t record_replay(void) {
  // As the renderer's threads have it: Embree is slower with denormals.
  const unsigned saved = _mm_getcsr();
  _MM_SET_FLUSH_ZERO_MODE(_MM_FLUSH_ZERO_ON);
  _MM_SET_DENORMALS_ZERO_MODE(_MM_DENORMALS_ZERO_ON);
  uint64_t hits = 0;
  for (const auto& log : logs) hits += trace(*log);
  _mm_setcsr(saved);
  return hits;
}

}  // extern "C"
