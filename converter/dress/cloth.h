// The fabrics that a garment is dressed in.
#pragma once

#include <optional>
#include <string>

#include "converter/dress/dress.h"
#include "converter/dress/fabric_source.h"
#include "converter/dress/fallback.h"
#include "converter/dress/fallback_material.h"
#include "format/fabric/fabric.h"
#include "format/gltf/limits.h"

namespace selvedge {

/// A fabric that materials wear; what is made of it is made once.
struct Cloth {
  Fabric fabric;
  FabricSource source;
  std::string digest;
  int index = -1;  ///< of its entry in the document
  std::optional<Fallback> baked = {};
  std::optional<FallbackTextures> textures = {};

  const Fallback& fallback();
};

/// Reads a fabric, takes its memory from the limits, and refuses options that do not go with it. To be
/// caught: a Failure (value_or_throw()).
Cloth read_cloth(const std::string& path, const std::string& output_path, const DressOptions& options,
                 SceneLimits& limits);

}  // namespace selvedge
