// The end of the way for exceptions: what a library of others throws, or memory that there is not, becomes an
// error as any other. For the entries of programs and of the installed library; inside, an exception that
// reaches a caller is a fault, and the fuzz targets take it as one.
#pragma once

#include <string>
#include <type_traits>

#include "format/base/error.h"

namespace selvedge {

/// The exception that is being handled, as an error of `file`: FILE_TOO_LARGE for memory, FILE_UNREADABLE for
/// anything else. Only in a catch block.
Error thrown_error(const std::string& file);

/// The result of `work`, a Result; thrown_error() if it throws.
template <class F>
std::invoke_result_t<F> guarded(const std::string& file, const F& work) {
  try {
    return work();
  } catch (...) {
    return tl::unexpected<Error>(thrown_error(file));
  }
}

}  // namespace selvedge
