// Converts a dressed garment to USD: a .usda layer that names the fabric beside a UsdPreviewSurface
// (spec/usd.md).
//
// The layer has the triangles of the default scene with normals and up to two sets of texture coordinates,
// and their materials: base colour, normal map, metallic and roughness factors, emission factor, opacity, and
// the fabric. It has no skins, animations, morph targets, cameras, lights, variants, nor properties that
// UsdPreviewSurface lacks, such as sheen.
#pragma once

#include <Imath/ImathBox.h>

#include <cstdint>
#include <string>
#include <vector>

#include "format/base/atomic_file.h"
#include "format/gltf/document.h"
#include "format/scene/scene.h"

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

/// Curves that reflect and are as thick alike.
struct UsdCurves {
  std::string name;
  V3f color{1, 1, 1};                    ///< linear
  float width = 0;                       ///< m
  std::vector<std::vector<V3f>> points;  ///< of each curve: m, from `origin`; at least two
  V3d origin{0, 0, 0};                   ///< m, world
};

/// Where the origin of places in single precision should lie (m): at 0, or in the middle of a box that lies
/// farther away than it is long.
V3d origin_of(const Imath::Box3d& box);

/// Throws Failure where one cannot be written.
std::vector<AtomicFile> stage_files(const UsdFiles& files);

/// `path` is the layer's, with the ending ".usda". Triangles that have at least eight places, each a
/// position, rotation and scale, become a PointInstancer; `curves` become BasisCurves.
Result<UsdFiles> usd_of(const GltfDocument& document, const std::string& path, const SceneLimits& limits = {},
                        const std::vector<UsdCurves>& curves = {});

/// KHR_texture_transform for texture coordinates with v up: the inputs of a UsdTransform2d that maps (u, 1 -
/// v) to (u', 1 - v').
struct UsdTransform2d {
  V2d scale{1, 1};
  double rotation = 0;  ///< degrees, counter-clockwise
  V2d translation{0, 0};
};
UsdTransform2d usd_transform(const UvTransform& transform);

}  // namespace selvedge
