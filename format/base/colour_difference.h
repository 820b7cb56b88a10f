// CIEDE2000, the difference that eyes see between two colours: Sharma, Wu and Dalal, "The CIEDE2000
// color-difference formula", Color Research & Application 30(1), 2005.
#pragma once

#include "format/base/vec.h"

namespace selvedge {

/// Between two linear colours in [0, 1], Rec. 709 under D65: 1 is just seen side by side, black and white
/// differ by 100.
double ciede2000(const V3f& a, const V3f& b);

}  // namespace selvedge
