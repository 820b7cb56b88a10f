// The URIs of a glTF document: reading files, data URIs and pictures, and URIs for another folder.
#pragma once

#include <cstdint>
#include <string>

#include "format/gltf/access.h"

namespace selvedge {

inline constexpr std::uint64_t max_uri_bytes = std::uint64_t{1} << 32;

/// The bytes of a "uri" member: a base64 data URI, or a file relative to the document's folder (a plain one:
/// no device, no pipe). `place` is the JSON pointer of the object that holds the URI. GLTF_MALFORMED for a
/// broken data URI, GLTF_UNSUPPORTED for a scheme such as http, FILE_TOO_LARGE beyond `limit` bytes.
Bytes read_uri(GltfReader& reader, const std::string& uri, const std::string& place,
               std::uint64_t limit = max_uri_bytes);

/// The encoded bytes of an entry of "images", from its URI or its buffer view. IMAGE_UNREADABLE for a file
/// that is no picture (picture_type).
Result<Bytes> read_image_bytes(const GltfDocument& document, int image, std::uint64_t limit = max_uri_bytes);

/// Whether `path` lies in `folder` or below after all links in both are followed; it need not exist.
/// FILE_UNREADABLE if the system does not say, e.g. for links in a circle.
Result<bool> is_inside(const std::string& path, const std::string& folder);

/// The path of the file that a relative URI names: percent-decoded and resolved against the document's
/// folder. This is the one way from a document to another file. GLTF_UNSUPPORTED for data URIs and for
/// schemes such as http; GLTF_REFERENCE for a file that is not in the document's folder (is_inside) and is
/// not allowed (GltfDocument::external_files, allowed_files). Nothing is opened.
Result<std::string> resolve_uri(const GltfDocument& document, const std::string& uri,
                                const std::string& place);

/// Adds GLTF_REFERENCE for every URI of a buffer, a picture or a fabric that leads out of the folder that
/// the document is in now, allowed or not: what readers of a file there refuse.
void find_outside_uris(const GltfDocument& document, IssueSink& issues);

/// The file in `folder` that a name from another system means: with slashes for backslashes, or else its last
/// part alone, in any capitals. Empty without such a file, and if it leads out of the document's folder.
std::string find_similar_file(const GltfDocument& document, std::string name);

/// Replaces URIs of missing files by URIs of similar ones (find_similar_file), each with a remark.
void redirect_missing_files(GltfDocument& document);

/// Allows the file that a URI names now, as the user's own choice.
void allow_file(GltfDocument& document, const std::string& uri);

/// A relative URI (percent-encoded) that names `target` in a glTF file in `folder`.
std::string relative_uri(const std::string& target, const std::string& folder);

/// Moves the document to `folder`: relative URIs of buffers, pictures and fabrics that exist are rewritten so
/// that they name the same files. Nothing changes if it is the same folder.
void rebase_uris(GltfDocument& document, const std::string& folder);

}  // namespace selvedge
