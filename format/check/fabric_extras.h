// Checks of what readers of layers ignore: unknown parts, the preview, mirrored attributes, the fit record.
#pragma once

#include "format/base/issue_sink.h"
#include "format/exr/exr.h"
#include "format/fabric/header.h"

namespace selvedge {

/// Adds issues of unknown parts and channels, names that tools take for colours, the preview, mirrors of the
/// attribute text, missing levels, and the record of the fit.
void check_extras(const ExrReader& file, const FabricHeader& header, IssueSink& sink);

}  // namespace selvedge
