// Reports of verbs: a table for people or JSON for programs on standard output, errors and remarks on
// standard error.
#pragma once

#include <Imath/ImathBox.h>

#include <cstdint>
#include <initializer_list>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "format/base/guard.h"
#include "format/base/vec.h"

/// Vectors are lists of numbers in reports.
template <class T>
struct nlohmann::adl_serializer<Imath::Vec2<T>> {
  static void to_json(ordered_json& json, const Imath::Vec2<T>& v) { json = {v.x, v.y}; }
};
template <class T>
struct nlohmann::adl_serializer<Imath::Vec3<T>> {
  static void to_json(ordered_json& json, const Imath::Vec3<T>& v) { json = {v.x, v.y, v.z}; }
};
/// Corners; null without any.
template <class T>
struct nlohmann::adl_serializer<Imath::Box<T>> {
  static void to_json(ordered_json& json, const Imath::Box<T>& box) {
    json = box.isEmpty() ? ordered_json() : ordered_json{box.min, box.max};
  }
};

namespace selvedge {

using Json = nlohmann::ordered_json;

/// Options of every verb.
struct CommonOptions {
  bool json = false;       ///< the report as JSON on standard output
  bool quiet = false;      ///< no progress, no table
  int threads = 0;         ///< 0: all cores
  std::uint64_t seed = 0;  ///< ignored by verbs without random numbers
};

/// Name of the running program, for messages. Set by Program.
extern const char* program_name;

/// Where the reports of this thread's verbs go, framed, in place of standard output and error; null: there.
extern thread_local Json* report_target;

/// Code, severity, file, place and message.
Json to_json(const Error& issue);

/// "program: file: place: reason [CODE]" on standard error.
void report_error(const Error& error);

/// The same with "error: " or "warning: " before the file, for verbs that report both.
void report_issue(const Error& issue);

/// Remarks without a code, "program: file: remark" on standard error, unless --quiet or --json; of those that
/// differ in numbers and quoted names alone, the first ten and the number of the rest.
void report_remarks(const CommonOptions& common, const std::string& file,
                    const std::vector<std::string>& remarks);

/// Prints to standard output: with --json the report, framed with the program's version, the report format's
/// version and the verb; else `text`, unless --quiet.
void report(const CommonOptions& common, const char* verb, const Json& json, const std::string& text);

/// `pattern` with each {member}, or {member:.2f}, replaced by that member of the report; a slash leads to
/// members of members. Pairs of numbers stand as 8x8, other lists with commas, truths as on and off; null,
/// absent members and empty lists as "-". {} is the report itself.
std::string fill_pattern(const std::string& pattern, const Json& json);

/// A line of fill_pattern() for each row.
std::string lines_text(const Json& rows, const std::string& pattern);

struct Column {
  const char* heading;
  const char* pattern;  ///< as of fill_pattern()
};
/// The rows of a report as lines of columns below their headings; numbers are at the right.
std::string table_text(const Json& rows, std::initializer_list<Column> columns);

/// The framed report.
Json with_report_header(const char* verb, const Json& json);
/// JSON as the text that --json prints.
std::string report_text(const Json& json);

/// Size of a file in bytes; 0 if absent.
std::uint64_t file_size_or_zero(const std::string& path);

}  // namespace selvedge
