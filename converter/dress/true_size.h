// The true size of a garment whose unit is not the metre.
#pragma once

#include <optional>

#include "format/gltf/document.h"

namespace selvedge {

/// Puts a node above each root that scales by `unit` metres for each unit, or so that the default scene is
/// `height` metres tall. OPTION_OUT_OF_RANGE for the height of a flat garment; GLTF_MALFORMED for a
/// scene that lists a node which has a parent, as glTF forbids: the new node would be another one.
Result<void> size_garment(GltfDocument& document, double unit, std::optional<double> height,
                          const SceneLimits& limits);

}  // namespace selvedge
