// Bake: the yarn or the mesh of a cell -> its radiance samples (Daubert et al. 2001, section 4;
// docs/bake.md).
//
// Texels lie on the cell's reference plane; each view projects them along its direction onto the cloth, which
// repeats without end. Light arrives from one direction at a time with unit perpendicular irradiance,
// directly (with shadows, the yarn's full reflectance) and by way of other yarn.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "converter/light/path_tracer.h"
#include "converter/mesh/cell_mesh.h"
#include "format/base/progress.h"
#include "format/samples/samples.h"

namespace selvedge {

/// How interreflection between yarns is computed.
enum class IndirectLight {
  lines,  ///< of yarn without a mesh: by global lines (line_light.h), any number of bounces
  paths   ///< of a mesh: along paths
};

/// The name in files and options: "lines", "paths".
const char* name_of(IndirectLight indirect);

/// Defaults are the paper's scale.
struct BakeOptions {
  int width = 32;   ///< texels along x, 1 to 4096
  int height = 32;  ///< texels along y
  int views = 64;   ///< 1 to 4096; laid out by nearly_square_grid()
  int lights = 64;
  int samples = 8;  ///< rays per texel and view; of yarn alone at least 36 points, of many texels 9
  int bounces = 2;  ///< of a mesh: indirect bounces, 0 to 64, or unlimited_bounces
  /// Light of a stitch: lines of its yarn alone, paths of a mesh of it. bake() goes by what it is given.
  IndirectLight indirect = IndirectLight::paths;
  bool has_coarse_light = false;  ///< of yarn without a mesh: by an eighth of the lines
  /// Yarn that this differs from in places, with its light: what is far from these keeps it (kept_light.h).
  std::shared_ptr<const Yarns> similar_yarn{};
  /// Views and lights of both sides of the cloth; the samples are four times as many.
  bool both_sides = false;
  int validation_pairs = 96;
  int held_out_pairs = 96;
  /// Pairs that replace the random ones; unit directions with z >= 1e-3, or |z| for both sides.
  std::optional<ByPairKind<std::vector<DirectionPair>>> pairs{};
  int truth_samples = 64;  ///< the same per texel and pair, even
  std::uint64_t seed = 1;
  /// Stores the yarn itself (format/fabric/yarns.h): the yarn of the mesh, or else the result of
  /// find_yarns(), unless more than a tenth of the surface is no round yarn.
  bool stores_yarns = false;
};

struct BakeReport {
  double seconds = 0;
  double coverage = 0;          ///< mean opacity over texels and views
  double noise = 0;             ///< upper estimate of the relative error of the grid's samples (NoiseSum)
  double truth_noise = 0;       ///< the same for the pairs
  int samples = 0;              ///< rays or points per texel and view
  int truth_samples = 0;        ///< the same per texel and pair
  double reference_height = 0;  ///< mm above the lowest point
  int steps_to_rest = 0;        ///< of a knit (FoundStitch)
  double rest_residual = 0;     ///< the same
  IndirectLight indirect = IndirectLight::paths;
  std::vector<std::string> remarks;  ///< options that could not be followed, one line each
};

/// Held-out and validation directions have z >= this: near the horizon hardly any light is seen.
inline constexpr double min_pair_z = 0.15;

struct Baked {
  Samples samples;  ///< rounded as in their file
  BakeReport report;
};

/// Bakes `mesh`. `name` stands for the mesh in messages; `provenance` is a JSON object that the samples keep
/// beside the options. The same mesh, options and seed give the same samples for any number of threads.
Result<Baked> bake(const CellMesh& mesh, const std::string& name, const BakeOptions& options,
                   const std::string& provenance = "{}", const Progress& progress = {});
/// Bakes the yarn of `cell`, which options.stores_yarns stores, without a mesh and without rays: its light by
/// global lines (line_light.h), its samples by the splatter (yarn_samples.h). The same for any number of
/// threads of one kind of processor.
Result<Baked> bake(const YarnCell& cell, const std::string& name, const BakeOptions& options,
                   const std::string& provenance = "{}", const Progress& progress = {});

}  // namespace selvedge
