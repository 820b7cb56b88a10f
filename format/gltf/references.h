// The numbers by which parts of a document name each other.
#pragma once

#include "format/gltf/document.h"

namespace selvedge {

/// Adds GLTF_ACCESSOR, at the place of the number, for each number without its entry, used or not: an entry
/// that an editor appends would get that number. Covers glTF itself, textures in materials' extensions (but
/// for ours, which has rules of its own), KHR_materials_variants, and buffer views beyond their buffers.
void check_references(const GltfDocument& document, IssueSink& issues);

/// The first of these errors, or of buffer views whose bytes are missing, for documents that are to be
/// edited.
Result<void> check_references(const GltfDocument& document);

}  // namespace selvedge
