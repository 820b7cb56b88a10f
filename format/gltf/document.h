// A glTF file in memory: its JSON as it was written, and the bytes of its buffers.
//
// We read and edit the JSON itself instead of a library's model of it, so that whatever the user had is still
// there, in the same order, when it is written. What a file says is believed nowhere: access.h checks every
// index, offset and length where it is used.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "format/base/error.h"
#include "format/base/issue_sink.h"

namespace selvedge {

using Json = nlohmann::ordered_json;

struct GltfDocument {
  std::string file;            ///< as the user named it
  std::string folder;          ///< what relative URIs are relative to
  bool external_files = true;  ///< as GltfLimits said
  Json json;                   ///< an object; plain geometry: Draco and meshopt are expanded on loading
  std::vector<std::vector<std::uint8_t>> buffers;  ///< one per entry of json["buffers"]
};

/// Stated limits; beyond them a file is refused.
struct GltfLimits {
  std::uint64_t file_bytes = std::uint64_t{1} << 31;
  std::uint64_t buffer_bytes = std::uint64_t{1} << 32;  ///< of all buffers together
  int nesting = 128;                                    ///< of JSON brackets
  int members = 1024;          ///< of one JSON object, whose members are looked up one after the other
  bool external_files = true;  ///< false: a URI that is not a data URI is refused, no other file is opened
};

/// Loads .gltf (with external or data URIs) or .glb, told apart by content. Missing pictures are no error.
/// KHR_draco_mesh_compression and EXT_meshopt_compression are expanded and their names removed. Refused:
/// anything cut short, versions other than 2.x, required extensions that change the geometry and are not
/// read, and root members that are not arrays of objects where glTF has them.
Result<GltfDocument> load_gltf(const std::string& path, const GltfLimits& limits = {});
/// From memory; `path` is used in messages and for what relative URIs are relative to.
Result<GltfDocument> load_gltf(std::span<const std::uint8_t> bytes, const std::string& path,
                               const GltfLimits& limits = {});
/// The same for a checker: all issues, warnings too, are added to `issues`; nothing comes back if one of them
/// is an error.
std::optional<GltfDocument> load_gltf(std::span<const std::uint8_t> bytes, const std::string& path,
                                      const GltfLimits& limits, IssueSink& issues);

/// Writes whole files or nothing, and gives back how many bytes. ".glb": one file; all buffers become the
/// binary chunk and pictures beside the input are embedded. ".gltf": the buffers become one file
/// "<stem>.bin" beside the output (another name if the input's own buffer file would be overwritten);
/// pictures and fabrics stay where they are, with URIs that are right for the output's folder
/// (move_document). Pictures that cannot be found keep their (rewritten) URI. Bytes that nothing refers to
/// any more are left out.
Result<std::uint64_t> save_gltf(GltfDocument document, const std::string& path);

}  // namespace selvedge
