// Meshopt: compressed buffer views become plain ones (meshopt.cpp is the only file that includes
// meshoptimizer).
#pragma once

#include "format/gltf/document.h"

namespace selvedge {

/// Decodes every buffer view that carries EXT_meshopt_compression (KHR_meshopt_compression likewise, as far
/// as it uses the same bitstreams) into a new buffer behind the others, filters applied, and removes the
/// extension from views, buffers and lists. Uncompressed bytes beside a stream are left alone, unless it is
/// of a newer bitstream: some encoders forget to apply the filters to them. FILE_DAMAGED for streams that
/// cannot be decoded, GLTF_MALFORMED for rules of the extension that are broken, GLTF_ACCESSOR for bytes that
/// are not there, GLTF_UNSUPPORTED for newer bitstreams, FILE_TOO_LARGE for what no stream of that length
/// holds.
Result<void> expand_meshopt(GltfDocument& document);

}  // namespace selvedge
