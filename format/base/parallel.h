// Parallel loops over all cores, by TBB; under the thread sanitizer by threads of the standard library.
#pragma once

#include <functional>

namespace selvedge {

/// Limits the threads of parallel_for() in the whole process; 0 means all cores. Not thread-safe.
void set_thread_limit(int threads);

/// Number of threads that parallel_for() may use.
int thread_count();

/// Calls body(i) for every i of [begin, end), in any order and on any thread; returns when all are done.
/// The body must not throw. Results must depend on i alone, so that they do not depend on the threads.
void parallel_for(int begin, int end, const std::function<void(int)>& body);

}  // namespace selvedge
