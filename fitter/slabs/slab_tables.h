// Slabs: the radiance of every column of yarn, from the samples of the texels of the plane.
//
// The heights say which entry (fabric.h) each ray of a texel meets from each view, so a texel's samples are
// sums over a few entries: alpha r(v, l) = sum over rays of (1/n) sum_a phi_a(v) X[entry][a](l). For given
// heights that is linear in X, and the matrix is the same for all lights and channels: one sparse
// least-squares problem with many right sides, solved by conjugate gradients.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "format/fabric/fabric.h"
#include "format/samples/samples.h"

namespace selvedge {

/// Which entries the rays of the texels meet from some directions.
struct SlabRays {
  int rays = 1;  ///< of a texel and a direction
  /// [(texel * directions + direction) * rays + ray]: texel * entries + entry, or `nothing`.
  std::vector<std::uint32_t> met;
  static constexpr std::uint32_t nothing = 0xFFFFFFFF;
};

/// The period and the reference height are those of the fabric. Precondition: the level has heights.
SlabRays slab_rays(const FabricLevel& level, const Fabric& fabric, const std::vector<V3f>& directions);

/// Smooth functions of the view, orthonormal over the grid (mean of phi_a phi_b = 1 or 0): phi_0 = 1, then of
/// the first and second degree in v. [a][view]; `count` from 1 to 6, as many as the grid can tell apart.
std::vector<std::vector<float>> smooth_view_functions(const DirectionGrid& views, int count);

struct SlabTables {
  std::size_t functions = 1;  ///< of the view
  std::size_t values = 0;     ///< 3 * lights: light by light, red, green, blue
  std::vector<float> value;   ///< [(entry * functions + a) * values + i]
  std::vector<double>
      seen;  ///< [entry]: sum over texels and views of the squared share of the rays; 0: never
};

/// Factors on the tables of a texel's entries: texels are of few kinds.
struct SlabFactors {
  std::vector<std::uint16_t> kind;  ///< [texel]
  std::vector<float> value;         ///< [(kind * views + view) * values + i], >= 0, of the order of 1
};

/// Least squares over all texels, views, lights and channels, with a slight pull of phi_0's table towards the
/// level's mean and of the others' towards 0: an entry that is hardly seen shows the mean. Deterministic for
/// any number of threads. `views`: [a][view]. `factors`: null: 1.
SlabTables fit_slabs(const SampleLevel& samples, const SlabRays& rays, std::size_t entries,
                     const std::vector<std::vector<float>>& view_functions,
                     const SlabFactors* factors = nullptr);

/// The next coarser level's heights: means over finer cells with yarn, where these are at least half of a
/// cell's area. The shape stays. Precondition: the finer level is larger than 1 x 1.
HeightLayer pool_heights(const HeightLayer& fine, int width, int height);

/// The same for any number of texels and any shape, of which the slabs are at most as many as the finer ones.
HeightLayer regrid_heights(const HeightLayer& fine, int width, int height, const V2i& texels,
                           const SlabShape& shape);

}  // namespace selvedge
