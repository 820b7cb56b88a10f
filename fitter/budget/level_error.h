// The mean squared error of a level on random pairs of directions, by which its candidates are compared.
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

/// The truth of all levels down to 1 x 1, the finest first.
std::vector<LevelTruth> level_truths(const PairSamples& truth);

/// Mean over pairs, texels and channels. `image` returns alpha f of every texel for a pair; it is called from
/// several threads.
double mean_squared_error(const LevelTruth& truth,
                          const std::function<std::vector<V3f>(std::size_t pair)>& image);

/// mean_squared_error() of a level by the reference evaluation. `fabric`: the level's; its levels are not
/// used.
double level_error(const FabricLevel& level, const Fabric& fabric, const std::vector<DirectionPair>& pairs,
                   const LevelTruth& truth);

}  // namespace selvedge
