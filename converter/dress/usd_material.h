// A glTF material -> the text of a USD Material prim.
#pragma once

#include <string>

#include "format/gltf/document.h"
#include "format/scene/scene.h"

namespace selvedge {

/// Where the pictures and fabrics of a document are for a layer, as USD asset paths; empty: cannot be had.
class UsdAssets {
 public:
  virtual ~UsdAssets() = default;
  virtual std::string image(int index) = 0;   ///< of the glTF's images
  virtual std::string fabric(int index) = 0;  ///< of Scene::fabrics
};

/// KHR_texture_transform for texture coordinates whose second one grows upwards: the values of a
/// UsdTransform2d that takes (u, 1 - v) to (u', 1 - v').
struct UsdTransform2d {
  V2d scale{1, 1};
  double rotation = 0;  ///< degrees, counter-clockwise
  V2d translation{0, 0};
};
UsdTransform2d usd_transform(const UvTransform& transform);

/// The prim `name`, whose own path is `path`. `json` is the glTF material behind `material`.
std::string usd_material(const GltfDocument& document, const Json& json, const SceneMaterial& material,
                         const std::string& name, const std::string& path, UsdAssets& assets);

/// The primvar of a set of texture coordinates: "st", "st1".
std::string usd_primvar(int tex_coord);

/// "@./file@"
std::string usd_asset(const std::string& path);

}  // namespace selvedge
