// Closures for scenes that tests make.
#pragma once

#include "sppm/sppm.h"

// Of full weight, index 1.5, and one grey for both its colours.
inline SppmClosureDesc closure(SppmClosureType type, float color) {
  SppmClosureDesc c{};
  c.struct_size = sizeof c;
  c.type = type, c.ior = 1.5f;
  for (int i = 0; i < 3; ++i) c.weight.value[i] = 1, c.color.value[i] = c.color2.value[i] = color;
  return c;
}
