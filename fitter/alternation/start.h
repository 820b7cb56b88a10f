// Where a fit of products beside lobes begins: functions of what the lobes and tables leave.
#pragma once

#include <functional>
#include <vector>

#include "fitter/alternation/texel.h"

namespace selvedge {

/// What the products of one texel should be at each pair of directions, each pair by itself.
struct TexelRatios {
  std::vector<std::uint32_t> light_of;      ///< index among all lights of each that is there
  std::array<std::vector<float>, 3> value;  ///< [channel][light * stride + view]
  std::array<double, 3> weight{};           ///< of a channel's values among those of other texels
};

/// The `count` strongest pairs of the principal functions of the views and of the lights over all texels, by
/// orthogonal iteration from random functions: no matrix has the size of the lights or views squared.
/// `ratios` gives those of a texel, and is called from several threads; `stride` is their number of views,
/// padded. Deterministic for any number of threads.
SharedFunctions start_functions(std::size_t texels, const std::function<TexelRatios(std::size_t)>& ratios,
                                std::size_t views, std::size_t stride, std::size_t lights, std::size_t count);

}  // namespace selvedge
