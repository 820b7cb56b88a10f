// Fit: radiance samples -> fabric. Daubert et al. 2001, section 5.
//
// Per texel and colour channel lobes and view table are fitted together (lobe_fit.h); every mip level is
// fitted to its pooled samples (pool.h), not averaged from the finer level's parameters.
#pragma once

#include <vector>

#include "fitter/lobes/lobe_fit.h"
#include "format/base/progress.h"
#include "format/fabric/fabric.h"
#include "format/quality/fit_record.h"
#include "format/samples/samples.h"

namespace selvedge {

/// The bound on a lobe's peak (channel_problem.h) holds before the table is normalised: in the fabric a lobe
/// may reach its bound times the mean that the table had, and T times the lobe is bounded as before.
struct FitOptions {
  int lobes = 2;                ///< 0 to 16
  bool view_table = true;       ///< else T = 1 and the layer is left out
  bool frames = false;          ///< normals and tangents fitted too, else averaged (frame_fit.h)
  bool light_table = false;     ///< S(l) as well, fitted by turns with all else
  int slab_lobes = 2;           ///< 0 to 16; of slabs, where layers are chosen (budget/candidates.h)
  bool glossy_slabs = false;    ///< these at every level with cells enough, whatever they gain
  DirectionTableOptions table;  ///< see direction_table.h
  int starts = 3;               ///< searches per texel and channel; more on levels of at most 16
  int max_iterations = 60;      ///< of a search
  int levels = 0;               ///< the first so many; 0: down to 1 x 1
  bool partial = false;         ///< the fabric says that levels beyond `levels` are missing
  double tolerance = 1e-4;      ///< share of the cost; an iteration that gains less ends a search
  std::size_t rows_bytes = std::size_t{96} << 20;  ///< samples of level 0 that are held at a time
};

struct FitResult {
  Fabric fabric;
  std::vector<LevelReport> levels;  ///< without `layers`, `bytes` and errors on pairs
  Issues warnings;                  ///< SAMPLES_SPARSE: where information is missing
  PairSamples training;             ///< some of the pairs that were fitted to (training_pairs.h)
  double seconds = 0;
};

/// Fits all levels down to 1 x 1, or as many as the options say. Same samples and options, same fabric for
/// any number of threads. A texel that is a hole from every view becomes black with T = 1 and alpha 0;
/// nothing in the result is NaN or infinite. Samples that are NaN, infinite or negative are refused with
/// their place.
Result<FitResult> fit(const SampleLevel& samples, const SamplesHeader& header, const FitOptions& options = {},
                      const Progress& progress = {});

/// The same from a file, some rows of texels at a time: memory grows with the width of the cell and not with
/// its height.
Result<FitResult> fit(SamplesReader& samples, const FitOptions& options = {}, const Progress& progress = {});

}  // namespace selvedge
