// What in a fabric file no reader of its layers depends on, but other programs and people do.
#pragma once

#include "format/base/issue_sink.h"
#include "format/exr/exr.h"
#include "format/fabric/header.h"

namespace selvedge {

/// Parts and channels that are not known, names that tools take for colours, the preview, mirrors of the
/// attribute text, levels that are missing, the record of the fit.
void check_surroundings(const ExrReader& file, const FabricHeader& header, IssueSink& sink);

}  // namespace selvedge
