// Parts of what `show --json` reports.
#pragma once

#include "apps/common/report.h"
#include "viewer/show/picture.h"

namespace selvedge {

Json json_of(const Light& light);
Json json_of(const PixelProbe& probe, const ShowPicture& picture);

}  // namespace selvedge
