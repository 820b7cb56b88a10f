// Collects the issues that rules find in a file: a reader stops at the first error, a checker reports all.
#pragma once

#include <array>
#include <optional>
#include <string>

#include "format/base/error.h"

namespace selvedge {

/// The issues of one file in the order in which they were found. At most `max_issues` errors and `max_issues`
/// warnings are kept; further ones are counted.
class IssueSink {
 public:
  explicit IssueSink(std::string file, std::size_t max_issues = 100)
      : file_(std::move(file)), max_issues_(max_issues) {}

  void add(Code code, std::string place, std::string message);
  /// Issues that name their own file, which may differ from the sink's.
  void add(Error issue);
  void add(const Issues& issues);

  bool has_error() const { return error_count() > 0; }
  /// Number of errors so far, including those that are only counted.
  std::size_t error_count() const { return kinds_[0].count; }
  /// Precondition: has_error().
  Error first_error() const;

  /// Moves out the kept issues. If some were dropped, the last error and the last warning say how many.
  Issues take_issues();

 private:
  struct Kind {
    std::size_t count = 0;
    std::optional<Error> first_dropped;
  };

  std::string file_;
  std::size_t max_issues_;
  std::array<Kind, 2> kinds_;  ///< by severity
  Issues issues_;
};

}  // namespace selvedge
