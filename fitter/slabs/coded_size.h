// How many bytes a layer will take in the file, before it is written.
#pragma once

#include <cstddef>
#include <vector>

namespace selvedge {

/// Bytes of `values` ([texel][channel], rows of `width` texels) in half precision, or in single, in the
/// writer's tiles and ZIP, without the chunks' heads.
double coded_bytes(const std::vector<float>& values, std::size_t channels, std::size_t width,
                   bool half = true);

}  // namespace selvedge
