// Fit of the texel's frame: the normal and the tangent for which lobes and tables fit best. The paper
// averages normals and leaves fitting them to future work (Daubert et al. 2001, section 8).
#pragma once

#include <array>

#include "fitter/lobes/lobe_fit.h"
#include "fitter/solve/texel_samples.h"

namespace selvedge {

struct FrameFit {
  V3f normal;   ///< unit
  V3f tangent;  ///< unit, perpendicular to the normal
  std::array<ChannelFit, 3> fits;
  double averaged_error = 0;  ///< squared error in the given frame, all lights and channels
  double error = 0;           ///< squared error in the fitted frame, including radiance below its horizon
};

/// The cost that is minimised over frames: the costs of the channels plus the squared radiance below the
/// horizon.
double cost_in_frame(const TexelSamples& samples, const std::array<ChannelFit, 3>& fits);

/// Derivatives of cost_in_frame() by small rotations of the frame about its axes (tangent, binormal, normal),
/// 1/rad. If lobes and tables are at their minimum, these are the derivatives of the minimum. Precondition:
/// no light table.
V3d turning_gradient(const TexelSamples& samples, const std::array<ChannelFit, 3>& fits);

/// Fits in the given frame and in some rotated ones, then follows the gradient (BFGS) from the best
/// `finalists`. Apart from the rounding of the frame to half precision, the cost is at most that of the given
/// frame. `alpha` and `radiance` as for gather_texel().
FrameFit fit_frame(const float* alpha, const V3f* radiance, const TexelDirections& directions,
                   const V3f& normal, const V3f& tangent, const LobeFitOptions& options);

}  // namespace selvedge
