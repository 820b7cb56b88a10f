// Errors as values: functions return them instead of throwing exceptions.
//
// A code names the kind of fault (one row of one table, printed into spec/issues.md), the file and the
// place within it say where, the message says why. A user sees the line that to_line() makes.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <vector>

namespace selvedge {

/// Every kind of fault that Selvedge can name; their table is in error.cpp.
enum class Code {
  file_missing,
  file_unreadable,
  file_unwritable,
  file_damaged,
  file_too_large,
  option_out_of_range,
  json_malformed,
  stitch_unknown,
  stitch_invalid,
  mesh_empty,
  mesh_not_finite,
  mesh_invalid,
  exr_malformed,
  exr_unsupported,
  samples_malformed,
  samples_not_finite,
  fabric_malformed,
  fabric_version,
  fabric_unsupported,
  fabric_member,
  fabric_part,
  fabric_channel,
  fabric_not_finite,
  fabric_digest,
  fabric_mismatch,
  gltf_malformed,
  gltf_unsupported,
  gltf_accessor,
  gltf_extension,
  gltf_reference,
  gltf_fallback,
  gltf_alpha,
  gltf_transform,
  gltf_advice,
  variant_unreached,
  material_missing,
  garment_no_uvs,
  garment_empty,
  image_unreadable,
  image_mismatch,
  image_unwritable,
  graphics_unavailable,
};

/// An error: the file must not be used. A warning: it may be used, but a part of it is unwise or will not be
/// seen as intended.
enum class Severity { error, warning };

/// One row of the table of codes. A code has one severity wherever it appears.
struct CodeRow {
  Code code;
  Severity severity;
  std::string_view name;     ///< as printed: upper case, underscores
  std::string_view meaning;  ///< one sentence for spec/issues.md
};

/// All rows, in the order of the enumeration.
std::span<const CodeRow> code_table();
std::string_view name_of(Code code);
Severity severity_of(Code code);
std::string_view name_of(Severity severity);

struct Error {
  Code code = Code::file_unreadable;
  std::string file;     ///< as the user named it; may be empty
  std::string place;    ///< JSON pointer, part/level/channel, option, line; may be empty
  std::string message;  ///< the reason, without a full stop
};

/// "file: place: message [CODE]", always a single line, escaped by escape_unprintable().
std::string to_line(const Error& error);

/// The faults of a file, in the order in which they were found.
using Issues = std::vector<Error>;

bool has_error(const Issues& issues);

template <class T>
using Result = tl::expected<T, Error>;

inline tl::unexpected<Error> fail(Code code, std::string file, std::string place, std::string message) {
  return tl::unexpected<Error>(Error{code, std::move(file), std::move(place), std::move(message)});
}

/// Collects the issues that rules find in a file, in their order: a reader stops at the first error, a
/// checker reports all. At most 100 errors and 100 warnings are kept; further ones are counted.
class IssueSink {
 public:
  explicit IssueSink(std::string file) : file_(std::move(file)) {}

  void add(Code code, std::string place, std::string message) {
    add(Error{code, file_, std::move(place), std::move(message)});
  }
  /// Issues that name their own file, which may differ from the sink's.
  void add(Error issue);
  void add(const Issues& issues) {
    for (const Error& issue : issues) add(issue);
  }

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
  std::array<Kind, 2> kinds_;  ///< by severity
  Issues issues_;
};

}  // namespace selvedge
