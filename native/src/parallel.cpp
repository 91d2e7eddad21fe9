#include "parallel.h"

#include <pmmintrin.h>
#include <tbb/global_control.h>
#include <tbb/info.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>
#include <tbb/version.h>
#include <xmmintrin.h>

#include <algorithm>
#include <optional>

#ifdef __SANITIZE_THREAD__
#include <atomic>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>
#endif

namespace sppm {
namespace {

// Denormals cost hundreds of cycles each and Embree asks for them to be off; the host's own threads get their mode back.
class FlushDenormals {
 public:
  FlushDenormals() : saved_(_mm_getcsr()) {
    _MM_SET_FLUSH_ZERO_MODE(_MM_FLUSH_ZERO_ON);
    _MM_SET_DENORMALS_ZERO_MODE(_MM_DENORMALS_ZERO_ON);
  }
  ~FlushDenormals() { _mm_setcsr(saved_); }

 private:
  unsigned saved_;
};

}  // namespace

#ifndef __SANITIZE_THREAD__

constexpr size_t kMostThreads = 4096;  // that the settings allow

struct Threads::Arena {
  explicit Arena(uint32_t count) : arena(count == 0 ? tbb::task_arena::automatic : static_cast<int>(count)) {
    // Without leave to have more workers than cores TBB prints a warning and takes fewer. The least leave that anyone holds counts, so all
    // ask for the same.
    if (static_cast<int>(count) > tbb::info::default_concurrency())
      allowance.emplace(tbb::global_control::max_allowed_parallelism, kMostThreads);
  }

  std::optional<tbb::global_control> allowance;
  tbb::task_arena arena;
};

void Threads::for_each(uint64_t count, const std::function<void(uint64_t)>& body) const {
  arena_->arena.execute([&] {
    tbb::parallel_for(
        uint64_t{0}, count,
        [&](uint64_t i) {
          const FlushDenormals scope;
          body(i);
        },
        tbb::auto_partitioner());
  });
}

#else  // ThreadSanitizer does not see how TBB's library orders memory; on threads of its own it judges the bodies.

struct Threads::Arena {
  explicit Arena(uint32_t count) : threads(count == 0 ? 4 : count) {}

  uint32_t threads;
};

void Threads::for_each(uint64_t count, const std::function<void(uint64_t)>& body) const {
  std::atomic<uint64_t> next{0};  // relaxed: it must not order what the bodies do
  std::mutex mutex;
  std::exception_ptr error;
  const auto work = [&] {
    const FlushDenormals scope;
    try {
      for (uint64_t i; (i = next.fetch_add(1, std::memory_order_relaxed)) < count;) body(i);
    } catch (...) {
      next = count;
      const std::lock_guard lock(mutex);
      error = std::current_exception();
    }
  };
  std::vector<std::thread> threads;
  for (uint64_t t = 0; t < std::min<uint64_t>(arena_->threads, count); ++t) threads.emplace_back(work);
  for (std::thread& thread : threads) thread.join();
  if (error) std::rethrow_exception(error);
}

#endif

Threads::Threads(uint32_t count) : arena_(std::make_unique<Arena>(count)) {}

Threads::~Threads() = default;

void Threads::for_blocks(uint64_t count, uint64_t grain, const std::function<void(uint64_t, uint64_t)>& body) const {
  const uint64_t blocks = (count + grain - 1) / grain;
  for_each(blocks, [&](uint64_t k) { body(k * grain, std::min(count, (k + 1) * grain)); });
}

const char* tbb_version() { return TBB_VERSION_STRING; }

}  // namespace sppm
