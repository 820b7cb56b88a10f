// The reference picture of a cell: a flat swatch of the stitch itself, traced, repeat beside repeat without
// end, with the light of the bake. The pictures that format/picture/swatch_picture.h and the viewer make
// of a fabric of that stitch, from the same place and under the same light, approximate this
// picture.
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
  int samples = 64;  ///< rays a pixel, 2 to 2^20, even
  int bounces = unlimited_bounces;
  IndirectLight indirect = IndirectLight::traced;
  std::optional<double> ground;  ///< as of the bake: what shows it counts as a hole
  ReferencePlane reference;      ///< the height that lies at z = 0: that of the fabric which is compared
  std::uint64_t seed = 1;
};

struct TruthSwatch {
  /// Radiance times opacity, and opacity: the share of the pixel's rays that met yarn. Means over the pixel's
  /// square, all rays counted alike.
  Frame frame;
  /// Root mean square, over pixels and colours, of the standard error of radiance times opacity: half the
  /// difference of two means over independent halves of the rays.
  double noise = 0;
  double alpha_noise = 0;  ///< the same of the opacity
  std::uint64_t rays = 0;
  double seconds = 0;
  IndirectLight indirect = IndirectLight::traced;  ///< not as asked for where the mesh is too large
};

/// Same mesh, shot and options: same values for any number of threads. Refuses (option_out_of_range) lights
/// that are not directional, and options out of their ranges; a mesh that validate() refuses.
Result<TruthSwatch> trace_swatch(const CellMesh& mesh, const std::string& name, const SwatchShot& shot,
                                 const TruthOptions& options = {}, const Progress& progress = {});

}  // namespace selvedge
