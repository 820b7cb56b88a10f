// Parts of what `show --json` reports.
#pragma once

#include "apps/common/report.h"
#include "format/scene/lights.h"
#include "viewer/hybrid/probe.h"

namespace selvedge {

Json json_of(const Light& light);
Json json_of(const PixelProbe& probe, const std::vector<std::string>& fabrics);

}  // namespace selvedge
