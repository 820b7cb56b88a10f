#include "format/error.h"

#include <algorithm>
#include <array>

namespace selvedge {
namespace {

constexpr std::array rows{
    CodeRow{Code::file_missing, "FILE_MISSING", "The named file does not exist."},
    CodeRow{Code::file_unreadable, "FILE_UNREADABLE", "The file exists but cannot be opened or read."},
    CodeRow{Code::file_unwritable, "FILE_UNWRITABLE",
            "The output cannot be written; nothing is left behind."},
    CodeRow{Code::file_damaged, "FILE_DAMAGED", "The file is cut short or a part of it cannot be decoded."},
    CodeRow{Code::file_too_large, "FILE_TOO_LARGE", "A declared size is beyond the stated limits."},
    CodeRow{Code::option_out_of_range, "OPTION_OUT_OF_RANGE", "An option's value is outside of its range."},
    CodeRow{Code::json_malformed, "JSON_MALFORMED", "A JSON text cannot be parsed."},
    CodeRow{Code::stitch_unknown, "STITCH_UNKNOWN",
            "No built-in stitch has that name and no such file exists."},
    CodeRow{Code::stitch_invalid, "STITCH_INVALID", "A stitch description breaks a rule, e.g. has no yarn."},
    CodeRow{Code::mesh_empty, "MESH_EMPTY", "The mesh has no triangles."},
    CodeRow{Code::mesh_not_finite, "MESH_NOT_FINITE", "A vertex of the mesh is NaN or infinite."},
    CodeRow{Code::mesh_invalid, "MESH_INVALID", "The mesh cannot be used, e.g. its period is missing."},
    CodeRow{Code::exr_malformed, "EXR_MALFORMED", "The file is not an OpenEXR file or its header is broken."},
    CodeRow{Code::exr_unsupported, "EXR_UNSUPPORTED",
            "A valid OpenEXR file with a feature that is not read."},
    CodeRow{Code::samples_malformed, "SAMPLES_MALFORMED", "The EXR file is not a samples file."},
    CodeRow{Code::samples_not_finite, "SAMPLES_NOT_FINITE", "A sample is NaN, infinite or negative."},
    CodeRow{Code::fabric_malformed, "FABRIC_MALFORMED", "The EXR file is not a fabric file."},
    CodeRow{Code::fabric_version, "FABRIC_VERSION", "The fabric file is of another major version."},
    CodeRow{Code::fabric_not_finite, "FABRIC_NOT_FINITE", "A stored value is NaN, infinite or out of range."},
    CodeRow{Code::fabric_digest, "FABRIC_DIGEST", "The stored digest differs from the decoded pixels."},
    CodeRow{Code::fabric_mismatch, "FABRIC_MISMATCH", "Fabric and samples do not describe the same cell."},
    CodeRow{Code::gltf_malformed, "GLTF_MALFORMED", "The glTF file breaks a rule of the glTF specification."},
    CodeRow{Code::gltf_unsupported, "GLTF_UNSUPPORTED", "A required glTF feature is not supported."},
    CodeRow{Code::gltf_reference, "GLTF_REFERENCE", "A fabric that the glTF refers to cannot be found."},
    CodeRow{Code::material_missing, "MATERIAL_MISSING", "The garment has no material of that name."},
    CodeRow{Code::garment_no_uvs, "GARMENT_NO_UVS", "The material's triangles have no texture coordinates."},
    CodeRow{Code::garment_empty, "GARMENT_EMPTY", "The glTF has no triangles to dress or to draw."},
    CodeRow{Code::image_unreadable, "IMAGE_UNREADABLE", "An image cannot be read."},
    CodeRow{Code::image_mismatch, "IMAGE_MISMATCH", "Two images differ in size, or beyond the given bound."},
    CodeRow{Code::image_unwritable, "IMAGE_UNWRITABLE", "An image cannot be written."},
    CodeRow{Code::graphics_unavailable, "GRAPHICS_UNAVAILABLE",
            "No OpenGL context can be had, or it failed."},
};

}  // namespace

std::span<const CodeRow> code_table() { return rows; }

std::string_view name_of(Code code) {
  const auto row = std::find_if(rows.begin(), rows.end(), [&](const CodeRow& r) { return r.code == code; });
  return row == rows.end() ? std::string_view("UNKNOWN") : row->name;
}

std::string to_line(const Error& error) {
  std::string line;
  for (const std::string* part : {&error.file, &error.place, &error.message}) {
    if (part->empty()) continue;
    if (!line.empty()) line += ": ";
    line += *part;
  }
  // Messages of other libraries may span lines; a user's log must not.
  for (char& c : line) {
    if (c == '\n' || c == '\r' || c == '\t') c = ' ';
  }
  line += " [";
  line += name_of(error.code);
  line += "]";
  return line;
}

}  // namespace selvedge
