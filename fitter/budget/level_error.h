// How far a candidate for a level is from the truth of some random pairs, without building a fabric of it.
#pragma once

#include <vector>

#include "fitter/slabs/shared_basis.h"
#include "fitter/slabs/slab_tables.h"
#include "format/fabric/fabric.h"
#include "format/samples/samples.h"

namespace selvedge {

/// The truth of one level: alpha r of every pair and texel.
struct LevelTruth {
  int width = 0;
  int height = 0;
  std::vector<std::vector<V3d>> pairs;  ///< [pair][texel]
};

/// All levels, the finest first.
std::vector<LevelTruth> level_truths(const PairSamples& truth);

class LevelError {
 public:
  /// `of`: grids, period and reference height. All must outlive the judge.
  LevelError(const LevelTruth& truth, const std::vector<DirectionPair>& pairs, const Fabric& of)
      : truth_(truth), pairs_(pairs), of_(of) {}

  /// Mean squared error of alpha f, channels and texels together, of slabs; `rays` as slab_rays() gives them
  /// for the views of the pairs.
  double error(const Products& slabs, const SlabRays& rays) const;
  /// Of slabs of which every texel has gloss: the layers lobes and frame of `gloss`.
  double error(const Products& slabs, const SlabRays& rays, const FabricLevel& gloss) const;
  /// Of texels with products and an opacity of their own.
  double error(const Products& texels, const OpacityLayer& opacity) const;
  /// Of any level, by the reference evaluation.
  double error(const FabricLevel& level) const;

 private:
  /// `factor` of a pair and an owner of coefficients; what is `seen` of all owners' radiance.
  template <class Factor, class Seen>
  double error_of(const Products& products, const Factor& factor, const Seen& seen) const;
  template <class Factor>
  double error_of_slabs(const Products& slabs, const SlabRays& rays, const Factor& factor) const;

  const LevelTruth& truth_;
  const std::vector<DirectionPair>& pairs_;
  const Fabric& of_;
};

}  // namespace selvedge
