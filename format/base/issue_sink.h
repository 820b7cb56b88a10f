// The list into which rules put the issues that they find in a file: a reader stops at the first error, a
// checker reports them all.
#pragma once

#include <array>
#include <optional>
#include <string>

#include "format/base/error.h"

namespace selvedge {

/// The issues of one file in the order in which they were found. However broken the file, at most
/// `max_issues` errors and `max_issues` warnings are kept; the rest is counted.
class IssueSink {
 public:
  explicit IssueSink(std::string file, std::size_t max_issues = 100)
      : file_(std::move(file)), max_issues_(max_issues) {}

  void add(Code code, std::string place, std::string message);
  /// Issues that name their file, which may be another than the sink's.
  void add(Error issue);
  void add(const Issues& issues);

  bool has_error() const { return errors() > 0; }
  /// Number of errors so far, whether kept or only counted.
  std::size_t errors() const { return kinds_[0].count; }
  /// Precondition: has_error().
  Error first_error() const;

  /// All issues that were kept. Where some were not, the last error and the last warning say how many.
  Issues take();

 private:
  struct Kind {
    std::size_t count = 0;
    std::optional<Error> unkept;  ///< the first that was not kept
  };

  std::string file_;
  std::size_t max_issues_;
  std::array<Kind, 2> kinds_;  ///< by severity
  Issues issues_;
};

}  // namespace selvedge
