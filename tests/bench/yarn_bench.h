// What the points of pixels that show yarn cost: part of selvedge-bench-view.
#pragma once

#include <string>

#include "tests/bench/rows.h"

namespace selvedge::bench {

/// Prints, for one light and one thread, ns a point of a view ray, of its surface and of its shadow ray, and
/// the time of a frame beside one of a fabric of layers, from three places of `selvedge swatch`.
void yarn_points(const std::string& yarn_file, const std::string& layers_file, Rows& rows);

}  // namespace selvedge::bench
