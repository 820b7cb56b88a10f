// Parallel loops over all cores, by TBB; under the thread sanitizer by threads of the standard library.
#pragma once

#include <algorithm>
#include <cstddef>
#include <functional>

namespace selvedge {

/// Limits the threads of parallel_for() in the whole process; 0 means all cores. Not thread-safe.
void set_thread_limit(int threads);

/// Number of threads that parallel_for() may use.
int thread_count();

/// Calls body(i) for every i of [begin, end), in any order and on any thread; returns when all are done.
/// The body must not throw. Results must depend on i alone, so that they do not depend on the threads.
void parallel_for(int begin, int end, const std::function<void(int)>& body);

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
