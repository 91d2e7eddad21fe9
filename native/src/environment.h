// The light that comes from infinitely far: one colour, or an image around everything, sampled by a table of its brightness.
#pragma once

#include <array>
#include <vector>

#include "light_sample.h"
#include "sampling.h"
#include "sppm/sppm.h"
#include "texture.h"
#include "vecmath.h"

namespace sppm {

class Environment {
 public:
  Environment(const SppmWorldDesc& desc, const Textures* textures);  // throws Error

  bool black() const { return is_black(factor_); }
  bool hidden_from_camera() const { return hidden_; }
  double integral() const { return integral_; }  // luminance of radiance over the sphere

  Vec3 radiance(Vec3 direction) const;
  Vec3 sample_direction(Vec2 u, float& pdf) const;  // pdf without the choice
  DirectSample sample_direct(Vec2 u) const;         // light toward any point, the pdf as above
  float pdf_solid_angle(Vec3 direction) const;

 private:
  // A row of the table is a belt around the sphere: sin(latitude) below and above it.
  struct Belt {
    float lo, hi;
  };
  Belt belt(size_t row) const;
  Vec3 to_map(Vec3 direction) const;
  Vec3 to_world(Vec3 direction) const;
  void build_table();

  const Textures* textures_;
  Vec3 factor_;
  uint32_t image_ = 0;  // 0: none
  bool hidden_ = false;
  std::array<float, 9> rotation_{1, 0, 0, 0, 1, 0, 0, 0, 1};
  int map_width_ = 0, map_height_ = 0;
  Distribution map_rows_;
  std::vector<Distribution> map_columns_;
  double integral_ = 0;
};

}  // namespace sppm
