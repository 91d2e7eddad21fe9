// Parallel loops. Bodies must not depend on which thread runs them: every result here is the same for any number of threads.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>

namespace sppm {

// A set of threads that loops run on.
class Threads {
 public:
  explicit Threads(uint32_t count);  // 0: all cores
  ~Threads();

  // Calls body(i) for every i in [0, count).
  void for_each(uint64_t count, const std::function<void(uint64_t)>& body) const;
  // Calls body(begin, end) for consecutive ranges of at most `grain` that cover [0, count); range k begins at k * grain.
  void for_blocks(uint64_t count, uint64_t grain, const std::function<void(uint64_t, uint64_t)>& body) const;

 private:
  struct Arena;
  std::unique_ptr<Arena> arena_;
};

const char* tbb_version();

}  // namespace sppm
