// Removing the pictures, the fabrics and the geometry that an edit has left without use.
#pragma once

#include <set>

#include "format/gltf/document.h"

namespace selvedge {

/// The numbers by which a document refers to its parts, extras left out.
struct UsedParts {
  std::set<int> textures;   ///< by an object named "...Texture" with an index
  std::set<int> accessors;  ///< by meshes, skins, animations and instances
  std::set<int> views;      ///< by a member "bufferView"
};
UsedParts used_parts(GltfDocument& document);

/// Removes the textures and accessors that were `used` and are no longer, the pictures that these textures
/// alone used, the names of extensions for formats that no texture has, and the fabrics that no material
/// wears, with their buffer views. Removes nothing if the document uses an extension that may refer to such
/// parts in ways of its own.
void drop_unused_parts(GltfDocument& document, const UsedParts& used);

/// Removes the accessors and views that were `used` and are no longer, whatever the extensions.
void drop_unused_data(GltfDocument& document, const UsedParts& used);

}  // namespace selvedge
