#include "format/base/error.h"

#include <algorithm>
#include <array>

#include "format/base/printable.h"

namespace selvedge {
namespace {

constexpr std::array rows{
    CodeRow{Code::file_missing, Severity::error, "FILE_MISSING", "The named file does not exist."},
    CodeRow{Code::file_unreadable, Severity::error, "FILE_UNREADABLE",
            "The file exists but cannot be opened or read."},
    CodeRow{Code::file_unwritable, Severity::error, "FILE_UNWRITABLE",
            "The output cannot be written; nothing is left behind."},
    CodeRow{Code::file_damaged, Severity::error, "FILE_DAMAGED",
            "The file is cut short or a part of it cannot be decoded."},
    CodeRow{Code::file_too_large, Severity::error, "FILE_TOO_LARGE",
            "A declared size is beyond the stated limits."},
    CodeRow{Code::option_out_of_range, Severity::error, "OPTION_OUT_OF_RANGE",
            "An option's value is outside of its range."},
    CodeRow{Code::json_malformed, Severity::error, "JSON_MALFORMED", "A JSON text cannot be parsed."},
    CodeRow{Code::stitch_unknown, Severity::error, "STITCH_UNKNOWN",
            "No built-in stitch has that name and no such file exists."},
    CodeRow{Code::stitch_invalid, Severity::error, "STITCH_INVALID",
            "A stitch description breaks a rule, e.g. has no yarn."},
    CodeRow{Code::mesh_empty, Severity::error, "MESH_EMPTY", "The mesh has no triangles."},
    CodeRow{Code::mesh_not_finite, Severity::error, "MESH_NOT_FINITE",
            "A vertex of the mesh is NaN or infinite."},
    CodeRow{Code::mesh_invalid, Severity::error, "MESH_INVALID",
            "The mesh cannot be used, e.g. its period is missing."},
    CodeRow{Code::exr_malformed, Severity::error, "EXR_MALFORMED",
            "The file is not an OpenEXR file or its header is broken."},
    CodeRow{Code::exr_unsupported, Severity::error, "EXR_UNSUPPORTED",
            "A valid OpenEXR file with a feature that is not read."},
    CodeRow{Code::samples_malformed, Severity::error, "SAMPLES_MALFORMED",
            "The EXR file is not a samples file."},
    CodeRow{Code::samples_not_finite, Severity::error, "SAMPLES_NOT_FINITE",
            "A sample is NaN, infinite or negative."},
    CodeRow{Code::samples_sparse, Severity::warning, "SAMPLES_SPARSE",
            "Samples leave something open: texels that are never seen, fewer samples than parameters."},
    CodeRow{Code::fabric_malformed, Severity::error, "FABRIC_MALFORMED",
            "The EXR file is not a fabric file."},
    CodeRow{Code::fabric_version, Severity::error, "FABRIC_VERSION",
            "The fabric file is of another major version."},
    CodeRow{Code::fabric_unsupported, Severity::error, "FABRIC_UNSUPPORTED",
            "The fabric has a layer or a layout that this reader does not know."},
    CodeRow{Code::fabric_member, Severity::error, "FABRIC_MEMBER",
            "A member of the attribute text is missing, of the wrong type or out of range."},
    CodeRow{Code::fabric_part, Severity::error, "FABRIC_PART",
            "A part of the fabric file is missing or laid out against the rules."},
    CodeRow{Code::fabric_channel, Severity::error, "FABRIC_CHANNEL",
            "A channel is missing, or of a name or precision that the rules forbid."},
    CodeRow{Code::fabric_lossy, Severity::error, "FABRIC_LOSSY",
            "A data part is stored with lossy compression."},
    CodeRow{Code::fabric_not_finite, Severity::error, "FABRIC_NOT_FINITE",
            "A stored value is NaN, infinite or out of range."},
    CodeRow{Code::fabric_digest, Severity::error, "FABRIC_DIGEST",
            "A digest is missing, or differs from the attributes, names or pixels."},
    CodeRow{Code::fabric_mismatch, Severity::error, "FABRIC_MISMATCH",
            "Fabric and samples do not describe the same cell."},
    CodeRow{Code::fabric_peak, Severity::warning, "FABRIC_PEAK",
            "A lobe's peak is beyond half precision, or lobes with a large exponent are stored in half."},
    CodeRow{Code::fabric_precision, Severity::warning, "FABRIC_PRECISION",
            "Half precision changes the lobes or the products of a texel, or the radiance of samples, by "
            "more than "
            "5 % when they are written."},
    CodeRow{Code::fabric_energy, Severity::warning, "FABRIC_ENERGY",
            "A texel reflects more light than it receives."},
    CodeRow{Code::fabric_levels, Severity::warning, "FABRIC_LEVELS",
            "Levels are missing, or a layer is on some of the levels only."},
    CodeRow{Code::fabric_advice, Severity::warning, "FABRIC_ADVICE",
            "Legal, but a tool may be misled: mirrors that differ, unlisted levels that are not zero, "
            "unknown members."},
    CodeRow{Code::gltf_malformed, Severity::error, "GLTF_MALFORMED",
            "The glTF file breaks a rule of the glTF specification."},
    CodeRow{Code::gltf_unsupported, Severity::error, "GLTF_UNSUPPORTED",
            "A required glTF feature is not supported."},
    CodeRow{Code::gltf_accessor, Severity::error, "GLTF_ACCESSOR",
            "An accessor, buffer view or index reaches beyond what it refers to."},
    CodeRow{Code::gltf_extension, Severity::error, "GLTF_EXTENSION",
            "SELVEDGE_materials_fabric is used against its specification."},
    CodeRow{Code::gltf_reference, Severity::error, "GLTF_REFERENCE",
            "A fabric that the glTF refers to cannot be found."},
    CodeRow{Code::gltf_fallback, Severity::warning, "GLTF_FALLBACK",
            "The fallback is missing, or other viewers will show something else than the fabric."},
    CodeRow{Code::gltf_alpha, Severity::warning, "GLTF_ALPHA",
            "The alpha mode hides the holes of the fabric, or blends a fabric that has none."},
    CodeRow{Code::gltf_transform, Severity::warning, "GLTF_TRANSFORM",
            "Fabric and fallback do not lie alike on the surface."},
    CodeRow{Code::gltf_mirror, Severity::warning, "GLTF_MIRROR",
            "The mirror in extras is missing or differs from the extension."},
    CodeRow{Code::gltf_advice, Severity::warning, "GLTF_ADVICE", "Legal, but unwise: see the message."},
    CodeRow{Code::material_missing, Severity::error, "MATERIAL_MISSING",
            "The garment has no material of that name, or none to work on."},
    CodeRow{Code::garment_no_uvs, Severity::error, "GARMENT_NO_UVS",
            "The material's triangles have no texture coordinates."},
    CodeRow{Code::garment_empty, Severity::error, "GARMENT_EMPTY",
            "The glTF has no triangles to dress or to draw."},
    CodeRow{Code::image_unreadable, Severity::error, "IMAGE_UNREADABLE", "An image cannot be read."},
    CodeRow{Code::image_mismatch, Severity::error, "IMAGE_MISMATCH",
            "Two images differ in size, or beyond the given bound."},
    CodeRow{Code::image_unwritable, Severity::error, "IMAGE_UNWRITABLE", "An image cannot be written."},
    CodeRow{Code::graphics_unavailable, Severity::error, "GRAPHICS_UNAVAILABLE",
            "No OpenGL context can be had, or it failed."},
};

}  // namespace

std::span<const CodeRow> code_table() { return rows; }

std::string_view name_of(Code code) {
  const auto row = std::find_if(rows.begin(), rows.end(), [&](const CodeRow& r) { return r.code == code; });
  return row == rows.end() ? std::string_view("UNKNOWN") : row->name;
}

Severity severity_of(Code code) {
  const auto row = std::find_if(rows.begin(), rows.end(), [&](const CodeRow& r) { return r.code == code; });
  return row == rows.end() ? Severity::error : row->severity;
}

std::string_view name_of(Severity severity) { return severity == Severity::error ? "error" : "warning"; }

bool has_error(const Issues& issues) {
  return std::any_of(issues.begin(), issues.end(),
                     [](const Error& issue) { return severity_of(issue.code) == Severity::error; });
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
  line = printable(line);
  line += " [";
  line += name_of(error.code);
  line += "]";
  return line;
}

}  // namespace selvedge
