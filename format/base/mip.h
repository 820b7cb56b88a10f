// Sizes of mip levels, as OpenEXR and glTF viewers count them: halved and rounded down, at least 1.
#pragma once

#include <algorithm>
#include <bit>

namespace selvedge {

/// Size of a mip level that is `level` steps above one of `size` texels.
constexpr int level_size(int size, int level) { return std::max(size >> level, 1); }

/// Number of levels down to 1 x 1.
constexpr int level_count(int width, int height) {
  return std::bit_width(static_cast<unsigned>(std::max(width, height)));
}

}  // namespace selvedge
