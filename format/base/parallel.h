// Work on all cores; the only place that knows TBB.
#pragma once

#include <functional>

namespace selvedge {

/// Limits the threads that parallel_for uses in the whole process from now on; 0 means all cores. To be
/// called at most once at a time, before the work begins.
void set_threads(int threads);

/// Threads that parallel_for may use now.
int thread_count();

/// Calls body(i) for every i of [begin, end), in any order and on any thread; returns when all are done.
/// The body must not throw. Results must depend on i alone for the bytes to be independent of the threads.
void parallel_for(int begin, int end, const std::function<void(int)>& body);

}  // namespace selvedge
