// The texel's frame as part of the fit: the normal and the tangent in which lobes and tables are best. The
// paper averages the normals and leaves fitting them to future work (Daubert et al. 2001, section 8).
#pragma once

#include <array>

#include "fitter/lobes/lobe_fit.h"
#include "fitter/solve/texel_samples.h"

namespace selvedge {

struct FrameFit {
  V3f normal;   ///< unit
  V3f tangent;  ///< unit, perpendicular to it
  std::array<ChannelFit, 3> fits;
  double averaged_error = 0;  ///< squared error in the frame that was given, all lights and channels
  double error = 0;           ///< in the frame found, radiance below its horizon included
};

/// The function that is minimised over frames: the costs of the channels, and the squared radiance below the
/// horizon.
double cost_in_frame(const TexelSamples& samples, const std::array<ChannelFit, 3>& fits);

/// Derivatives of that cost by small turns of the frame about its own axes (tangent, binormal, normal), in
/// 1/rad: where lobes and tables are at their minimum, also the derivatives of the minimum itself.
/// Precondition: no light table.
V3d turning_gradient(const TexelSamples& samples, const std::array<ChannelFit, 3>& fits);

/// Fits in the given frame and some turned ones, then follows the gradient (BFGS) from the best `finalists`.
/// Ends at most at the cost of the frame given, but for the rounding of the frame to half precision. `alpha`
/// and `radiance` as for gather_texel().
FrameFit fit_frame(const float* alpha, const V3f* radiance, const TexelDirections& directions,
                   const V3f& normal, const V3f& tangent, const LobeFitOptions& options);

}  // namespace selvedge
