// Bake: the mesh of a cell -> its radiance samples. Daubert et al. 2001, section 4; docs/bake.md.
//
// Texels lie on the cell's reference plane; for each view they are projected along the view onto the
// endlessly repeated mesh. Light arrives from one direction at a time with unit perpendicular irradiance,
// directly (with shadows, the yarn's full reflectance) and after up to `bounces` reflections.
//
// Every finished view and pair goes into a journal beside the output; the samples file is written from it at
// the end. A bake that was killed is continued from its journal.
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

/// How light that yarn reflects to yarn is found.
enum class IndirectLight {
  cached,  ///< once per point of the mesh (irradiance_cache.h); meshes too large for that are traced, and the
           ///< report and the file say so
  traced   ///< along paths from every sample: slower, noisier, no approximation
};

/// As the option and the file call it: "cached", "traced".
const char* name_of(IndirectLight indirect);

/// The height at which texels lie, above the cell's lowest point.
struct ReferencePlane {
  enum class Kind {
    top,    ///< of the cell's bounding box, as in the paper
    mean,   ///< of what is seen straight from above
    best,   ///< of those tried by best_reference_height()
    share,  ///< `value` times the thickness
    at      ///< `value` in mm
  };
  /// At this share every built-in stitch comes out best, or near to it: docs/bake.md has the table.
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
  /// Instead of `samples`: as few (a power of two, at most 65,536) as keep the noise of the samples, as
  /// BakeReport has it, below this. Found on eight views.
  std::optional<double> noise;
  /// Seconds for the whole bake; `samples` and `truth_samples` are scaled alike to fill them.
  std::optional<double> time_budget;
  int bounces = 2;  ///< indirect bounces, 0 to 64, or unlimited_bounces
  IndirectLight indirect = IndirectLight::cached;
  /// Albedo of a Lambert plane at the cell's lowest point; none: what leaves downwards meets black.
  std::optional<double> ground;
  ReferencePlane reference;
  int validation_pairs = 96;
  int held_out_pairs = 96;
  int rim_pairs = 32;
  /// By PairKind, instead of the random ones; unit directions with z >= 1e-3.
  std::optional<std::array<std::vector<DirectionPair>, 3>> pairs;
  int truth_samples = 64;  ///< rays per texel and pair of those sets, even
  std::uint64_t seed = 1;
  /// Slabs of yarn whose heights are kept, one above the other, over cells x cells points of a texel
  /// (cell_heights.h); 0: none.
  int slabs = 0;
  int cells = 6;                     ///< of which a fit makes 2 and 3
  std::optional<WholeFabric> whole;  ///< where width and height are those of one of its coarser levels
  bool resumable = true;             ///< an interrupted bake leaves its journal for the next one
};

struct BakeReport {
  double seconds = 0;
  std::uint64_t rays = 0;       ///< primary, bounce and shadow rays of this run
  int units = 0;                ///< views and pairs that were baked in this run
  int resumed = 0;              ///< and those that a journal had
  double coverage = 0;          ///< mean opacity over texels and views
  double noise = 0;             ///< relative error of the samples of the grid (NoiseSum), an upper estimate
  double truth_noise = 0;       ///< and of the pairs
  int samples = 0;              ///< rays per texel and view
  int truth_samples = 0;        ///< and per texel and pair
  double reference_height = 0;  ///< mm above the lowest point
  /// How it was done, which is not as asked for where the mesh is too large.
  IndirectLight indirect = IndirectLight::cached;
  std::vector<std::string> remarks;  ///< what was done otherwise than asked for, one line each
};

struct BakeProgress {
  double fraction = 0;  ///< done, in [0, 1]
  double rays_per_second = 0;
  double noise = 0;  ///< so far, as BakeReport::noise
};
using BakeWatcher = std::function<void(const BakeProgress&)>;

/// Where the boundaries of held-out directions lie: main sets have z >= this, the rim set z below it.
inline constexpr double rim_z = 0.15;

/// Bakes and writes a samples file. `name` stands for the mesh in messages; `provenance` is a JSON object
/// that is kept in the file beside the options. Same mesh, options and seed: same bytes for any number of
/// threads, whether interrupted or not; with a time budget, for the sample counts that it led to. The journal
/// is `output`.journal; one of another bake is replaced.
Result<BakeReport> bake(const CellMesh& mesh, const std::string& name, const BakeOptions& options,
                        const std::string& provenance, const std::string& output,
                        const BakeWatcher& watcher = {});

/// Bakes a part: `output` is a finished journal, for merge_shards(). No time budget.
Result<BakeReport> bake_shard(const CellMesh& mesh, const std::string& name, const BakeOptions& options,
                              const std::string& provenance, const BakeShard& shard,
                              const std::string& output, const BakeWatcher& watcher = {});

/// Puts the shards of one bake, in any order, into the samples file that the whole would have given. Refuses
/// (samples_malformed) shards of different bakes, missing units and damaged files.
Result<BakeReport> merge_shards(std::span<const std::string> shards, const std::string& output);

}  // namespace selvedge
