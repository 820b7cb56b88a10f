// The true size of a garment whose unit is not the metre.
#pragma once

#include <optional>
#include <string>

#include "format/base/vec.h"
#include "format/gltf/document.h"

namespace selvedge {

/// Puts a node above each root that scales by `unit` metres for each unit, or so that the default scene is
/// `height` metres tall. OPTION_OUT_OF_RANGE for the height of a flat garment; GLTF_MALFORMED for a
/// scene that lists a node which has a parent, as glTF forbids: the new node would be another one.
Result<void> size_garment(GltfDocument& document, double unit, std::optional<double> height,
                          const SceneLimits& limits);

/// Advice on a garment of this size, metres: the unit that makes its longest side as long as garments
/// are, 0.3 to 2.2 m, or that none does. Empty from 0.1 to 2.3 m, and for no size at all.
std::string size_advice(const V3d& size);

}  // namespace selvedge
