// glTF's materials -> those of a Scene, with the pictures they use.
#pragma once

#include "format/base/error.h"
#include "format/gltf/document.h"
#include "format/scene/scene.h"

namespace selvedge {

/// Fills scene.materials, images and fabrics; materials keep their order. Pictures are loaded, up to
/// `image_bytes` of them together; one that cannot be had is remarked and its texture left out. Fabrics'
/// files are not opened. What SELVEDGE_materials_fabric forbids is added to `issues`.
void read_materials(const GltfDocument& document, std::uint64_t image_bytes, Scene& scene, IssueSink& issues);

/// Adds a remark, unless it is there already or there are very many.
void remark(Scene& scene, std::string text);

}  // namespace selvedge
