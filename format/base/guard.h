// The two ways of an Error, and the boundary of exceptions.
//
// Result<T> (error.h): what a library's header declares for other libraries, programs and tests returns a
// Result if it can fail. Failure: within one library or program, work of many steps throws it at the first
// error: private functions and classes, and what says so in a header. value_or_throw() goes from a Result to
// it, catch_failure() back: an exported function of many steps is `return catch_failure([&] { ... })`. A verb
// of a program may throw; Program catches it. catch_exceptions(): turns exceptions of third-party libraries
// too, std::bad_alloc included, into Errors. For the entry points of programs and of the installed library;
// an exception that reaches another caller is a bug, which the fuzz targets report. In the module of cell
// images nothing is caught: the host gets what is thrown, and the instance ends; nothing may run after it.
#pragma once

#include <string>
#include <type_traits>
#include <utility>

#include "format/base/error.h"

namespace selvedge {

/// An error on its way to where it is a Result again. No std::exception, so that nobody takes it for a fault.
struct Failure {
  Error error;
};

/// The value of `result`; throws its error as a Failure. Only where a caller catches it, as
/// catch_exceptions() does: no Failure leaves a library.
template <class T>
T value_or_throw(Result<T> result) {
  if (!result) throw Failure{std::move(result.error())};
  if constexpr (!std::is_void_v<T>) return std::move(*result);
}

template <class T>
struct AsResult {
  using Type = Result<T>;
};
template <class T>
struct AsResult<Result<T>> {
  using Type = Result<T>;
};
/// The value of `work`, or the error of its result or Failure. Other exceptions go on.
template <class F, class R = typename AsResult<std::invoke_result_t<F>>::Type>
R catch_failure(const F& work) {
  try {
    if constexpr (!std::is_void_v<std::invoke_result_t<F>>) return work();
    work();
    return R();
  } catch (Failure& failure) {
    return tl::unexpected(std::move(failure.error));
  }
}

/// The value of `work`; its Failure is rethrown with the error that `change` makes of it.
template <class F, class Change>
std::invoke_result_t<F> map_failure(const F& work, const Change& change) {
  try {
    return work();
  } catch (const Failure& failure) {
    throw Failure{change(failure.error)};
  }
}

/// The exception that is being handled, as an error of `file`: a Failure's own one, FILE_TOO_LARGE for
/// memory, FILE_UNREADABLE for anything else. Only in a catch block.
Error thrown_error(const std::string& file);

/// The result of `work`, a Result; thrown_error() if it throws.
template <class F>
std::invoke_result_t<F> catch_exceptions(const std::string& file, const F& work) {
  try {
    return work();
  } catch (...) {
    return tl::unexpected<Error>(thrown_error(file));
  }
}

}  // namespace selvedge
