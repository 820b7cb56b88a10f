// The URIs of a glTF document: reading files, data URIs and pictures, and URIs for another folder.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "format/gltf/access.h"

namespace selvedge {

inline constexpr std::uint64_t max_uri_bytes = std::uint64_t{1} << 32;

/// The bytes of a "uri" member: a base64 data URI, or a file relative to the document's folder (a plain one:
/// no device, no pipe). `place` is the JSON pointer of the object that holds the URI. GLTF_MALFORMED for a
/// broken data URI, GLTF_UNSUPPORTED for a scheme such as http, FILE_TOO_LARGE beyond `limit` bytes.
Bytes read_uri(GltfReader& reader, const std::string& uri, const std::string& place,
               std::uint64_t limit = max_uri_bytes);

/// The encoded bytes of an entry of "images", from its URI or its buffer view.
Result<Bytes> read_image_bytes(const GltfDocument& document, int image, std::uint64_t limit = max_uri_bytes);

/// The path of the file that a relative URI names: percent-decoded and resolved against the document's
/// folder. GLTF_UNSUPPORTED for data URIs and for schemes such as http.
Result<std::string> resolve_uri(const GltfDocument& document, const std::string& uri,
                                const std::string& place);

/// A relative URI (percent-encoded) that names `target` in a glTF file in `folder`.
std::string relative_uri(const std::string& target, const std::string& folder);

/// Moves the document to `folder`: relative URIs of buffers, pictures and fabrics are rewritten so that they
/// name the same files. Nothing changes if it is the same folder.
void move_document(GltfDocument& document, const std::string& folder);

}  // namespace selvedge
