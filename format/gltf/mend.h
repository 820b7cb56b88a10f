// What a document may hold that our readers pass over and other programs refuse.
#pragma once

#include <string>
#include <vector>

#include "format/gltf/document.h"

namespace selvedge {

/// Leaves out of a document that is to be written what breaks a rule of glTF and says nothing: lists without
/// items, animations that move nothing, members that are null, names that are no strings, attributes of no
/// known name. Extensions and extras stay as they are. Returns a line for each kind. GLTF_MALFORMED for what
/// cannot be left out: numbered attributes with a gap (TEXCOORD_2 without TEXCOORD_1), meshes without
/// primitives, skins without joints; GLTF_ACCESSOR for buffer views beyond the bytes of their buffers, also
/// where nothing uses them, and for what check_references finds.
Result<std::vector<std::string>> mend(GltfDocument& document);

}  // namespace selvedge
