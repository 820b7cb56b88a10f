// The numbers by which parts of a document name each other.
#pragma once

#include "format/gltf/document.h"

namespace selvedge {

/// GLTF_ACCESSOR, at the place of the number, for each that names an entry which is not there, also where
/// nothing is shown that uses it: what an editor appends would become that entry. Those of glTF itself, of
/// textures in materials' extensions (but for ours, which has rules of its own) and of
/// KHR_materials_variants; and buffer views beyond their buffers.
void check_references(const GltfDocument& document, IssueSink& issues);

}  // namespace selvedge
