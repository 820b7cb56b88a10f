// Removing pictures that an edit has left without use, and those that are not there.
#pragma once

#include <set>
#include <string>
#include <vector>

#include "format/gltf/document.h"

namespace selvedge {

/// The textures that something refers to: an object named "...Texture" with an index, extras left out.
std::set<int> textures_in_use(const Json& json);

/// Removes the textures that were `used` and are not any more, the pictures and samplers that nothing but
/// these used, the fabrics that no material wears, and the views of these pictures and fabrics. Returns an
/// extension of the document that may refer to textures or pictures in ways of its own, and then removes
/// nothing; else "".
std::string drop_unused_pictures(GltfDocument& document, const std::set<int>& used);

/// Removes pictures whose file does not exist, or is no picture, and their textures, from what refers to them
/// as well; what had such an emissiveTexture does not glow. A texture that has another one, its own or
/// by an extension, stays with that. The same of textures that are not there, whose numbers others would get;
/// an extension of unknown ways keeps them. Returns what is wrong with each. GLTF_REFERENCE where such a
/// picture has to stay: for a light, or for an extension for which drop_unused_pictures() would remove
/// nothing.
Result<std::vector<std::string>> drop_missing_pictures(GltfDocument& document);

}  // namespace selvedge
