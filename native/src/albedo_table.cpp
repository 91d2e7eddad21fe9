// Fills and reads the tables that bsdf.h declares.
#include <algorithm>
#include <cmath>

#include "bsdf.h"
#include "sampling.h"

namespace sppm {
namespace {

float sampled_albedo(const Lobe& lobe, float cos_theta) {
  constexpr int kSamples = 256;
  const ShadingPoint at{{0, 0, 1}, Frame({0, 0, 1})};
  const Vec3 w{std::sqrt(1 - cos_theta * cos_theta), 0, cos_theta};
  double sum = 0;
  for (int k = 0; k < kSamples; ++k) {
    const Sample4 u = Sampler(0, static_cast<uint64_t>(k)).next();
    // Flux, not radiance, is what must be conserved through an interface.
    if (const auto s = sample(lobe, at, w, {u[0], u[1], u[2]}, Transport::kPhoton)) sum += s->weight.x;
  }
  return static_cast<float>(sum / kSamples);
}

Lobe white_lobe(LobeType type, float ior) {
  Lobe lobe;
  lobe.type = type;
  lobe.color = lobe.color2 = {1, 1, 1};
  lobe.ior = ior;
  return lobe;
}

void make_rough(Lobe& lobe, float roughness) {
  lobe.roughness = roughness;
  lobe.alpha = std::max(square(roughness), kSmallestAlpha);
}

}  // namespace

AlbedoTable::AlbedoTable(LobeType type, float ior) {
  Lobe lobe = white_lobe(type, ior);
  fill([&](float roughness, float cos_theta) {
    make_rough(lobe, roughness);
    return sampled_albedo(lobe, cos_theta);
  });
}

AlbedoTable AlbedoTable::edge() {
  AlbedoTable table;
  Lobe white = white_lobe(LobeType::kConductor, 1), black = white;
  black.color = {};
  table.fill([&](float roughness, float cos_theta) {
    make_rough(white, roughness), make_rough(black, roughness);
    return sampled_albedo(black, cos_theta) / sampled_albedo(white, cos_theta);
  });
  return table;
}

template <typename Value>
void AlbedoTable::fill(Value value) {
  for (int i = 0; i < kSize; ++i) {
    const float roughness = static_cast<float>(i) / (kSize - 1);
    for (int j = 0; j < kSize; ++j)
      values_[static_cast<size_t>(i * kSize + j)] = value(roughness, std::max(static_cast<float>(j) / (kSize - 1), 0.01f));
    float average = 0;  // 2 integral of E(mu) mu, by the middles of the table's intervals
    for (int j = 0; j + 1 < kSize; ++j) {
      const auto* row = values_.data() + i * kSize;
      average += (row[j] + row[j + 1]) * (static_cast<float>(j) + 0.5f) / square(kSize - 1);
    }
    averages_[static_cast<size_t>(i)] = average;
  }
}

float AlbedoTable::average(float roughness) const {
  const float y = std::clamp(roughness, 0.0f, 1.0f) * (kSize - 1);
  const auto j = static_cast<size_t>(std::min(static_cast<int>(y), kSize - 2));
  const float t = y - static_cast<float>(j);
  return averages_[j] * (1 - t) + averages_[j + 1] * t;
}

float AlbedoTable::albedo(float cos_theta, float roughness) const {
  const float x = std::clamp(cos_theta, 0.0f, 1.0f) * (kSize - 1), y = std::clamp(roughness, 0.0f, 1.0f) * (kSize - 1);
  const int i = std::min(static_cast<int>(x), kSize - 2), j = std::min(static_cast<int>(y), kSize - 2);
  const float s = x - static_cast<float>(i), t = y - static_cast<float>(j);
  const auto at = [&](int a, int b) { return values_[static_cast<size_t>(b * kSize + a)]; };
  return (at(i, j) * (1 - s) + at(i + 1, j) * s) * (1 - t) + (at(i, j + 1) * (1 - s) + at(i + 1, j + 1) * s) * t;
}

}  // namespace sppm
