// Fit: radiance samples -> fabric. Daubert et al. 2001, section 5.
//
// Per texel and colour channel the lobes (Levenberg-Marquardt) and the view table (closed form) are fitted by
// turns until the table stops changing; every mip level is fitted to its pooled samples (pool.h), not
// averaged from the finer level's parameters.
#pragma once

#include <vector>

#include "format/fabric.h"
#include "format/progress.h"
#include "format/samples.h"

namespace selvedge {

/// The bound on a lobe's peak (lobe_fit.h) holds before the table is normalised: in the fabric a lobe may
/// reach its bound times the mean that the table had, and T times the lobe is bounded as before.
struct FitOptions {
  int lobes = 2;                  ///< 0 to 16
  bool view_table = true;         ///< else T = 1 and the layer is left out
  int max_rounds = 10;            ///< of lobes and table by turns
  double table_tolerance = 0.01;  ///< mean change of the table's entries at which the alternation ends
  double damping = 0.05;          ///< of the table, see view_table.h
};

struct FitLevelReport {
  int width = 0;
  int height = 0;
  double training_error = 0;  ///< relative L2 over all samples, weighted by opacity
  double mean_rounds = 0;
  int unconverged = 0;  ///< texels whose table still changed by more than the tolerance after max_rounds
  double seconds = 0;
};

struct FitResult {
  Fabric fabric;
  std::vector<FitLevelReport> levels;
  double seconds = 0;
};

/// Fits all levels down to 1 x 1. Same samples and options, same fabric for any number of threads. A texel
/// that is a hole from every view becomes black with T = 1 and alpha 0; nothing in the result is NaN or
/// infinite. Takes the samples by value: coarser levels replace finer ones, so that two levels are held at a
/// time.
Result<FitResult> fit(SampleLevel samples, const SamplesHeader& header, const FitOptions& options = {},
                      const Progress& progress = {});

}  // namespace selvedge
