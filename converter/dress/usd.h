// A dressed garment as USD: a .usda layer that names the fabric beside a UsdPreviewSurface (spec/usd.md).
//
// Written are the triangles of the default scene with their normals and up to two sets of texture
// coordinates, and the materials on them: base colour, normal map, metallic and roughness factors, emission
// factor, opacity, and the fabric. Not written are skins, animations, morph targets, cameras, lights,
// variants, and what UsdPreviewSurface cannot say, such as sheen.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "format/base/atomic_file.h"
#include "format/gltf/document.h"

namespace selvedge {

struct UsdFile {
  std::string path;
  std::vector<std::uint8_t> bytes;
};

/// Files in memory. The layer is the last of them; before it come pictures and fabrics that are inside of the
/// glTF, as "<stem>-image<index>" and "<stem>-fabric<index>" beside it. Those that are files already are
/// referred to where they are.
struct UsdFiles {
  std::vector<UsdFile> files;
  std::vector<std::string> remarks;  ///< what could not be written, one line each
};

/// `path` is where the layer is going to be; it ends in ".usda".
Result<UsdFiles> usd_of(const GltfDocument& document, const std::string& path);

/// Writes all files beside their final places; they appear there with commit(), in this order.
Result<std::vector<AtomicFile>> stage(const UsdFiles& files);

}  // namespace selvedge
