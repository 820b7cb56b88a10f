#include "apps/common/report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <map>

#include "format/base/printable.h"

namespace selvedge {

const char* program_name = "selvedge";
thread_local Json* report_target = nullptr;

namespace {

/// A fault of standard error cannot be reported.
void print_line(const std::string& text) {
  std::fputs(fmt::format("{}: {}\n", program_name, text).c_str(), stderr);
}

/// A remark without its numbers and quoted names.
std::string kind_of(const std::string& remark) {
  std::string kind;
  bool quoted = false;
  for (const char c : remark) {
    if (c == '"') quoted = !quoted;
    if (!quoted && (c < '0' || c > '9')) kind += c;
  }
  return kind;
}

std::string value_text(const Json& value, const std::string& format) {
  if (value.is_null() || (value.is_array() && value.empty())) return "-";
  if (value.is_string()) return value.get<std::string>();
  if (value.is_boolean()) return value.get<bool>() ? "on" : "off";
  if (value.is_array()) {
    const char* between = value.size() == 2 && value[0].is_number() ? "x" : ", ";
    std::string text = value_text(value[0], format);
    for (std::size_t i = 1; i < value.size(); ++i) text += between + value_text(value[i], format);
    return text;
  }
  if (value.is_number() && !format.empty())
    return fmt::format(fmt::runtime(fmt::format("{{{}}}", format)), value.get<double>());
  return value.dump();
}

}  // namespace

Json to_json(const Error& issue) {
  return {{"code", name_of(issue.code)},
          {"severity", name_of(severity_of(issue.code))},
          {"file", escape_invalid_utf8(issue.file)},
          {"place", escape_invalid_utf8(issue.place)},
          {"message", escape_invalid_utf8(issue.message)}};
}

void report_error(const Error& error) { print_line(to_line(error)); }

void report_issue(const Error& issue) {
  if (report_target != nullptr) return;
  print_line(fmt::format("{}: {}", name_of(severity_of(issue.code)), to_line(issue)));
}

void report_remarks(const CommonOptions& common, const std::string& file,
                    const std::vector<std::string>& remarks) {
  constexpr int shown = 10;
  if (common.json || common.quiet || report_target != nullptr) return;
  std::map<std::string, int> count;
  const auto print = [&](const std::string& remark) {
    print_line(fmt::format("{}: {}", escape_unprintable(file), escape_unprintable(remark)));
  };
  for (const std::string& remark : remarks)
    if (++count[kind_of(remark)] <= shown) print(remark);
  for (const std::string& remark : remarks) {
    int& of_kind = count[kind_of(remark)];
    if (of_kind > shown) print(fmt::format("and {} more like: {}", of_kind - shown, remark));
    of_kind = 0;
  }
}

std::string fill_pattern(const std::string& pattern, const Json& json) {
  std::string text;
  std::size_t at = 0;
  for (std::size_t open; (open = pattern.find('{', at)) != std::string::npos;) {
    const std::size_t close = pattern.find('}', open);
    const std::size_t colon = std::min(pattern.find(':', open), close);
    const std::string name = pattern.substr(open + 1, colon - open - 1);
    const Json::json_pointer member(name.empty() ? "" : "/" + name);
    text += pattern.substr(at, open - at);
    text += value_text(json.contains(member) ? json[member] : Json(), pattern.substr(colon, close - colon));
    at = close + 1;
  }
  return text + pattern.substr(at);
}

std::string lines_text(const Json& rows, const std::string& pattern) {
  std::string text;
  for (const Json& row : rows) text += fill_pattern(pattern, row) + "\n";
  return text;
}

std::string table_text(const Json& rows, std::initializer_list<Column> columns) {
  std::vector<std::string> lines(rows.size() + 1);
  for (const Column& column : columns) {
    std::vector<std::string> cells{column.heading};
    for (const Json& row : rows) cells.push_back(fill_pattern(column.pattern, row));
    std::size_t width = 0;
    for (const std::string& cell : cells) width = std::max(width, cell.size());
    for (std::size_t i = 0; i < lines.size(); ++i) lines[i] += fmt::format("{:>{}}", cells[i], width + 2);
  }
  std::string text;
  for (const std::string& line : lines) text += line + "\n";
  return text;
}

Json with_report_header(const char* verb, const Json& json) {
  Json whole = {{"program", program_name}, {"version", SELVEDGE_VERSION}, {"report", 1}, {"verb", verb}};
  whole.update(json);
  return whole;
}

std::string report_text(const Json& json) {
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + '\n';
}

void report(const CommonOptions& common, const char* verb, const Json& json, const std::string& text) {
  if (report_target != nullptr)
    *report_target = with_report_header(verb, json);
  else if (common.json)
    fmt::print("{}", report_text(with_report_header(verb, json)));
  else if (!common.quiet)
    fmt::print("{}", escape_unprintable(text));
}

std::uint64_t file_size_or_zero(const std::string& path) {
  std::error_code error;
  const auto size = std::filesystem::file_size(path, error);
  return error ? 0 : size;
}

}  // namespace selvedge
