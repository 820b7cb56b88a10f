// Sums over many texels on all cores, added in one order whatever the threads do.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include "format/base/parallel.h"

namespace selvedge {

/// Calls add(texel, part) for every texel, with a copy of `empty` for each of some blocks of texels that
/// follow each other, and joins the parts in their order by part.add(other).
template <class Part, class Add>
Part sum_over_blocks(std::size_t texels, const Part& empty, const Add& add) {
  const std::size_t blocks = std::clamp<std::size_t>(texels / 4, 1, 16);
  std::vector<Part> parts(blocks, empty);
  parallel_for(0, static_cast<int>(blocks), [&](int index) {
    const auto block = static_cast<std::size_t>(index);
    const std::size_t end = texels * (block + 1) / blocks;
    for (std::size_t texel = texels * block / blocks; texel < end; ++texel) add(texel, parts[block]);
  });
  for (std::size_t block = 1; block < blocks; ++block) parts.front().add(parts[block]);
  return parts.front();
}

}  // namespace selvedge
