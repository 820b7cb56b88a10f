// Draco: compressed primitives become plain ones (draco.cpp is the only file that includes Draco).
#pragma once

#include "format/gltf/document.h"

namespace selvedge {

/// Decodes every primitive that carries KHR_draco_mesh_compression (triangle meshes; ids, component counts
/// and sizes are checked), gives its accessors plain data, and removes the extension
/// from primitives and from the lists. Decoded normals, tangents and weights are made valid again: unit
/// length, sign +-1, sum 1; min and max are those of the decoded values.
Result<void> expand_draco(GltfDocument& document);

}  // namespace selvedge
