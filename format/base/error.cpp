#include "format/base/error.h"

#include <fmt/format.h>

#include <algorithm>

#include "format/base/printable.h"

namespace selvedge {
std::span<const CodeRow> code_table() {
  using enum Code;
  using enum Severity;
  static constexpr std::array<CodeRow, 42> rows{{
      {file_missing, error, "FILE_MISSING", "The named file does not exist."},
      {file_unreadable, error, "FILE_UNREADABLE", "The file exists but cannot be opened or read."},
      {file_unwritable, error, "FILE_UNWRITABLE", "The output cannot be written; nothing is left behind."},
      {file_damaged, error, "FILE_DAMAGED", "The file is cut short or a part of it cannot be decoded."},
      {file_too_large, error, "FILE_TOO_LARGE", "A declared size is beyond the stated limits."},
      {option_out_of_range, error, "OPTION_OUT_OF_RANGE", "An option's value is outside of its range."},
      {json_malformed, error, "JSON_MALFORMED", "A JSON text cannot be parsed."},
      {stitch_unknown, error, "STITCH_UNKNOWN", "No built-in stitch has that name and no such file exists."},
      {stitch_invalid, error, "STITCH_INVALID", "A stitch description breaks a rule, e.g. has no yarn."},
      {mesh_empty, error, "MESH_EMPTY", "The mesh has no triangles."},
      {mesh_not_finite, error, "MESH_NOT_FINITE", "A vertex of the mesh is NaN or infinite."},
      {mesh_invalid, error, "MESH_INVALID", "The mesh cannot be used, e.g. its period is missing."},
      {exr_malformed, error, "EXR_MALFORMED", "The file is not an OpenEXR file or its header is broken."},
      {exr_unsupported, error, "EXR_UNSUPPORTED", "A valid OpenEXR file with a feature that is not read."},
      {samples_malformed, error, "SAMPLES_MALFORMED",
       "The EXR file is not a samples file, or measured pictures do not make one."},
      {samples_not_finite, error, "SAMPLES_NOT_FINITE", "A sample is NaN, infinite or negative."},
      {fabric_malformed, error, "FABRIC_MALFORMED", "The EXR file is not a fabric file."},
      {fabric_version, error, "FABRIC_VERSION", "The fabric file is of a version that is not read."},
      {fabric_unsupported, error, "FABRIC_UNSUPPORTED", "The fabric has an unknown layer or layout."},
      {fabric_member, error, "FABRIC_MEMBER",
       "A member of the attribute text is missing, of the wrong type or out of range."},
      {fabric_part, error, "FABRIC_PART",
       "A part of the fabric file is missing or laid out against the rules."},
      {fabric_channel, error, "FABRIC_CHANNEL",
       "A channel is missing, or a layer needs more channels than a part can have."},
      {fabric_not_finite, error, "FABRIC_NOT_FINITE", "A stored value is NaN, infinite or out of range."},
      {fabric_digest, error, "FABRIC_DIGEST",
       "A digest is missing, or differs from the attributes, names or pixels."},
      {fabric_mismatch, error, "FABRIC_MISMATCH", "Fabric and samples do not describe the same cell."},
      {gltf_malformed, error, "GLTF_MALFORMED", "The glTF file breaks a rule of the glTF specification."},
      {gltf_unsupported, error, "GLTF_UNSUPPORTED", "A required glTF feature is not supported."},
      {gltf_accessor, error, "GLTF_ACCESSOR",
       "An accessor, buffer view or index reaches beyond what it refers to."},
      {gltf_extension, error, "GLTF_EXTENSION",
       "SELVEDGE_materials_fabric is used against its specification."},
      {gltf_reference, error, "GLTF_REFERENCE",
       "A file that the glTF refers to is not there, or outside of its folder."},
      {gltf_fallback, warning, "GLTF_FALLBACK",
       "The fallback is missing, or other viewers will show something else than the fabric."},
      {gltf_alpha, warning, "GLTF_ALPHA",
       "The alpha mode hides the holes of the fabric, or blends a fabric that has none."},
      {gltf_transform, warning, "GLTF_TRANSFORM", "Fabric and fallback do not lie alike on the surface."},
      {gltf_advice, warning, "GLTF_ADVICE", "Legal, but unwise: see the message."},
      {variant_unreached, warning, "VARIANT_UNREACHED",
       "A tint asks for a colour that the fabric cannot reach: its gloss would glow."},
      {material_missing, error, "MATERIAL_MISSING",
       "The garment has no material of that name, or none to work on."},
      {garment_no_uvs, error, "GARMENT_NO_UVS", "The material's triangles have no texture coordinates."},
      {garment_empty, error, "GARMENT_EMPTY", "The glTF has no triangles to dress or to draw."},
      {image_unreadable, error, "IMAGE_UNREADABLE", "An image cannot be read."},
      {image_mismatch, error, "IMAGE_MISMATCH", "Two images differ in size, or beyond the given bound."},
      {image_unwritable, error, "IMAGE_UNWRITABLE", "An image cannot be written."},
      {graphics_unavailable, error, "GRAPHICS_UNAVAILABLE", "No OpenGL context can be had, or it failed."},
  }};
  static_assert([] {
    for (std::size_t i = 0; i < rows.size(); ++i)
      if (rows[i].code != static_cast<Code>(i)) return false;
    return rows.back().code == Code::graphics_unavailable;
  }());
  return rows;
}

std::string_view name_of(Code code) { return code_table()[static_cast<std::size_t>(code)].name; }

Severity severity_of(Code code) { return code_table()[static_cast<std::size_t>(code)].severity; }

std::string_view name_of(Severity severity) { return severity == Severity::error ? "error" : "warning"; }

constexpr auto is_error = [](const Error& issue) { return severity_of(issue.code) == Severity::error; };

bool has_error(const Issues& issues) { return std::ranges::any_of(issues, is_error); }

std::string to_line(const Error& error) {
  std::string line;
  for (const std::string* part : {&error.file, &error.place, &error.message}) {
    if (part->empty()) continue;
    if (!line.empty()) line += ": ";
    line += *part;
  }
  // Messages of other libraries may have several lines.
  for (char& c : line)
    if (c == '\n' || c == '\r' || c == '\t') c = ' ';
  return fmt::format("{} [{}]", escape_unprintable(line), name_of(error.code));
}

constexpr std::size_t max_issues = 100;  // of each severity

void IssueSink::add(Error issue) {
  Kind& kind = kinds_.at(static_cast<std::size_t>(severity_of(issue.code)));
  if (++kind.count <= max_issues)
    issues_.push_back(std::move(issue));
  else if (!kind.first_dropped)
    kind.first_dropped = std::move(issue);
}

Error IssueSink::first_error() const { return *std::ranges::find_if(issues_, is_error); }

Issues IssueSink::take_issues() {
  for (Kind& kind : kinds_) {
    if (!kind.first_dropped) continue;
    kind.first_dropped->message += fmt::format("; {} more {}s are not listed", kind.count - max_issues - 1,
                                               name_of(severity_of(kind.first_dropped->code)));
    issues_.push_back(std::move(*kind.first_dropped));
  }
  return std::move(issues_);
}

}  // namespace selvedge
