// Ray-traces the truth: a picture of a flat swatch of the stitch, repeated without end, under the lights of
// the bake. The viewer's pictures of a fabric approximate it.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "converter/bake/bake.h"
#include "format/base/progress.h"
#include "format/picture/frame.h"
#include "format/scene/swatch.h"

namespace selvedge {

struct TruthOptions {
  int samples = 64;  ///< rays per pixel, 2 to 2^20, even
  int bounces = unlimited_bounces;
  std::uint64_t seed = 1;
};

struct TruthSwatch {
  /// Radiance times opacity, and opacity, the fraction of the pixel's rays that met yarn. Unweighted means
  /// over the pixel's square.
  Frame frame;
  /// Standard error of radiance times opacity: half the difference between the means of two independent
  /// halves of the rays, as root mean square over pixels and colours.
  double noise = 0;
  double alpha_noise = 0;  ///< the same for the opacity
  double seconds = 0;
};

/// The same mesh, shot and options give the same values for any number of threads. Refuses lights that are
/// not directional and options out of range (option_out_of_range), and meshes that validate() refuses.
Result<TruthSwatch> trace_swatch(const CellMesh& mesh, const std::string& name, const SwatchShot& shot,
                                 const TruthOptions& options = {}, const Progress& progress = {});

}  // namespace selvedge
