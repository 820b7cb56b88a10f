// New vertices of a primitive that are copies of its old ones.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "format/gltf/access.h"

namespace selvedge {

/// Gives every accessor of a primitive's attributes and morph targets new elements: element i is element
/// sources[i] of the old one; those that name one accessor share the new one too. The indices are left to the
/// caller. Throws Failure.
void gather_vertices(GltfDocument& document, GltfReader& reader, Json& primitive,
                     const std::vector<std::uint32_t>& sources, const std::string& place);

}  // namespace selvedge
