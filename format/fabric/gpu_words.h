// Fabrics packed into one array of 32-bit words, for our own shader and for users of the installed library.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "format/fabric/fabric.h"

namespace selvedge {

/// The layout is defined by word_layout.glsl. Preconditions: the fabrics are valid (validate()), and the
/// result has less than 2^32 words.
std::vector<std::uint32_t> gpu_words(std::span<const Fabric> fabrics);

}  // namespace selvedge
