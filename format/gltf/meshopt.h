// Meshopt: compressed buffer views become plain ones, and compressed again (meshopt.cpp is the only file that
// includes meshoptimizer).
#pragma once

#include "format/gltf/document.h"

namespace selvedge {

/// Decodes every buffer view that carries EXT_meshopt_compression (KHR_meshopt_compression likewise, as far
/// as it uses the same bitstreams) into a new buffer behind the others, filters applied, and removes the
/// extension from views, buffers and lists. Uncompressed bytes beside a stream are not used unless its
/// bitstream is newer: some encoders forget to apply the filters to them. Throws the first fault:
/// FILE_DAMAGED for streams that cannot be decoded, GLTF_MALFORMED for broken rules of the extension,
/// GLTF_ACCESSOR for bytes beyond the buffer, GLTF_UNSUPPORTED for newer bitstreams, FILE_TOO_LARGE for views
/// that share streams and decode to too many bytes.
void expand_meshopt(GltfDocument& document);

/// Gives the views that were expanded their streams back (GltfDocument::original_encoding). If the extension
/// is required (OriginalEncoding::required_extensions), views of new vertices and indices are compressed too,
/// without loss. Decoded bytes have their places in a buffer that is only declared.
void repack_meshopt(GltfDocument& document);

/// Orders triangles so that neighbours follow each other, which graphics processors and encoders like, and
/// numbers the vertices by their first use. Returns the former number of each; vertices without a triangle
/// go.
std::vector<std::uint32_t> order_triangles(std::vector<std::uint32_t>& indices, std::size_t vertices);

}  // namespace selvedge
