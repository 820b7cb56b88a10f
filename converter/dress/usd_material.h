// Converts a glTF material to the text of a USD Material prim.
#pragma once

#include <string>

#include "format/gltf/document.h"
#include "format/scene/scene.h"

namespace selvedge {

/// USD asset paths of a document's pictures and fabrics, relative to a layer; empty if not available.
class UsdAssets {
 public:
  virtual ~UsdAssets() = default;
  virtual std::string image(int index) = 0;   ///< of the glTF's images
  virtual std::string fabric(int index) = 0;  ///< of Scene::fabrics
};

/// KHR_texture_transform for texture coordinates with v up: the inputs of a UsdTransform2d that maps (u, 1 -
/// v) to (u', 1 - v').
struct UsdTransform2d {
  V2d scale{1, 1};
  double rotation = 0;  ///< degrees, counter-clockwise
  V2d translation{0, 0};
};
UsdTransform2d usd_transform(const UvTransform& transform);

/// The prim `name` at `path`. `json` is the glTF material of which `material` was read.
std::string usd_material(const GltfDocument& document, const Json& json, const SceneMaterial& material,
                         const std::string& name, const std::string& path, UsdAssets& assets);

/// The primvar of a set of texture coordinates: "st", "st1".
std::string usd_primvar(int tex_coord);

/// "@./file@"
std::string usd_asset(const std::string& path);

}  // namespace selvedge
