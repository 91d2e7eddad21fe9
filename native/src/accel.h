// Ray tracing. The only part that knows Embree.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "mesh.h"
#include "ray.h"

namespace sppm {

struct Hit {
  float t = 0, u = 0, v = 0;  // distance; barycentrics of the second and third vertex
  uint32_t instance = 0, triangle = 0;
};

// A mesh placed in the world.
struct Placement {
  const Mesh* mesh;
  Affine transform;
  bool identity;         // the mesh is already in world space
  bool movable = false;  // `place` may be called for it
  bool hidden_from_camera = false;
};

// False where rays cannot be brought to the object's space: it is squeezed flat or nearly so, or very small or far away.
bool can_be_instanced(const Affine& transform);

class Accel {
 public:
  Accel();
  ~Accel();
  Accel(const Accel&) = delete;
  Accel& operator=(const Accel&) = delete;

  static constexpr size_t kPacket = 16;

  // Meshes must outlive the accel: their arrays are shared with it.
  void build(std::span<const Placement> placements);
  // Places again what is movable; `commit` ends any number of such calls, and costs as much as the number of instances says.
  void place(uint32_t index, const Placement& placement);
  void commit();
  std::optional<Hit> intersect(const Ray& ray) const;
  // Whether something stands in the way of at most kPacket rays, traced together: bit i tells of ray i. Touching rules do not count.
  uint32_t occluded(std::span<const Ray> rays) const;
  Bounds bounds() const;
  uint64_t memory() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

std::string embree_version();
// Throws Error(SPPM_UNSUPPORTED) unless the Embree that calls reach is the one built for and finds a triangle.
void check_embree();

}  // namespace sppm
