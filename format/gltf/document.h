// A glTF file in memory: its JSON as it was written, and the bytes of its buffers.
//
// We read and edit the JSON itself instead of a library's model of it, so that all members, known or not, are
// written again in the same order. Files are not trusted: access.h checks every index, offset and length
// where it is used.
#pragma once

#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "format/base/atomic_file.h"
#include "format/base/error.h"
#include "format/gltf/limits.h"

namespace selvedge {

using Json = nlohmann::ordered_json;
using Bytes = std::vector<std::uint8_t>;

/// Where bytes of a document lie: buffer and offset.
using BufferPosition = std::pair<std::size_t, std::size_t>;

/// How the geometry of a document was encoded in its file, by the place of its expanded bytes, which stays
/// where views and accessors get other numbers.
struct OriginalEncoding {
  struct DracoAccessor {
    Json json;              ///< as it was, without a view
    Json view;              ///< of the compressed stream
    int attribute_id = -1;  ///< of the attribute in the stream; -1: indices
  };
  std::map<BufferPosition, Json> meshopt_views;  ///< as they were
  std::map<BufferPosition, DracoAccessor> draco_accessors;
  std::set<std::string> required_extensions;  ///< these of the extensions were
  BufferPosition known_end;                   ///< the bytes of the file and the expanded ones lie before it
};

struct GltfDocument {
  std::string file;            ///< as the user named it
  std::string folder;          ///< relative URIs start here
  Json json;                   ///< an object; plain geometry: Draco and meshopt are expanded on loading
  std::vector<Bytes> buffers;  ///< one per entry of json["buffers"]
  OriginalEncoding original_encoding;
  /// The files that its URIs may name (resolve_uri): by `external_files` around `source_folder`, the folder
  /// that it was read from, and the files that the user has named.
  ExternalFiles external_files = ExternalFiles::in_folder;
  std::string source_folder;  ///< empty: `folder`
  std::vector<std::string> allowed_files;
  std::vector<std::string> remarks;  ///< what the reader left out or read otherwise than it is written
  std::uint64_t memory_used = 0;     ///< bytes of memory that it takes, reckoned as in memory.h
};

/// Loads .gltf (with external or data URIs) or .glb, distinguished by content, or a mesh file
/// (mesh_document.h). Missing pictures are no error; a file that is there by a similar name alone
/// (find_similar_file) is read. KHR_draco_mesh_compression and EXT_meshopt_compression
/// are expanded and their names removed. Refused are truncated files, versions other than 2.x, required
/// extensions that change the geometry and are not read, and root members that are not arrays of objects
/// where glTF has arrays; and with GLTF_REFERENCE a URI of a buffer, a picture or a fabric that leads out of
/// the document's folder, whether or not it is read.
Result<GltfDocument> load_gltf(const std::string& path, const GltfLimits& limits = {});
/// From memory; messages name `path`, and relative URIs are relative to its folder.
Result<GltfDocument> load_gltf(std::span<const std::uint8_t> bytes, const std::string& path,
                               const GltfLimits& limits = {});
/// For a checker: adds all issues, warnings too, to `issues`, and returns nothing if one of them is an error.
std::optional<GltfDocument> load_gltf(std::span<const std::uint8_t> bytes, const std::string& path,
                                      const GltfLimits& limits, IssueSink& issues);

/// Writes whole files or nothing, and returns the number of bytes. Geometry that was compressed and that
/// nothing has changed is written as it was, byte by byte; what has changed in documents that require Draco
/// or meshopt is compressed anew. ".glb": one file; all buffers become the
/// binary chunk and pictures beside the input are embedded, files that are no picture never. ".gltf": the
/// buffers become one file
/// "<stem>.bin" beside the output (another name if the input's own buffer file would be overwritten);
/// pictures and fabrics stay in their places, and their URIs are rewritten for the output's
/// folder (rebase_uris). Missing pictures keep their URI. Unused bytes are left out.
Result<std::uint64_t> save_gltf(GltfDocument document, const std::string& path);

/// The bytes of a .glb file with the whole document, its geometry plain; other files are embedded as by
/// save_gltf().
Result<std::vector<std::uint8_t>> pack_glb(GltfDocument document);

/// The same files beside their places, which appear with commit_all().
struct StagedGltf {
  std::vector<AtomicFile> files;
  std::uint64_t byte_count = 0;
  std::vector<std::string> remarks = {};  ///< on what is written otherwise than it was
};
Result<StagedGltf> stage_gltf(GltfDocument document, const std::string& path);

}  // namespace selvedge
