#include "format/base/issue_sink.h"

#include <fmt/format.h>

#include <algorithm>

namespace selvedge {

void IssueSink::add(Code code, std::string place, std::string message) {
  add(Error{code, file_, std::move(place), std::move(message)});
}

void IssueSink::add(Error issue) {
  Kind& kind = kinds_.at(static_cast<std::size_t>(severity_of(issue.code)));
  if (++kind.count <= max_issues_) {
    issues_.push_back(std::move(issue));
  } else if (!kind.first_dropped) {
    kind.first_dropped = std::move(issue);
  }
}

void IssueSink::add(const Issues& issues) {
  for (const Error& issue : issues) add(issue);
}

Error IssueSink::first_error() const {
  return *std::ranges::find_if(issues_,
                               [](const Error& issue) { return severity_of(issue.code) == Severity::error; });
}

Issues IssueSink::take_issues() {
  for (Kind& kind : kinds_) {
    if (!kind.first_dropped) continue;
    kind.first_dropped->message += fmt::format("; {} more {}s are not listed", kind.count - max_issues_ - 1,
                                               name_of(severity_of(kind.first_dropped->code)));
    issues_.push_back(std::move(*kind.first_dropped));
  }
  return std::move(issues_);
}

}  // namespace selvedge
