// A photon where it arrived at a surface.
#pragma once

#include "vecmath.h"

namespace sppm {

// Caustic photons came by specular surfaces only (L S+ D); they have their own map and radius.
enum PhotonKind { kCaustic = 0, kIndirect = 1, kPhotonKinds = 2 };

struct Photon {
  Vec3 p;
  Vec3 power;              // beta over the number of paths of its batch [W]
  PackedDirection wi = 0;  // where it came from
  PackedDirection ng = 0;  // geometric normal on wi's side
};

}  // namespace sppm
