// Colours for numbers.
#pragma once

#include "format/base/vec.h"

namespace selvedge {

/// Linear RGB for a number of [-1, 1], beyond them that of the ends: blue below 0, nearly white at 0, red
/// above. Even in Oklab (Björn Ottosson, 2020): equal steps of lightness on both sides, so that numbers as
/// large look as large, to colour-blind eyes as well.
V3f diverging_colour(double t);

}  // namespace selvedge
