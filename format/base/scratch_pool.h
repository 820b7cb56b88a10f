// Memory that pieces of work reuse: what goes back to the system after each one is cleared again for the
// next.
#pragma once

#include <memory>
#include <mutex>
#include <vector>

namespace selvedge {

/// Objects that threads lend: no more are made than are in use at a time. Must outlive what it has lent.
template <class T>
class ScratchPool {
 public:
  /// An object with whatever its last user left in it.
  std::shared_ptr<T> acquire() {
    const std::scoped_lock lock(mutex_);
    std::unique_ptr<T> object = unused_.empty() ? std::make_unique<T>() : std::move(unused_.back());
    if (!unused_.empty()) unused_.pop_back();
    return {object.release(), [this](T* used) {
              const std::scoped_lock back(mutex_);
              unused_.emplace_back(used);
            }};
  }

 private:
  std::mutex mutex_;
  std::vector<std::unique_ptr<T>> unused_;
};

}  // namespace selvedge
