// The record of a fit in a fabric file, which says how good every level is: the members
// `provenance/fit/peak`, `/levels` and `/warnings` of spec/fabric.md.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "format/base/issue_sink.h"
#include "format/fabric/file.h"
#include "format/quality/compare.h"

namespace selvedge {

/// How far a level is from a set of pairs, as compare() has it.
struct FitError {
  int pairs = 0;
  double psnr = 0;  ///< dB, against FitRecord::peak
  double relative_l2 = 0;
};

/// How one level of a fit came out. The file records the first group.
struct LevelReport {
  std::string layers;                ///< as layers_text()
  std::uint64_t bytes = 0;           ///< of the level's values in the file, compressed
  std::optional<FitError> held_out;  ///< none where there are no such pairs
  std::optional<FitError> training;  ///< on pairs that the fit was trained on (training_pairs.h)
  std::optional<double> validation;  ///< root mean square on the validation pairs, 1/sr, where they chose
  std::optional<double> iterations;  ///< of lobes: evaluations of all samples, per texel and channel
  std::optional<int> converged;      ///< texels all of whose channels met the stop rule
  std::optional<int> at_limit;       ///< the others, which came to the limit of iterations

  int width = 0;  ///< texels
  int height = 0;
  std::vector<std::pair<std::string, std::uint64_t>> layer_bytes;  ///< in the file, by the layer's name
  // Of the lobes, where there are `iterations`:
  double training_error = 0;  ///< relative L2 over all samples, weighted by opacity
  double averaged_error = 0;  ///< likewise before frames were fitted; 0 where they were not
  double cost = 0;            ///< the minimised squared error and penalties, as a share of the energy
  int unseen = 0;             ///< texels that are holes from every view
  int one_view = 0;           ///< texels that one view of several sees
  int sparse = 0;             ///< texels with fewer samples than parameters and table entries
  double seconds = 0;
};

struct FitRecord {
  double peak = 0;                  ///< 1/sr, the peak of all PSNR
  std::vector<LevelReport> levels;  ///< of the fabric, level 0 first
  Issues warnings;
};

/// "2 lobes x table", "2 slabs, 2x2 cells, 30 products".
std::string layers_text(const FabricLevel& level);

/// Measures the errors of the record, by compare(); all else in it stays. Either set may be empty; the peak
/// is that of the held-out pairs, or else of the training pairs. Refuses what compare() refuses.
Result<void> measure_errors(const Fabric& fabric, const PairSamples& held_out, const PairSamples& training,
                            FitRecord& record);

/// Writes the fabric with the record in its provenance, layers and bytes being those of the file. The file is
/// written twice, for its own sizes; the first time beside its place.
Result<void> write_fabric(const std::string& path, const Fabric& fabric, FitRecord record,
                          const FabricWriteOptions& options = {});

/// The record that a provenance has; nothing where it has none. What is not as the page says is left out, and
/// the sink gets a FABRIC_ADVICE of it; `levels` is the number of the fabric's levels.
std::optional<FitRecord> fit_record_of(const std::string& provenance, int levels, IssueSink& sink);

/// The record of levels [first, last] of a file alone. Where `changed`, the values are not those that
/// were measured, and the errors are left out.
FitRecord record_of_levels(const FitRecord& record, int first, int last, bool changed);

}  // namespace selvedge
