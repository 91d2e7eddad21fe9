// A ray, and which surfaces it may meet where it starts.
#pragma once

#include <array>
#include <cstdint>

#include "vecmath.h"

namespace sppm {

// A triangle of an instance.
struct Face {
  uint32_t instance = 0, triangle = 0;
  bool operator==(const Face&) const = default;
};

// Surfaces that lie in one place (water in its glass, a glass on its table) are met by a ray one after the other, though no distance
// tells them apart. A ray that goes on from such a place starts a little before it and is told which of its faces to meet.
struct Touching {
  enum class Rule : uint8_t { kAll, kNotThese, kOnlyThese };

  static constexpr uint8_t kMost = 4;  // faces; those of deeper stacks are lost, as all were without this

  Rule rule = Rule::kAll;
  uint8_t count = 0;
  float reach = 0;  // how far from the ray's origin the rule holds; a ray leaves a flat face once, so "not these" holds everywhere
  std::array<Face, kMost> faces;

  bool lists(Face face) const {
    for (uint8_t i = 0; i < count; ++i)
      if (faces[i] == face) return true;
    return false;
  }
  bool allows(Face face, float distance) const {
    if (rule == Rule::kNotThese) return !lists(face);
    return distance > reach || lists(face);
  }
  void add(Face face) {
    if (count < kMost) faces[count++] = face;
  }
  void remove(Face face) {
    for (uint8_t i = 0; i < count; ++i)
      if (faces[i] == face) {
        faces[i] = faces[--count];
        return;
      }
  }
};

struct Ray {
  enum Kind : uint32_t { kCamera = 1, kOther = 2 };  // bits: some surfaces are not met by some

  Vec3 origin, direction;  // unit direction
  float near = 0, far = kInfinity;
  Touching touching = {};
  Kind kind = kOther;
};

}  // namespace sppm
