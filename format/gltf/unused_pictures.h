// Removing the pictures and fabrics that an edit has left without use.
#pragma once

#include <set>

#include "format/gltf/document.h"

namespace selvedge {

/// The textures that the document refers to: by an object named "...Texture" with an index, extras left out.
std::set<int> textures_in_use(GltfDocument& document);

/// Removes the textures that were `used` and are no longer, the pictures that these alone used, and the
/// fabrics that no material wears, with their buffer views. Removes nothing if the document uses an extension
/// that may refer to pictures in ways of its own.
void drop_unused_pictures(GltfDocument& document, const std::set<int>& used);

}  // namespace selvedge
