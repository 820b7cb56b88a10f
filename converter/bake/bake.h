// Bake: the mesh of a cell -> its radiance samples (Daubert et al. 2001, section 4; docs/bake.md).
//
// Texels lie on the cell's reference plane; each view projects them along its direction onto the mesh, which
// repeats without end. Light arrives from one direction at a time with unit perpendicular irradiance,
// directly (with shadows, the yarn's full reflectance) and after up to `bounces` reflections.
//
// Every finished view and pair goes into a journal beside the output; the samples file is written from it at
// the end. A bake that was interrupted continues from its journal.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "converter/light/path_tracer.h"
#include "converter/mesh/cell_mesh.h"
#include "format/samples/samples.h"

namespace selvedge {

/// How interreflection between yarns is computed.
enum class IndirectLight {
  cached,  ///< by interpolation between points of the mesh (irradiance_cache.h); meshes that need too many
           ///< points are traced, which report and file record
  traced   ///< along paths from every sample: slower and noisier, without approximation
};

/// The name in options and files: "cached", "traced".
const char* name_of(IndirectLight indirect);

/// The height at which texels lie, above the cell's lowest point.
struct ReferencePlane {
  enum class Kind {
    top,    ///< top of the cell's bounding box, as in the paper
    share,  ///< `value` times the thickness
    at      ///< `value` in mm
  };
  /// This share is the best or close to it for every built-in stitch (table in docs/bake.md).
  Kind kind = Kind::share;
  double value = 0.9;
};

/// A part of a bake: the units (views, pairs) whose number leaves `index` when divided by `count`.
struct BakeShard {
  int index = 0;
  int count = 1;
};

/// Defaults are the paper's scale.
struct BakeOptions {
  int width = 32;   ///< texels along x, 1 to 4096
  int height = 32;  ///< texels along y
  int views = 64;   ///< 1 to 4096; laid out by grid_of()
  int lights = 64;
  int samples = 8;  ///< rays per texel and view
  int bounces = 2;  ///< indirect bounces, 0 to 64, or unlimited_bounces
  IndirectLight indirect = IndirectLight::cached;
  /// Albedo of a Lambertian plane at the cell's lowest point; without it, light below is lost.
  std::optional<double> ground;
  /// Views and lights of both sides of the cloth; the samples are four times as many. Not above a ground.
  bool both_sides = false;
  ReferencePlane reference;
  int validation_pairs = 96;
  int held_out_pairs = 96;
  int rim_pairs = 32;
  /// Pairs by PairKind that replace the random ones; unit directions with z >= 1e-3, or |z| for both sides.
  std::optional<ByPairKind<std::vector<DirectionPair>>> pairs;
  int truth_samples = 64;  ///< rays per texel and pair of those sets, even
  std::uint64_t seed = 1;
  /// Stores the yarn itself (format/fabric/yarns.h): that of the mesh, or else what find_yarns() finds,
  /// unless more than half of the surface is no round yarn.
  bool yarns = false;
  /// Of indirect light, from each of 16 places around every station of a yarn; of yarns with fibres 3/8 of
  /// them.
  int yarn_paths = 128;
  std::optional<WholeFabric> whole;  ///< set if width and height belong to a coarser level of this fabric
  bool resumable = true;  ///< an interrupted bake leaves its journal, from which the next one continues
};

struct BakeReport {
  double seconds = 0;
  std::uint64_t rays = 0;       ///< primary, bounce and shadow rays of this run
  int units = 0;                ///< views and pairs baked in this run
  int resumed = 0;              ///< views and pairs found in a journal
  double coverage = 0;          ///< mean opacity over texels and views
  double noise = 0;             ///< upper estimate of the relative error of the grid's samples (NoiseSum)
  double truth_noise = 0;       ///< the same for the pairs
  int samples = 0;              ///< rays per texel and view
  int truth_samples = 0;        ///< rays per texel and pair
  double reference_height = 0;  ///< mm above the lowest point
  /// The method used: `traced` if the mesh is too large for a cache.
  IndirectLight indirect = IndirectLight::cached;
  std::vector<std::string> remarks;  ///< options that could not be followed, one line each
};

struct BakeProgress {
  double fraction = 0;  ///< done, in [0, 1]
  double rays_per_second = 0;
  double noise = 0;  ///< BakeReport::noise so far
};
using BakeWatcher = std::function<void(const BakeProgress&)>;

/// Boundary between the sets of held-out directions: z >= rim_z in the main sets, below it in the rim set.
inline constexpr double rim_z = 0.15;

/// Bakes `mesh` and writes a samples file. `name` stands for the mesh in messages; `provenance` is a JSON
/// object that the file keeps beside the options. The same mesh, options and seed give the same bytes for any
/// number of threads, whether interrupted or not. The journal is `output`.journal; a journal of another bake
/// is replaced.
Result<BakeReport> bake(const CellMesh& mesh, const std::string& name, const BakeOptions& options,
                        const std::string& provenance, const std::string& output,
                        const BakeWatcher& watcher = {});

/// Bakes one shard to `output`, a finished journal for merge_shards().
Result<BakeReport> bake_shard(const CellMesh& mesh, const std::string& name, const BakeOptions& options,
                              const std::string& provenance, const BakeShard& shard,
                              const std::string& output, const BakeWatcher& watcher = {});

/// Merges the shards of one bake, in any order, into the samples file of the whole bake. Refuses
/// (samples_malformed) shards of different bakes, missing units and damaged files.
Result<BakeReport> merge_shards(std::span<const std::string> shards, const std::string& output);

}  // namespace selvedge
