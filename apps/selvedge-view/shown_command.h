// The command line of `render` that draws what the window of `show` shows.
#pragma once

#include <string>

#include "viewer/show/state.h"

namespace selvedge {

/// `input` is a garment; `first` the state that the window began with, whose lights need no options. What the
/// panel did to fabrics, their size and tint is not part of it: `selvedge dress` does that.
std::string command_of(const std::string& input, const ShowState& first, const ShowState& state,
                       const V2i& size);

}  // namespace selvedge
