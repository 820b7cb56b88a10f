#include "apps/selvedge/report.h"

#include <fmt/format.h>

#include <filesystem>

#include "format/base/parallel.h"
#include "format/base/printable.h"

namespace selvedge {

int report_error(const Error& error) {
  fmt::print(stderr, "selvedge: {}\n", to_line(error));
  return 1;
}

void report_issue(const Error& issue) {
  fmt::print(stderr, "selvedge: {}: {}\n", name_of(severity_of(issue.code)), to_line(issue));
}

Json to_json(const Error& issue) {
  return {{"code", name_of(issue.code)},
          {"severity", name_of(severity_of(issue.code))},
          {"file", as_utf8(issue.file)},
          {"place", as_utf8(issue.place)},
          {"message", as_utf8(issue.message)}};
}

void apply(const CommonOptions& common) { set_threads(common.threads); }

std::string wrapped(const char* verb, const Json& json) {
  Json whole = {{"program", "selvedge"}, {"version", SELVEDGE_VERSION}, {"report", 1}, {"verb", verb}};
  whole.update(json);
  return whole.dump(2, ' ', false, Json::error_handler_t::replace) + '\n';
}

void report(const CommonOptions& common, const char* verb, const Json& json, const std::string& text) {
  if (common.json) {
    fmt::print("{}", wrapped(verb, json));
  } else if (!common.quiet) {
    fmt::print("{}", printable(text));
  }
}

void report_remark(const std::string& file, const std::string& remark) {
  fmt::print(stderr, "selvedge: {}: {}\n", printable(file), printable(remark));
}

std::vector<std::string> remarks_of(const Cell& cell) {
  if (cell.stitch) return cell.stitch->remarks;
  const MeshChoices& c = *cell.choices;
  std::vector<std::string> remarks;
  const auto add = [&](const std::string& remark, const std::string& from) {
    if (from != "given") remarks.push_back(fmt::format("{} ({})", remark, from));
  };
  add(fmt::format("period {:g} x {:g} mm", c.period.x, c.period.y), c.period_from);
  add(fmt::format("{:g} mm per unit", c.scale_to_mm), c.scale_from);
  add(fmt::format("axis {} out of the cloth", name_of(c.up_axis)), c.up_axis_from);
  return remarks;
}

void report_remarks(const CommonOptions& common, const std::string& input, const Cell& cell,
                    const std::vector<std::string>& others) {
  if (common.json || common.quiet) return;
  std::vector<std::string> remarks = remarks_of(cell);
  remarks.insert(remarks.end(), others.begin(), others.end());
  for (const std::string& remark : remarks) report_remark(input, remark);
}

std::uint64_t size_of_file(const std::string& path) {
  std::error_code error;
  const auto size = std::filesystem::file_size(path, error);
  return error ? 0 : size;
}

}  // namespace selvedge
