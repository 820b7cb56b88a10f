#include "apps/common/report.h"

#include <fmt/format.h>

#include <cstdio>
#include <filesystem>

#include "format/base/printable.h"

namespace selvedge {

const char* program_name = "selvedge";
thread_local Json* report_target = nullptr;

Json to_json(const Error& issue) {
  return {{"code", name_of(issue.code)},
          {"severity", name_of(severity_of(issue.code))},
          {"file", as_utf8(issue.file)},
          {"place", as_utf8(issue.place)},
          {"message", as_utf8(issue.message)}};
}

void report_error(const Error& error) { fmt::print(stderr, "{}: {}\n", program_name, to_line(error)); }

void report_issue(const Error& issue) {
  if (report_target != nullptr) return;
  fmt::print(stderr, "{}: {}: {}\n", program_name, name_of(severity_of(issue.code)), to_line(issue));
}

Json report_warnings(const CommonOptions& common, const Issues& warnings) {
  Json list = Json::array();
  for (const Error& warning : warnings) {
    list.push_back(to_json(warning));
    if (!(common.quiet || common.json)) report_issue(warning);
  }
  return list;
}

void report_remark(const std::string& file, const std::string& remark) {
  if (report_target != nullptr) return;
  fmt::print(stderr, "{}: {}: {}\n", program_name, printable(file), printable(remark));
}

Json framed(const char* verb, const Json& json) {
  Json whole = {{"program", program_name}, {"version", SELVEDGE_VERSION}, {"report", 1}, {"verb", verb}};
  whole.update(json);
  return whole;
}

std::string report_text(const Json& json) {
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + '\n';
}

void report(const CommonOptions& common, const char* verb, const Json& json, const std::string& text) {
  if (report_target != nullptr) {
    *report_target = framed(verb, json);
  } else if (common.json) {
    fmt::print("{}", report_text(framed(verb, json)));
  } else if (!common.quiet) {
    fmt::print("{}", printable(text));
  }
}

std::uint64_t size_of_file(const std::string& path) {
  std::error_code error;
  const auto size = std::filesystem::file_size(path, error);
  return error ? 0 : size;
}

}  // namespace selvedge
