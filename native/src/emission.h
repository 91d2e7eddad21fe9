// Photons leave the lights: to anywhere, or only along rays that may meet a target. [16.7]
#pragma once

#include <optional>

#include "emissive_mesh.h"
#include "environment.h"
#include "lamp.h"
#include "sampling.h"
#include "targets.h"
#include "vecmath.h"

namespace sppm {

// The start of a photon: weight = L cos / (all pdfs).
struct PhotonStart {
  Vec3 origin, direction, weight;  // the origin is clear of the emitting triangle
};

// What photons are sent at.
struct PhotonAim {
  const Targets* targets;  // null: the whole scene
  Vec3 center;
  float radius;  // of the scene's bounding sphere
};

// From one light, its choice not included; `target` chooses among the targets.
std::optional<PhotonStart> emit(const Lamp& lamp, const PhotonAim& aim, const Sample4& u, float target);
std::optional<PhotonStart> emit(const EmissiveMesh& mesh, const PhotonAim& aim, const Sample4& u, const Sample4& v);
std::optional<PhotonStart> emit(const Environment& environment, const PhotonAim& aim, const Sample4& u, float target);

}  // namespace sppm
