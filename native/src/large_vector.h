// Where large arrays lie.
#pragma once

#include <cstddef>
#include <cstdlib>
#include <memory>
#include <new>
#include <vector>

#ifdef __linux__
#include <sys/mman.h>
#endif

namespace sppm {

// Takes memory for arrays of megabytes in large pages where the system has them: reads here and there in many small pages wait for the
// page's address as well.
template <typename T>
struct LargePages {
  using value_type = T;

  LargePages() = default;
  template <typename U>
  LargePages(const LargePages<U>&) {}

  T* allocate(size_t count) {
    const size_t bytes = count * sizeof(T);
    if (bytes < kPage) return std::allocator<T>().allocate(count);
    void* memory = std::aligned_alloc(kPage, (bytes + kPage - 1) / kPage * kPage);
    if (!memory) throw std::bad_alloc();
#ifdef __linux__
    madvise(memory, bytes, MADV_HUGEPAGE);  // a wish: without it the pages are small
#endif
    return static_cast<T*>(memory);
  }
  void deallocate(T* memory, size_t count) {
    if (count * sizeof(T) < kPage)
      std::allocator<T>().deallocate(memory, count);
    else
      std::free(memory);
  }
  bool operator==(const LargePages&) const = default;

 private:
  static constexpr size_t kPage = size_t{1} << 21;
};

template <typename T>
using LargeVector = std::vector<T, LargePages<T>>;

}  // namespace sppm
