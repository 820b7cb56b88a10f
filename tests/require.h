// The value or the error of a Result, or the end of the test.
#pragma once

#include <doctest/doctest.h>

#include <optional>
#include <utility>

#include "format/base/error.h"

namespace selvedge::test {

/// std::source_location, which Clang 14 has not.
struct Place {
  const char* file = "";
  int line = 0;
  static Place current(const char* file = __builtin_FILE(), int line = __builtin_LINE()) {
    return {file, line};
  }
};

inline void fail_at(const Place& place, const std::string& message) {
  ADD_FAIL_AT(place.file, place.line, message);
}

/// Ends the test case at the place of the call, with the error's line, where there is no value.
template <class T>
T need(Result<T> result, const Place& place = Place::current()) {
  if (!result) fail_at(place, to_line(result.error()));
  return std::move(*result);
}

template <class T>
T need(std::optional<T> value, const Place& place = Place::current()) {
  if (!value) fail_at(place, "there is no value");
  return std::move(*value);
}

inline void need(const Result<void>& result, const Place& place = Place::current()) {
  if (!result) fail_at(place, to_line(result.error()));
}

/// The error of what has to be refused.
template <class T>
Error error_of(const Result<T>& result, const Place& place = Place::current()) {
  if (result) fail_at(place, "is not refused");
  return result.error();
}

}  // namespace selvedge::test
