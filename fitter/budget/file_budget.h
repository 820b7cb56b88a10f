// Chooses layers for a budget of bytes of the whole file, including headers and compression.
#pragma once

#include <string>

#include "fitter/budget/candidates.h"
#include "format/quality/fit_record.h"

namespace selvedge {

/// The largest fabric found with a file of at most `budget` bytes. LayerFitter only estimates sizes, so up to
/// six temporary files are written beside `output` to correct the estimate. OPTION_OUT_OF_RANGE, with the
/// smallest size found, if no file is small enough.
/// `yarns`, unless null, count as part of the file.
Result<LayerFit> choose_for_file(const LayerFitter& fitter, double budget, const FabricWriteOptions& options,
                                 const std::shared_ptr<const Yarns>& yarns, const std::string& output);

}  // namespace selvedge
