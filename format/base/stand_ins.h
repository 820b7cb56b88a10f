// Included before each source of a WebAssembly module (-include), in place of two headers.
#pragma once
#include <string>
#include <string_view>

// Messages that nobody reads stay templates (300 KB less).
#ifndef FMT_HEADER_ONLY
#define FMT_FORMAT_H_  // the guard of its header
namespace fmt {
template <class... Values>
std::string format(std::string_view text, const Values&...) {
  return std::string(text);
}
}  // namespace fmt
#endif

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
