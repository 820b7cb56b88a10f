// What the parts of check_gltf share: the list of issues, and the document they look at.
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <utility>

#include "format/base/json_text.h"
#include "format/gltf/document.h"
#include "format/gltf/names.h"

namespace selvedge {

/// Collects issues of one file; beyond a number of each severity it only counts.
class IssueList {
 public:
  IssueList(std::string file, std::size_t limit) : file_(std::move(file)), limit_(limit) {}

  void add(Code code, std::string place, std::string message);
  void add(const Error& error);
  void add(const Issues& issues);
  bool has_error() const { return counts_[0] > 0; }
  /// The issues, and a last one for each severity that has more.
  Issues take();

 private:
  std::string file_;
  std::size_t limit_;
  std::array<std::size_t, 2> counts_{0, 0};  ///< by severity
  Issues issues_;
};

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
void check_schema(const Json& root, IssueList& issues);

/// Bounds, strides and alignment of views and accessors, what they are used for, and their values
/// (gltf_check_data.cpp). Buffers that could not be read are empty: their values are left out.
void check_data(const GltfDocument& document, IssueList& issues);

/// Attributes, indices, morph targets and materials of primitives (gltf_check_mesh.cpp).
void check_meshes(const GltfDocument& document, IssueList& issues);

/// Nodes, scenes, skins, cameras and animations (gltf_check_nodes.cpp).
void check_nodes(const GltfDocument& document, IssueList& issues);

/// Pictures: that they are there, and of the format that they say (gltf_check_images.cpp).
void check_images(const GltfDocument& document, IssueList& issues);

/// SELVEDGE_materials_fabric (gltf_check_fabric.cpp).
void check_fabrics(const GltfDocument& document, IssueList& issues);

}  // namespace selvedge
