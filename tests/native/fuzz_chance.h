// Random choices for the fuzz test, all from one seed.
#pragma once

#include <cmath>
#include <cstdint>
#include <cstring>
#include <initializer_list>
#include <random>
#include <span>
#include <vector>

class Chance {
 public:
  explicit Chance(uint64_t seed) : random_(seed) {}

  uint64_t bits() { return random_(); }
  // A whole number from 0 to n - 1.
  uint32_t below(uint32_t n) { return static_cast<uint32_t>(random_() % n); }
  bool one_in(uint32_t n) { return below(n) == 0; }
  float from_to(float low, float high) { return low + (high - low) * static_cast<float>(random_() >> 40) * 0x1p-24f; }
  float around_zero(float reach) { return from_to(-reach, reach); }
  // 10^low to 10^high, every order of magnitude alike.
  float magnitude(float low, float high) { return std::pow(10.0f, from_to(low, high)); }
  template <typename T>
  T any_of(std::initializer_list<T> values) {
    return values.begin()[below(static_cast<uint32_t>(values.size()))];
  }

  // Overwrites a few words of a struct by what fields should not hold. Members listed in `kept` stay: pointers, counts of what they
  // point at, and what would only make the render large.
  template <typename Desc, typename... Kept>
  void scramble(Desc& desc, Kept Desc::*... kept) {
    [[maybe_unused]] const Desc before = desc;
    for (uint32_t words = 1 + below(3); words > 0; --words) {
      const uint32_t word = bad_word();
      std::memcpy(reinterpret_cast<char*>(&desc) + 4 * below(sizeof desc / 4), &word, 4);
    }
    ((desc.*kept = before.*kept), ...);
    if (!one_in(40)) desc.struct_size = sizeof desc;
  }
  template <typename T>
  void scramble_element(std::vector<T>& values) {
    static_assert(sizeof(T) == 4);
    const uint32_t word = bad_word();
    if (!values.empty()) std::memcpy(&values[bits() % values.size()], &word, 4);
  }

 private:
  uint32_t bad_word() {
    if (one_in(3)) return static_cast<uint32_t>(bits());
    if (one_in(3)) return below(20);
    const float number = any_of({0.0f, -0.0f, 1.0f, -1.0f, 1e-45f, 1e-38f, 1e-20f, 1e-7f, 1e7f, 1e20f, 1e30f, 3.4e38f, -3.4e38f, INFINITY,
                                 -INFINITY, NAN});
    uint32_t word;
    std::memcpy(&word, &number, 4);
    return word;
  }

  std::mt19937_64 random_;
};
