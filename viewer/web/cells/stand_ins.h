// Included before each source of the module (-include), in place of two headers.
#pragma once
#include <string>
#include <string_view>

#include "format/base/one_thread.h"

// The module's messages, which nobody reads, stay templates (300 KB less).
#define FMT_FORMAT_H_  // the guard of its header
namespace fmt {
template <class... Values>
std::string format(std::string_view text, const Values&...) {
  return std::string(text);
}
}  // namespace fmt
