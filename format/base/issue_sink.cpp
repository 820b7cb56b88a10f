#include "format/base/issue_sink.h"

#include <fmt/format.h>

#include <algorithm>

namespace selvedge {

IssueSink::IssueSink(std::string file, std::size_t most) : file_(std::move(file)), most_(most) {}

void IssueSink::add(Code code, std::string place, std::string message) {
  const bool is_error = severity_of(code) == Severity::error;
  std::size_t& count = is_error ? errors_ : warnings_;
  std::optional<Error>& unkept = is_error ? unkept_error_ : unkept_warning_;
  ++count;
  if (count <= most_) {
    issues_.push_back({code, file_, std::move(place), std::move(message)});
  } else if (!unkept) {
    unkept = Error{code, file_, std::move(place), std::move(message)};
  }
}

Error IssueSink::first_error() const {
  return *std::find_if(issues_.begin(), issues_.end(),
                       [](const Error& issue) { return severity_of(issue.code) == Severity::error; });
}

Issues IssueSink::take() {
  for (const auto& [unkept, count, what] :
       {std::tuple{&unkept_error_, errors_, "errors"}, std::tuple{&unkept_warning_, warnings_, "warnings"}}) {
    if (!*unkept) continue;
    Error last = **unkept;
    last.message += fmt::format("; {} more {} are not listed", count - most_ - 1, what);
    issues_.push_back(std::move(last));
  }
  return std::move(issues_);
}

}  // namespace selvedge
