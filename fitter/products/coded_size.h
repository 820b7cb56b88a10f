// Size of a layer in the file, computed without writing it.
#pragma once

#include <cstddef>
#include <vector>

namespace selvedge {

/// Bytes of `values` ([texel][channel], rows of `width` texels) in half precision, in the writer's
/// tiles and ZIP, without the headers of chunks.
double coded_bytes(const std::vector<float>& values, std::size_t channels, std::size_t width);

}  // namespace selvedge
