// Colours of pictures by the primaries that they are stored in.
#pragma once

#include <Imath/ImathMatrix.h>

#include <array>

namespace selvedge {

using Imath::M33d;

/// CIE x and y of red, green, blue and white.
using Primaries = std::array<double, 8>;

inline constexpr Primaries rec709_primaries{0.64, 0.33, 0.3, 0.6, 0.15, 0.06, 0.3127, 0.329};
/// Primaries of Radiance, whose white has equal energy.
inline constexpr Primaries radiance_primaries{0.64, 0.33, 0.29, 0.6, 0.15, 0.06, 1.0 / 3, 1.0 / 3};
/// Primaries of pictures of X, Y and Z.
inline constexpr Primaries xyz_primaries{1, 0, 0, 1, 0, 0, 1.0 / 3, 1.0 / 3};

/// Makes red, green and blue as they are shown here of those with these primaries: row vectors times this.
/// White stays white (Bradford's adaptation). Those of Radiance and Rec. 709 are shown as they are, and
/// primaries that span no colours, which some programs write: the identity.
M33d shown_colours(const Primaries& primaries);

}  // namespace selvedge
