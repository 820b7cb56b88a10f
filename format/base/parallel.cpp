#include "format/base/parallel.h"

#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <memory>

namespace selvedge {
namespace {

// TBB's limit lasts as long as its object: this one lasts as long as the process.
std::unique_ptr<tbb::global_control>& limit() {
  static std::unique_ptr<tbb::global_control> control;
  return control;
}

}  // namespace

void set_threads(int threads) {
  limit().reset();
  if (threads > 0) {
    limit() = std::make_unique<tbb::global_control>(tbb::global_control::max_allowed_parallelism, threads);
  }
}

int thread_count() {
  const auto allowed = tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism);
  const int cores = tbb::this_task_arena::max_concurrency();
  return static_cast<int>(allowed) < cores ? static_cast<int>(allowed) : cores;
}

void parallel_for(int begin, int end, const std::function<void(int)>& body) {
  // Threads get the caller's floating-point mode (rounding, denormals), not that of TBB's first caller.
  tbb::task_group_context context(tbb::task_group_context::bound, tbb::task_group_context::default_traits |
                                                                      tbb::task_group_context::fp_settings);
  // The simple partitioner keeps the split of the work free of timing.
  tbb::parallel_for(
      tbb::blocked_range<int>(begin, end, 1),
      [&](const tbb::blocked_range<int>& range) {
        for (int i = range.begin(); i != range.end(); ++i) body(i);
      },
      tbb::simple_partitioner(), context);
}

}  // namespace selvedge
