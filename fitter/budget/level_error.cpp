#include "fitter/budget/level_error.h"

#include <numeric>

#include "format/base/parallel.h"
#include "format/fabric/evaluate.h"
#include "format/samples/pool.h"

namespace selvedge {

std::vector<LevelTruth> level_truths(const PairSamples& truth) {
  std::vector<LevelTruth> levels(1);
  levels[0].width = truth.width;
  levels[0].height = truth.height;
  const std::size_t texels = truth.width * truth.height;
  for (std::size_t p = 0; p < truth.pairs.size(); ++p) {
    std::vector<V3d> image;
    for (std::size_t i = p * texels; i < (p + 1) * texels; ++i) {
      image.push_back(V3d(truth.radiance[i]) * static_cast<double>(truth.alpha[i]));
    }
    levels[0].pairs.push_back(std::move(image));
  }
  while (levels.back().width > 1 || levels.back().height > 1) {
    LevelTruth coarse;
    coarse.width = level_size(levels.back().width, 1);
    coarse.height = level_size(levels.back().height, 1);
    for (const auto& image : levels.back().pairs) {
      coarse.pairs.push_back(pool_image(image, levels.back().width, levels.back().height));
    }
    levels.push_back(std::move(coarse));
  }
  return levels;
}

double mean_squared_error(const LevelTruth& truth,
                          const std::function<std::vector<V3f>(std::size_t pair)>& image) {
  const std::size_t pairs = truth.pairs.size();
  std::vector<double> sums(pairs, 0);
  parallel_for(0, static_cast<int>(pairs), [&](std::size_t pair) {
    const std::vector<V3f> shown = image(pair);
    for (std::size_t t = 0; t < shown.size(); ++t)
      sums[pair] += (V3d(shown[t]) - truth.pairs[pair][t]).length2();
  });
  const double texels = truth.width * truth.height;
  const double sum = std::accumulate(sums.begin(), sums.end(), 0.0);
  return pairs > 0 ? sum / (3 * texels * static_cast<double>(pairs)) : 0;
}

double level_error(const FabricLevel& level, const Fabric& fabric, const std::vector<DirectionPair>& pairs,
                   const LevelTruth& truth) {
  return mean_squared_error(truth, [&](std::size_t pair) {
    std::vector<V3f> shown;
    for (int t = 0; t < level.texels(); ++t) {
      const Shading s =
          evaluate(level, fabric, t % level.width, t / level.width, pairs[pair].light, pairs[pair].view);
      shown.push_back(s.radiance * s.alpha);
    }
    return shown;
  });
}

}  // namespace selvedge
