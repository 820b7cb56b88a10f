// Included before each source of the module (-include), in place of two headers.
#pragma once
#include <mutex>
#include <string>
#include <string_view>

// The module's messages, which nobody reads, stay templates (300 KB less).
#define FMT_FORMAT_H_  // the guard of its header
namespace fmt {
template <class... Values>
std::string format(std::string_view text, const Values&...) {
  return std::string(text);
}
}  // namespace fmt

// libc++ for one thread has no std::mutex.
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
