// The fit of a fabric to radiance samples (Daubert et al. 2001, section 5).
//
// Lobes and view table are fitted together, per texel and colour channel (lobe_fit.h); every mip level is
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
/// may reach its bound times the former mean of the table; T times the lobe is bounded as before.
struct FitOptions {
  int lobes = 2;           ///< 0 to 16
  bool view_table = true;  ///< else T = 1 and the layer is left out
  DirectionTableOptions table;
  int starts = 3;           ///< searches per texel and channel; more on levels of at most 16
  int max_iterations = 60;  ///< of a search
  int levels = 0;           ///< number of levels; 0: down to 1 x 1
  bool partial = false;     ///< the result is a partial fabric if levels after `levels` are missing
  double tolerance = 1e-4;  ///< share of the cost; an iteration that gains less ends a search
  std::size_t rows_bytes = std::size_t{96} << 20;  ///< samples of level 0 in memory at a time
};

struct FitResult {
  Fabric fabric;
  std::vector<LevelReport> levels;  ///< without `layers`, `bytes` and errors on pairs
  Issues warnings;                  ///< SAMPLES_OUTLIER and SAMPLES_SPARSE
  PairSamples training;             ///< some of the fitted pairs (training_pairs.h)
  double seconds = 0;
};

/// Fits all levels down to 1 x 1, or FitOptions::levels. The result does not depend on the number of threads,
/// and is finite. A texel that is a hole from every view becomes black with T = 1 and alpha 0.
/// SAMPLES_NOT_FINITE, with the place, for samples that are NaN, infinite or negative. Lobes and tables are
/// fitted to the grids, and if there are `measured` pairs, then to these.
Result<FitResult> fit(const SampleLevel& samples, const SamplesHeader& header, const FitOptions& options = {},
                      const Progress& progress = {}, const PairSamples& measured = {});

/// Fits a file, some rows of texels at a time: memory grows with the width of the cell, not with its height,
/// but for 48 bytes a texel and measured pair.
Result<FitResult> fit(SamplesReader& samples, const FitOptions& options = {}, const Progress& progress = {});

}  // namespace selvedge
