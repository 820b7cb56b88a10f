// Layers for a budget of bytes of the whole file, headers and compression included.
#pragma once

#include <string>

#include "fitter/budget/candidates.h"
#include "format/quality/fit_record.h"

namespace selvedge {

/// The largest of the tried fabrics whose file has at most `budget` bytes. LayerFitter estimates sizes, so up
/// to six files are written beside `output` to learn what the estimate misses. OPTION_OUT_OF_RANGE with the
/// smallest size that was found where no file is small enough.
Result<LayerFit> choose_for_file(const LayerFitter& fitter, double budget, const FabricWriteOptions& options,
                                 const std::string& output);

}  // namespace selvedge
