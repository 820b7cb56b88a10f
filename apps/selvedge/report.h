// How a verb tells its outcome: one line for an error, a table for people, JSON for programs.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "apps/selvedge/command_line.h"
#include "format/base/error.h"

namespace selvedge {

using Json = nlohmann::ordered_json;

/// Prints "selvedge: file: place: reason [CODE]" to standard error and gives back the exit status 1.
int report_error(const Error& error);

/// The same with "error: " or "warning: " before the file: for a verb that says both.
void report_issue(const Error& issue);

/// Code, severity, file, place and message.
Json to_json(const Error& issue);

/// Threads, before any work.
void apply(const CommonOptions& common);

/// With --json the report, wrapped with the program's version, the report format's version and the verb; else
/// `text` unless --quiet. Both go to standard output.
void report(const CommonOptions& common, const char* verb, const Json& json, const std::string& text);

/// That report, as text.
std::string wrapped(const char* verb, const Json& json);

/// What is no issue but worth a line: "selvedge: file: remark" on standard error.
void report_remark(const std::string& file, const std::string& remark);

/// What was chosen, guessed or left out for a cell, one line each.
std::vector<std::string> remarks_of(const Cell& cell);

/// Those lines on standard error, unless --quiet or --json.
void report_remarks(const CommonOptions& common, const std::string& input, const Cell& cell,
                    const std::vector<std::string>& others);

/// Size of a file in bytes; 0 if there is none.
std::uint64_t size_of_file(const std::string& path);

}  // namespace selvedge
