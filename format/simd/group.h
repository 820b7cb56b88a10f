// Four floats that are loaded at once.
#pragma once

#include <array>

namespace selvedge {

using Group = std::array<float, 4>;

}  // namespace selvedge
