// Blocks a knit: holds its repeat at a size, as pins on a board do, in which the yarn then rests.
#pragma once

#include <string>
#include <vector>

#include "converter/stitch/parameters.h"
#include "converter/stitch/yarn_relax.h"

namespace selvedge {

/// `width_mm` and `height_mm`; `period_mm`: their defaults, which do not block.
std::vector<StitchParameter> blocking_parameters(const V2d& period_mm);

/// The settings of a size, mm; false where one is set already.
bool set_blocked_size(const V2d& size_mm, StitchSettings& settings);

/// A knit at rest, whose sides are RelaxOptions::blocked_mm unless the values set them. Throws a Failure
/// (option_out_of_range, with the free size and the nearest that is found to have room) at a size in which
/// yarn would be longer than its loops, or that is set and has no room for it.
RelaxResult rest_blocked(const std::string& name, const StitchValues& values, const StitchPattern& drawn,
                         RelaxOptions options, const Relaxer& relaxer);

}  // namespace selvedge
