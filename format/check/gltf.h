// The checker of glTF files with fabrics: it lists all issues of a file; a reader stops at the first error.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "format/base/error.h"
#include "format/gltf/document.h"
#include "format/scene/scene.h"

namespace selvedge {

/// Reads everything that dressing and drawing read of a .gltf or .glb file, and checks the rules of
/// SELVEDGE_materials_fabric; opens the files that it refers to, fabrics among them (check_fabric). Rules of
/// glTF that no reading depends on are left to the Khronos validator. Places are JSON pointers. Issues of an
/// embedded fabric have "/extensions/SELVEDGE_materials_fabric/fabrics/N" before their own place, issues of a
/// fabric file have that file's name. GLTF_REFERENCE for URIs that lead out of the document's folder.
/// read_scene reads a file without errors; `scene` then receives the same.
Issues check_gltf(const std::string& path, const SceneLimits& limits = {}, Scene* scene = nullptr);
/// From memory; messages name `path`, and relative URIs are relative to its folder.
Issues check_gltf(std::span<const std::uint8_t> bytes, const std::string& path,
                  const SceneLimits& limits = {}, Scene* scene = nullptr);

/// The rules of SELVEDGE_materials_fabric, and the fabrics themselves. `scene` is the document as
/// read_whole_document reads it.
void check_fabric_extension(const GltfDocument& document, const Scene& scene, IssueSink& issues);

}  // namespace selvedge
