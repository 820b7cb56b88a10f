// The checker of glTF files with fabrics: all issues of a file, where a reader stops at the first error.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "format/base/error.h"
#include "format/gltf/document.h"
#include "format/scene/scene.h"

namespace selvedge {

/// Reads everything that dressing and drawing read of a .gltf or .glb file, and checks the rules of
/// SELVEDGE_materials_fabric; opens the files that it refers to, fabrics among them (check_fabric). Rules of
/// glTF that no reading depends on are left to the Khronos validator. Places are JSON pointers. The issues of
/// an embedded fabric have "/extensions/SELVEDGE_materials_fabric/fabrics/N" before their own place, those of
/// a fabric file have that file's name. No errors: a file that read_scene reads; `scene` is then what it
/// gives.
Issues check_gltf(const std::string& path, const GltfLimits& limits = {}, Scene* scene = nullptr);
/// From memory; `path` is used in messages and for what relative URIs are relative to.
Issues check_gltf(std::span<const std::uint8_t> bytes, const std::string& path, const GltfLimits& limits = {},
                  Scene* scene = nullptr);

/// The part of it that is about fabrics: the rules of SELVEDGE_materials_fabric, and the fabrics themselves.
void check_fabrics(const GltfDocument& document, IssueSink& issues);

}  // namespace selvedge
