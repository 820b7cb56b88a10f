// Where rules put what they find: a reader takes the first error of it, a checker all.
#pragma once

#include <optional>
#include <string>

#include "format/base/error.h"

namespace selvedge {

/// The issues of one file in the order in which they were found. However broken the file, no more than `most`
/// errors and `most` warnings are kept; the rest is counted.
class IssueSink {
 public:
  explicit IssueSink(std::string file, std::size_t most = 100);

  void add(Code code, std::string place, std::string message);
  void add(const Error& issue) { add(issue.code, issue.place, issue.message); }

  bool has_error() const { return errors_ > 0; }
  /// Number of errors so far, whether kept or only counted.
  std::size_t errors() const { return errors_; }
  /// Precondition: has_error().
  Error first_error() const;

  /// All that was kept. Where some was not, the last error and the last warning say how many.
  Issues take();

 private:
  std::string file_;
  std::size_t most_;
  std::size_t errors_ = 0;
  std::size_t warnings_ = 0;
  std::optional<Error> unkept_error_;    ///< the first that was not kept
  std::optional<Error> unkept_warning_;  ///< likewise
  Issues issues_;
};

}  // namespace selvedge
