// Faults of the texts that describe stitches: drafts, charts, descriptions.
#pragma once

#include <string>
#include <utility>

#include "format/base/guard.h"

namespace selvedge {

/// Ends reading with STITCH_INVALID. `place`: section and key, line, or JSON pointer; empty: the whole text.
[[noreturn]] inline void refuse_text(std::string place, std::string message) {
  throw Failure{{Code::stitch_invalid, "", std::move(place), std::move(message)}};
}

/// The value of `read`, or the error of its Failure, which names the file.
template <class Read>
auto with_file_name(const std::string& file, const Read& read) -> decltype(catch_failure(read)) {
  auto result = catch_failure(read);
  if (!result) result.error().file = file;
  return result;
}

}  // namespace selvedge
