// Every broken rule of a glTF file: what `check` prints, where a reader stops at the first.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "format/base/error.h"
#include "format/gltf/document.h"
#include "format/scene/scene.h"

namespace selvedge {

struct GltfCheckLimits {
  GltfLimits read;
  std::size_t issues = 100;  ///< of each severity; the rest are counted in one more
};

/// Checks containers, structure, indices, bounds and data of a .gltf or .glb file by glTF 2.0, as far as it
/// concerns what can be seen of a mesh that stands still, and the rules of SELVEDGE_materials_fabric; opens
/// the files that it refers to, fabrics among them (check_fabric). Places are JSON pointers. The issues of an
/// embedded fabric have "/extensions/SELVEDGE_materials_fabric/fabrics/N" before their own place, those of a
/// fabric file have that file's name. No errors: a file that read_scene reads; `scene` is then what it gives.
Issues check_gltf(const std::string& path, const GltfCheckLimits& limits = {}, Scene* scene = nullptr);
/// From memory; `path` is used in messages and for what relative URIs are relative to.
Issues check_gltf(std::span<const std::uint8_t> bytes, const std::string& path,
                  const GltfCheckLimits& limits = {}, Scene* scene = nullptr);

}  // namespace selvedge
