// The levels that pixels ask for, as the viewer's own stages find them, and those that were foreseen.
#pragma once

#include <algorithm>
#include <cmath>

#include "format/scene/level_bounds.h"
#include "tests/viewer/indexed.h"

namespace selvedge::test {

constexpr int seen_width = 100;
constexpr int seen_height = 80;

/// Of the scene's only fabric.
inline LevelRange asked(const Scene& scene, const Camera& camera, const LevelOptions& levels,
                        const Fabric& fabric, LackingLevels* lacking = nullptr, int height = seen_height) {
  const FabricHeader header = header_without_layers(fabric);
  const std::vector<const FabricHeader*> headers{&header};
  std::vector<LackingLevels> missing;
  const LevelRange range = levels_asked(scene, camera, height, levels, headers, &missing)[0];
  if (lacking != nullptr) *lacking = missing[0];
  return range;
}

/// The levels that pixels of the nearest surfaces ask for.
struct Seen {
  int first = 1000;
  int last = -1;
  double finest = HUGE_VAL;  ///< as a number between two levels
  int pixels = 0;
};

/// Of a frame of `scale` times seen_width x seen_height pixels.
inline Seen see(const Scene& scene, const std::vector<Fabric>& fabrics, const Camera& camera,
                const LevelOptions& levels, int scale = 1) {
  Seen seen;
  each_pixel(index_nearest(scene, fabrics, camera, scale * seen_width, scale * seen_height, levels),
             [&](const PixelBlock& block, std::size_t lane) {
               double level = 0;
               double sum = 0;
               for (std::size_t i = 0; i < block.texel_count; ++i) {
                 const auto weight = static_cast<double>(block.texels[i].weight[lane]);
                 if (weight == 0) continue;
                 level += weight * block.texels[i].level[lane];
                 sum += weight;
                 seen.first = std::min(seen.first, block.texels[i].level[lane]);
                 seen.last = std::max(seen.last, block.texels[i].level[lane]);
               }
               seen.finest = std::min(seen.finest, level / sum);
               ++seen.pixels;
             });
  return seen;
}

}  // namespace selvedge::test
