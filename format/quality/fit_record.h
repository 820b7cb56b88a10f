// The errors of a fit as a fabric file records them: the members `provenance/fit/peak`, `/levels` and
// `/warnings` of spec/fabric.md.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "format/base/issue_sink.h"
#include "format/fabric/file.h"
#include "format/quality/compare.h"

namespace selvedge {

/// Error of a level on a set of pairs, by compare().
struct FitError {
  int pairs = 0;
  double psnr = 0;  ///< dB, against FitRecord::peak
  double relative_l2 = 0;
};

/// Result of the fit of one level. The file records the first group of members.
struct LevelReport {
  std::string layers;                ///< as layers_text()
  std::uint64_t bytes = 0;           ///< of the level's values in the file, compressed
  std::optional<FitError> held_out;  ///< empty without held-out pairs
  std::optional<FitError> training;  ///< on pairs that the fit was trained on (training_pairs.h)
  std::optional<double> validation;  ///< root mean square error on the pairs that chose the layers, 1/sr
  std::optional<double> iterations;  ///< of lobes: evaluations of all samples, per texel and channel
  std::optional<int> converged;      ///< number of texels that met the stop rule in all channels
  std::optional<int> at_limit;       ///< number of the other texels, which reached the limit of iterations

  int width = 0;  ///< texels
  int height = 0;
  std::vector<std::pair<std::string, std::uint64_t>> layer_bytes;  ///< in the file, by the layer's name
  // For fits of lobes:
  double training_error = 0;  ///< relative L2 over all samples, weighted by opacity
  double cost = 0;            ///< the minimised squared error and penalties, as a share of the energy
  int unseen = 0;             ///< texels that are holes from every view
  int one_view = 0;           ///< texels that only one of several views sees
  int sparse = 0;             ///< texels with fewer samples than parameters and table entries
  double seconds = 0;
};

/// Layers whose values belong to no level, though they are stored at level 0: not among LevelReport::bytes.
inline constexpr LayerSet layers_of_no_level{LayerKind::bases, LayerKind::yarns, LayerKind::indirect};

struct FitRecord {
  double peak = 0;                  ///< 1/sr, the peak of all PSNR
  std::vector<LevelReport> levels;  ///< of the fabric, level 0 first
  /// Those of the other sides, by index_of(Side) - 1; none where the fabric does not have the side.
  std::array<std::vector<LevelReport>, other_sides.size()> sides;
  Issues warnings;
};

/// "2 lobes x table", "30 products".
std::string layers_text(const FabricLevel& level);

/// Sets the errors of the levels by compare(), and the peak unless it is set. Either set may be empty; the
/// peak is that of the held-out pairs, or without them of the training pairs. Errors are those of compare().
Result<void> measure_errors(const Fabric& fabric, const PairSamples& held_out, const PairSamples& training,
                            double& peak, std::vector<LevelReport>& levels);

/// Writes the fabric with the record in its provenance; layers and bytes are set from the file. Therefore the
/// file is written twice, first under a temporary name.
Result<void> write_fabric(const std::string& path, const Fabric& fabric, FitRecord record,
                          const FabricWriteOptions& options = {});

/// The record in a provenance, if there is one. One that breaks the rules of spec/fabric.md is left out and
/// reported to the sink as FABRIC_ADVICE; `levels` is the number of the fabric's levels.
std::optional<FitRecord> fit_record_of(const std::string& provenance, int levels, IssueSink& sink);

/// A provenance without what a record measured, where that can no longer be known to hold.
std::string without_fit_record(const std::string& provenance);

/// The record of levels [first, last]. If `changed`, the values differ from the measured ones, and the errors
/// are left out.
FitRecord record_of_levels(const FitRecord& record, int first, int last, bool changed);

}  // namespace selvedge
