// The parts of check_gltf, each of which checks one kind of the rules, and the helpers that they share.
#pragma once

#include <cstddef>
#include <string>

#include "format/base/issue_sink.h"
#include "format/base/json_text.h"
#include "format/gltf/document.h"
#include "format/gltf/names.h"

namespace selvedge {

/// Visits the objects of an array of the root, with their index.
template <class F>
void for_each_object(const Json& root, const char* array, const F& visit) {
  const auto found = root.find(array);
  if (found == root.end() || !found->is_array()) return;
  for (std::size_t i = 0; i < found->size(); ++i) {
    if ((*found)[i].is_object()) visit((*found)[i], static_cast<int>(i));
  }
}

/// Visits the textures below a material (objects shaped like a textureInfo), with their place; what is in
/// extras and the reference to a fabric are none.
template <class F>
void for_each_texture(const Json& json, const std::string& place, const F& visit) {
  for (const auto& [name, value] : json.items()) {
    if (!value.is_object() || name == "extras" || name == names::gltf::fabric_extension) continue;
    const std::string where = pointer_to(place, name);
    if (name.ends_with("Texture") && value.contains(names::gltf::index)) {
      visit(value, where);
    } else {
      for_each_texture(value, where, visit);
    }
  }
}

/// A value's own text in a message, cut short.
std::string excerpt(const Json& value);

/// Types, required members, ranges, lengths of arrays, and indices into the root's arrays
/// (gltf_check_schema.cpp); extensions against their lists.
void check_schema(const Json& root, IssueSink& issues);

/// Bounds, strides and alignment of views and accessors, what they are used for, and their values
/// (gltf_check_data.cpp). Buffers that could not be read are empty: their values are left out.
void check_data(const GltfDocument& document, IssueSink& issues);

/// Attributes, indices, morph targets and materials of primitives (gltf_check_mesh.cpp).
void check_meshes(const GltfDocument& document, IssueSink& issues);

/// Nodes, scenes, skins, cameras and animations (gltf_check_nodes.cpp).
void check_nodes(const GltfDocument& document, IssueSink& issues);

/// Pictures: that they are there, and of the format that they say (gltf_check_images.cpp).
void check_images(const GltfDocument& document, IssueSink& issues);

/// SELVEDGE_materials_fabric (gltf_check_fabric.cpp).
void check_fabrics(const GltfDocument& document, IssueSink& issues);

}  // namespace selvedge
