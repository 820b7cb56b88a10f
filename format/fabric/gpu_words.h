// Fabrics as one array of words for a graphics card: what our own shader reads and the installed library
// gives.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "format/fabric/fabric.h"

namespace selvedge {

/// The layout is that of word_layout.glsl. Preconditions: validate() passed, and the whole has less than 2^32
/// words.
std::vector<std::uint32_t> gpu_words(std::span<const Fabric> fabrics);

}  // namespace selvedge
