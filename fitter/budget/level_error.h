// The mean squared error of a level of a fabric on some random pairs of directions: what candidates for the
// level are compared by.
#pragma once

#include <functional>
#include <vector>

#include "format/fabric/fabric.h"
#include "format/samples/samples.h"

namespace selvedge {

/// The truth of one level: alpha r of every pair and texel.
struct LevelTruth {
  int width = 0;
  int height = 0;
  std::vector<std::vector<V3d>> pairs;  ///< [pair][texel]
};

/// Of all levels, the finest first, down to 1 x 1.
std::vector<LevelTruth> level_truths(const PairSamples& truth);

/// Of alpha f, channels and texels together. `image`: alpha f of every texel for a pair; called from several
/// threads.
double mean_squared_error(const LevelTruth& truth,
                          const std::function<std::vector<V3f>(std::size_t pair)>& image);

/// The same of a level by the reference evaluation. `fabric`: the one that the level belongs to; its own
/// levels do not count.
double level_error(const FabricLevel& level, const Fabric& fabric, const std::vector<DirectionPair>& pairs,
                   const LevelTruth& truth);

}  // namespace selvedge
