// The command line of `render` that draws what the window of `show` shows.
#pragma once

#include <string>
#include <vector>

#include "viewer/show/state.h"

namespace selvedge {

/// `input` is a garment, `own` are the lights of its file. Lights that the panel or options changed become
/// white ones, spots points. What the panel did to fabrics, their size and tint is not part of it: `selvedge
/// dress` does that.
std::string command_of(const std::string& input, const std::vector<Light>& own, const ShowState& state,
                       const V2i& size);

}  // namespace selvedge
