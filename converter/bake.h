// Bake: the mesh of a cell -> its radiance samples. Daubert et al. 2001, section 4.
//
// Texels lie on the cell's reference plane, by default the top face of its bounding box; for each view they
// are projected along the view onto the endlessly repeated mesh. Yarn is Lambert with its albedo; light
// arrives from one direction at a time with unit perpendicular irradiance, directly (with shadows) and after
// up to `bounces` diffuse reflections (unbiased up to that number; cosine-distributed paths, next-event
// estimate at every vertex). What leaves the cell upwards or downwards meets black.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "converter/mesh.h"
#include "format/progress.h"
#include "format/samples.h"

namespace selvedge {

/// Defaults are the paper's scale.
struct BakeOptions {
  int width = 32;   ///< texels along x, 1 to 4096
  int height = 32;  ///< texels along y
  int views = 64;   ///< 1 to 4096; laid out by grid_of()
  int lights = 64;
  int samples = 16;  ///< rays per texel and view
  int bounces = 2;   ///< indirect bounces, 0 to 64
  /// mm above the lowest point; default: the top face, as in the paper. At 0.9 of the thickness both built-in
  /// stitches come out better at level 0 (held-out, paper's scale): knit 19.3 instead of 18.1 dB, weave 17.6
  /// instead of 15.9.
  std::optional<double> reference_height;
  int validation_pairs = 96;
  int held_out_pairs = 96;
  int rim_pairs = 32;
  int truth_samples = 64;  ///< rays per texel and pair of those sets, even
  std::uint64_t seed = 1;
};

struct BakeReport {
  double seconds = 0;
  std::uint64_t rays = 0;  ///< primary, bounce and shadow rays
  double coverage = 0;     ///< mean opacity over texels and views
};

/// Where the boundaries of held-out directions lie: main sets have z >= this, the rim set z below it.
inline constexpr double rim_z = 0.15;

/// Bakes and writes a samples file. `name` stands for the mesh in messages; `provenance` is a JSON object
/// that is kept in the file beside the options. Same mesh, options and seed: same bytes for any number of
/// threads.
Result<BakeReport> bake(const CellMesh& mesh, const std::string& name, const BakeOptions& options,
                        const std::string& provenance, const std::string& output,
                        const Progress& progress = {});

}  // namespace selvedge
