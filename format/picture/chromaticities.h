// Linear colours of other primaries.
#pragma once

#include <array>
#include <span>

namespace selvedge {

/// x and y of red, green, blue and white.
using Chromaticities = std::array<double, 8>;

/// Converts the colours of pixels of red, green, blue and alpha to the primaries of Rec. 709, white to white.
/// Leaves them if they have these already, and if `given` spans no triangle.
void convert_to_rec709(const Chromaticities& given, std::span<float> rgba);

}  // namespace selvedge
