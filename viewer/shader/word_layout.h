// Names of the words of packed fabrics: the constants of word_layout.glsl in C++.
#pragma once

#include <cstdint>

namespace selvedge::word_layout {

using uint = std::uint32_t;
#include "viewer/shader/word_layout.glsl"

}  // namespace selvedge::word_layout
