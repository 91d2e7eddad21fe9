// What camera paths and photon paths do alike at a surface: choose one of its lobes, or to go straight through.
#pragma once

#include <algorithm>
#include <array>

#include "color.h"
#include "scene.h"

namespace sppm {

// Probabilities with which a path goes on.
struct LobeChoice {
  std::array<float, kMaxClosures> probability;  // of the lobes that there are
  float through = 0;  // straight on

  // `share(lobe)` is what of the lobe the path stands for.
  template <typename Share>
  LobeChoice(const Bsdf& bsdf, Vec3 transparency, Vec3 from, Share share) {
    through = luminance(transparency);
    float sum = through;
    for (int i = 0; i < bsdf.count; ++i) sum += probability[i] = share(bsdf[i]) * estimated_albedo(bsdf[i], bsdf.at, from);
    if (!(sum > 0)) sum = 1;
    for (int i = 0; i < bsdf.count; ++i) probability[i] /= sum;
    through /= sum;
  }

  LobeChoice(const Bsdf& bsdf, Vec3 transparency, Vec3 from) : LobeChoice(bsdf, transparency, from, [](const Lobe&) { return 1.0f; }) {}

  static constexpr int kThrough = -1, kNothing = -2;
  // Lobe for u in [0, 1), which becomes fresh again; kThrough, or kNothing where light is only absorbed.
  int choose(const Bsdf& bsdf, float& u) const {
    if (u < through) {
      u /= through;
      return kThrough;
    }
    float below = through;
    int last = kNothing;
    for (int i = 0; i < bsdf.count; ++i) {
      if (!(probability[i] > 0)) continue;
      last = i;
      if (u < below + probability[i]) {
        u = std::min((u - below) / probability[i], 0x1.fffffep-1f);
        return i;
      }
      below += probability[i];
    }
    return last;
  }
};

}  // namespace sppm
