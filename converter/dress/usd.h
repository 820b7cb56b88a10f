// Converts a dressed garment to USD: a .usda layer that names the fabric beside a UsdPreviewSurface
// (spec/usd.md).
//
// The layer has the triangles of the default scene with normals and up to two sets of texture coordinates,
// and their materials: base colour, normal map, metallic and roughness factors, emission factor, opacity, and
// the fabric. It has no skins, animations, morph targets, cameras, lights, variants, nor properties that
// UsdPreviewSurface lacks, such as sheen.
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

/// Files in memory. The layer is the last; before it come the pictures and fabrics embedded in the glTF, as
/// "<stem>-image<index>" and "<stem>-fabric<index>" beside it. External files are referred to at their
/// places.
struct UsdFiles {
  std::vector<UsdFile> files;
  std::vector<std::string> remarks;  ///< content that could not be written, one line each
};

/// `path` is the layer's, with the ending ".usda".
Result<UsdFiles> usd_of(const GltfDocument& document, const std::string& path,
                        const SceneLimits& limits = {});

/// Writes all files beside their final places; they appear there with commit_all(), in this order.
Result<std::vector<AtomicFile>> stage(const UsdFiles& files);

}  // namespace selvedge
