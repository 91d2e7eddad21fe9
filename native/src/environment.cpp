#include "environment.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <string>

#include "color.h"
#include "status.h"

namespace sppm {
namespace {

constexpr int kLargestMap = 1024;  // cells across the sampling table

Vec2 direction_to_map(Vec3 d) {
  return {0.5f - std::atan2(d.y, d.x) / (2 * kPi), 0.5f + std::atan2(d.z, std::sqrt(d.x * d.x + d.y * d.y)) / kPi};
}

Vec3 map_to_direction(Vec2 uv) {
  const float phi = (0.5f - uv.x) * 2 * kPi, theta = (uv.y - 0.5f) * kPi;
  return {std::cos(theta) * std::cos(phi), std::cos(theta) * std::sin(phi), std::sin(theta)};
}

}  // namespace

Environment::Environment(const SppmWorldDesc& d, const Textures* textures) : textures_(textures) {
  for (const float r : d.radiance) require(std::isfinite(r) && r >= 0, "world: radiance must be finite and at least 0");
  require(d.image <= textures_->image_count(), "world: image " + std::to_string(d.image) + " is not of this scene");
  factor_ = {d.radiance[0], d.radiance[1], d.radiance[2]};
  image_ = d.image;
  hidden_ = d.hidden_from_camera != 0;
  bool given = false;
  for (const float r : d.rotation) {
    require(std::isfinite(r), "world: rotation must be finite");
    given |= r != 0;
  }
  if (given) std::copy(d.rotation, d.rotation + 9, rotation_.begin());
  if (image_ == 0)
    integral_ = 4 * M_PI * static_cast<double>(luminance(factor_));
  else if (!black())
    build_table();
}

Vec3 Environment::to_map(Vec3 d) const {
  const auto& r = rotation_;
  return {r[0] * d.x + r[1] * d.y + r[2] * d.z, r[3] * d.x + r[4] * d.y + r[5] * d.z, r[6] * d.x + r[7] * d.y + r[8] * d.z};
}

Vec3 Environment::to_world(Vec3 d) const {
  const auto& r = rotation_;
  return {r[0] * d.x + r[3] * d.y + r[6] * d.z, r[1] * d.x + r[4] * d.y + r[7] * d.z, r[2] * d.x + r[5] * d.y + r[8] * d.z};
}

Vec3 Environment::radiance(Vec3 d) const {
  if (image_ == 0) return factor_;
  const Image& image = textures_->image(image_);
  Vec2 uv = direction_to_map(to_map(d));
  const float half_texel = 0.5f / static_cast<float>(image.height());
  uv.y = std::clamp(uv.y, half_texel, 1 - half_texel);  // around the sphere it repeats, from pole to pole it does not
  return factor_ * max(image.sample(uv, SPPM_LINEAR_FILTER, SPPM_REPEAT).color, {});
}

void Environment::build_table() {
  const Image& image = textures_->image(image_);
  map_width_ = static_cast<int>(std::clamp<int64_t>(image.width(), 1, kLargestMap));
  map_height_ = static_cast<int>(std::clamp<int64_t>(image.height(), 1, kLargestMap / 2));
  std::vector<double> cells(static_cast<size_t>(map_width_ * map_height_), 0.0);
  // Bilinear lookup spreads a texel over its neighbours, so each adds to the cells that its footprint meets.
  for (int64_t y = 0; y < image.height(); ++y) {
    for (int64_t x = 0; x < image.width(); ++x) {
      const double value = static_cast<double>(std::max(0.0f, luminance(factor_ * image.texel(x, y).color)));
      for (int dy = -1; dy <= 1; ++dy)
        for (int dx = -1; dx <= 1; ++dx) {
          const int64_t px = ((x + dx) % image.width() + image.width()) % image.width();
          const int64_t py = std::clamp<int64_t>(y + dy, 0, image.height() - 1);
          const int64_t cell = py * map_height_ / image.height() * map_width_ + px * map_width_ / image.width();
          cells[static_cast<size_t>(cell)] += value * (dx == 0 && dy == 0 ? 0.5 : 0.0625);
        }
    }
  }
  std::vector<double> rows;
  const double texels_per_cell = static_cast<double>(image.width() * image.height()) / (map_width_ * map_height_);
  for (int y = 0; y < map_height_; ++y) {
    const double below = std::sin(M_PI * (static_cast<double>(y) / map_height_ - 0.5));
    const double above = std::sin(M_PI * ((y + 1.0) / map_height_ - 0.5));
    const double solid = 2 * M_PI / map_width_ * (above - below);
    std::span<double> row(cells.data() + y * map_width_, static_cast<size_t>(map_width_));
    for (double& c : row) c *= solid / texels_per_cell;
    map_columns_.emplace_back(row);
    rows.push_back(map_columns_.back().total());
    integral_ += rows.back();
  }
  map_rows_ = Distribution(rows);
}

Environment::Belt Environment::belt(size_t row) const {
  const float h = static_cast<float>(map_height_);
  return {std::sin(kPi * (static_cast<float>(row) / h - 0.5f)), std::sin(kPi * (static_cast<float>(row + 1) / h - 0.5f))};
}

Vec3 Environment::sample_direction(Vec2 u, float& pdf) const {
  if (image_ == 0) {
    pdf = 1 / (4 * kPi);
    return sample_sphere(u);
  }
  pdf = 0;
  if (map_rows_.empty()) return {0, 0, 1};
  float in_row = u.y, in_column = u.x;
  const size_t row = map_rows_.sample(in_row);
  const size_t column = map_columns_[row].sample(in_column);
  // Uniform over the cell's solid angle: uniform in sin(theta).
  const auto [lo, hi] = belt(row);
  const float v = std::asin(std::clamp(lo + (hi - lo) * in_row, -1.0f, 1.0f)) / kPi + 0.5f;
  const Vec3 d = map_to_direction({(static_cast<float>(column) + in_column) / static_cast<float>(map_width_), v});
  const float cell_solid_angle = 2 * kPi / static_cast<float>(map_width_) * (hi - lo);
  pdf = map_rows_.probability(row) * map_columns_[row].probability(column) / cell_solid_angle;
  return to_world(d);
}

DirectSample Environment::sample_direct(Vec2 u) const {
  DirectSample s;
  s.wi = sample_direction(u, s.pdf);
  s.distance = kInfinity;
  s.radiance = radiance(s.wi);
  return s;
}

float Environment::pdf_solid_angle(Vec3 d) const {
  if (image_ == 0) return 1 / (4 * kPi);
  if (map_rows_.empty()) return 0;
  const Vec2 uv = direction_to_map(to_map(d));
  const auto row = static_cast<size_t>(std::clamp(static_cast<int>(uv.y * static_cast<float>(map_height_)), 0, map_height_ - 1));
  const auto column = static_cast<size_t>(std::clamp(static_cast<int>(uv.x * static_cast<float>(map_width_)), 0, map_width_ - 1));
  if (map_columns_[row].empty()) return 0;
  const auto [lo, hi] = belt(row);
  return map_rows_.probability(row) * map_columns_[row].probability(column) * static_cast<float>(map_width_) / (2 * kPi * (hi - lo));
}

}  // namespace sppm
