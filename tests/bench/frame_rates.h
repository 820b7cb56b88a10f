// Frames a second of a garment as a whole, nearer, and close: part of selvedge-bench-view.
#pragma once

#include <string>

#include "tests/bench/rows.h"

namespace selvedge::bench {

/// Prints, for 1920 x 1080 by the hybrid path with the default filter and two lights, frames a second without
/// writing, and the stages of a frame: the whole garment, where a repeat has 30 pixels, and where it has 120
/// and the cloth fills the frame.
void frame_rates(const std::string& scene_file, Rows& rows);

}  // namespace selvedge::bench
