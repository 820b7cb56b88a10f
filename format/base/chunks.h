// Loops over many small items on all cores.
#pragma once

#include <algorithm>
#include <cstddef>

#include "format/base/parallel.h"

namespace selvedge {

/// Calls body(first, end) for [0, count) in parts of `size`, as parallel_for() does.
template <class Body>
void parallel_chunks(std::size_t count, std::size_t size, const Body& body) {
  parallel_for(0, static_cast<int>((count + size - 1) / size), [&](int part) {
    const std::size_t first = size * static_cast<std::size_t>(part);
    body(first, std::min(first + size, count));
  });
}

/// Calls body(i) for every i of [0, count), of which a thread takes `size` at a time.
template <class Body>
void parallel_each(std::size_t count, std::size_t size, const Body& body) {
  parallel_chunks(count, size, [&](std::size_t first, std::size_t end) {
    for (std::size_t i = first; i < end; ++i) body(i);
  });
}

}  // namespace selvedge
