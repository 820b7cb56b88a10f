// For WebAssembly's one thread, before each source (-include): its libc++ has no std::mutex.
#pragma once
#include <mutex>

namespace std {
struct mutex {
  void lock() {}
  void unlock() {}
};
template <class... Mutexes>
struct scoped_lock {
  explicit scoped_lock(Mutexes&...) {}
};
}  // namespace std
