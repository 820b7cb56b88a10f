// Meshopt: compressed buffer views become plain ones (gltf_meshopt.cpp is the only file that includes
// meshoptimizer).
#pragma once

#include "format/gltf/document.h"

namespace selvedge {

/// Whether a buffer view refers to the buffer only as the place of its decoded bytes: such a buffer need not
/// say where its bytes are.
bool is_meshopt_fallback(const Json& root, int buffer);

/// Decodes every buffer view that carries EXT_meshopt_compression (KHR_meshopt_compression likewise, as far
/// as it uses the same bitstreams) into a new buffer behind the others, filters applied, and removes the
/// extension from views, buffers and lists. Uncompressed bytes beside a stream are left alone, unless it is
/// of a newer bitstream: some encoders forget to apply the filters to them. FILE_DAMAGED for streams that
/// cannot be decoded, GLTF_MALFORMED for rules of the extension that are broken, GLTF_ACCESSOR for bytes that
/// are not there, GLTF_UNSUPPORTED for newer bitstreams, FILE_TOO_LARGE for what no stream of that length
/// holds.
Result<void> expand_meshopt(GltfDocument& document);

}  // namespace selvedge
