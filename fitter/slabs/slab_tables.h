// The fit of the radiance of slabs, the columns of yarn, to samples of the texels of the reference plane.
//
// The heights determine the entry (layers.h) that each ray of a texel hits from each view, so a texel's
// samples are sums over a few entries: alpha r(v, l) = sum over rays of (1/n) sum_a phi_a(v) X[entry][a](l).
// For given heights this is linear in X, with the same matrix for all lights and channels: one sparse
// least-squares problem with many right-hand sides, solved by conjugate gradients.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "format/fabric/fabric.h"
#include "format/samples/samples.h"

namespace selvedge {

/// The entries that the rays of the texels hit from some directions.
struct SlabRays {
  int rays = 1;  ///< of a texel and a direction
  /// [(texel * directions + direction) * rays + ray]: texel * entries + entry, or `no_entry`.
  std::vector<std::uint32_t> entries;
  static constexpr std::uint32_t no_entry = 0xFFFFFFFF;
};

/// `fabric`: the level's, for its period and reference height. Precondition: the level has heights.
SlabRays slab_rays(const FabricLevel& level, const Fabric& fabric, const std::vector<V3f>& directions);

/// Smooth functions of the view, orthonormal over the grid (mean of phi_a phi_b = 1 or 0): phi_0 = 1, then
/// polynomials of degree 1 and 2 in v. [a][view]; at most `count` (1 to 6), without those that depend
/// linearly on others over the grid.
std::vector<std::vector<float>> smooth_view_functions(const DirectionGrid& views, int count);

struct SlabTables {
  std::size_t functions = 1;  ///< of the view
  std::size_t values = 0;     ///< 3 * lights: light by light, red, green, blue
  std::vector<float> value;   ///< [(entry * functions + a) * values + i]
  /// [entry]: sum over texels and views of the squared share of the rays; 0: never seen
  std::vector<double> visibility;
};

/// Factors on the tables of a texel's entries, by the kind of the texel.
struct SlabFactors {
  std::vector<std::uint16_t> kind;  ///< [texel]
  std::vector<float> value;         ///< [(kind * views + view) * values + i], >= 0, of the order of 1
};

/// Least squares over all texels, views, lights and channels, with weak penalties that pull phi_0's table
/// towards the level's mean and the others towards 0, so that an entry that is hardly seen has the mean. Does
/// not depend on the number of threads. `view_functions`: [a][view]. `factors`: null: 1.
SlabTables fit_slabs(const SampleLevel& samples, const SlabRays& rays, std::size_t entries,
                     const std::vector<std::vector<float>>& view_functions,
                     const SlabFactors* factors = nullptr);

/// Heights of the next coarser level, with the same shape: means over finer cells with yarn, or no yarn if
/// these are less than half of a cell's area. Precondition: the finer level is larger than 1 x 1.
HeightLayer pool_heights(const HeightLayer& fine, int width, int height);

/// Resamples heights for any number of texels and any shape with at most as many slabs as `fine`.
HeightLayer regrid_heights(const HeightLayer& fine, int width, int height, const V2i& texels,
                           const SlabShape& shape);

}  // namespace selvedge
