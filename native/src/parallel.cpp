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

struct Threads::Arena {
  explicit Arena(uint32_t count) : arena(count == 0 ? tbb::task_arena::automatic : static_cast<int>(count)) {
    // Without leave to have more workers than cores TBB prints a warning and takes fewer.
    if (static_cast<int>(count) > tbb::info::default_concurrency())
      allowance.emplace(tbb::global_control::max_allowed_parallelism, count);
  }

  std::optional<tbb::global_control> allowance;
  tbb::task_arena arena;
};

Threads::Threads(uint32_t count) : arena_(std::make_unique<Arena>(count)) {}

Threads::~Threads() = default;

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

void Threads::for_blocks(uint64_t count, uint64_t grain, const std::function<void(uint64_t, uint64_t)>& body) const {
  const uint64_t blocks = (count + grain - 1) / grain;
  for_each(blocks, [&](uint64_t k) { body(k * grain, std::min(count, (k + 1) * grain)); });
}

const char* tbb_version() { return TBB_VERSION_STRING; }

}  // namespace sppm
