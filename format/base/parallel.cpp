#include "format/base/parallel.h"

// The thread sanitizer does not see what TBB, which is not built with it, orders: every loop would be a race.
#ifdef SELVEDGE_STD_THREADS

#include <atomic>
#include <thread>
#include <utility>
#include <vector>

namespace selvedge {
namespace {

int limit = 0;
thread_local bool within_loop = false;

}  // namespace

void set_thread_limit(int threads) { limit = threads; }

int thread_count() {
  const int cores = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  return limit > 0 ? std::min(limit, cores) : cores;
}

void parallel_for(int begin, int end, const std::function<void(int)>& body) {
  std::atomic<int> next{begin};
  const auto work = [&] {
    const bool outer = std::exchange(within_loop, true);
    for (int i = next++; i < end; i = next++) body(i);
    within_loop = outer;
  };
  std::vector<std::thread> others;
  // A loop within another has the thread of its own alone.
  const int threads = within_loop ? 1 : std::min(thread_count(), end - begin);
  for (int i = 1; i < threads; ++i) others.emplace_back(work);
  work();
  for (std::thread& other : others) other.join();
}

}  // namespace selvedge

#else

#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <memory>
#include <mutex>

namespace selvedge {
namespace {

// TBB's limit lasts as long as its object: this one lasts as long as the process.
std::unique_ptr<tbb::global_control>& limit() {
  static std::unique_ptr<tbb::global_control> control;
  return control;
}

}  // namespace

void set_thread_limit(int threads) {
  static std::mutex mutex;
  const std::lock_guard lock(mutex);
  limit().reset();
  if (threads > 0)
    limit() = std::make_unique<tbb::global_control>(tbb::global_control::max_allowed_parallelism, threads);
}

int thread_count() {
  const auto allowed = tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism);
  const int cores = tbb::this_task_arena::max_concurrency();
  return static_cast<int>(allowed) < cores ? static_cast<int>(allowed) : cores;
}

void parallel_for(int begin, int end, const std::function<void(int)>& body) {
  // Threads get the caller's floating-point mode (rounding, denormals), not the mode of TBB's first caller.
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

#endif
