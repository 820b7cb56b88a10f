// The true size of a garment whose unit is not the metre.
#pragma once

#include <array>
#include <string>

#include "format/base/vec.h"
#include "format/gltf/document.h"

namespace selvedge {

struct LengthUnit {
  const char* name;
  double metres;
};
inline constexpr std::array length_units{LengthUnit{"m", 1},         LengthUnit{"dm", 0.1},
                                         LengthUnit{"cm", 0.01},     LengthUnit{"mm", 0.001},
                                         LengthUnit{"inch", 0.0254}, LengthUnit{"foot", 0.3048}};

/// Puts a node above each root that scales by `factor`. GLTF_MALFORMED for a scene that lists a node which
/// has a parent, as glTF forbids: the new node would be another one.
Result<void> scale_garment(GltfDocument& document, double factor);

/// Advice on a garment of this size, metres: the unit that makes its longest side as long as garments are,
/// 0.2 to 2.2 m, if only one does; else the length in each that does. Empty from 0.1 to 2.3 m, and for no
/// size at all.
std::string size_advice(const V3d& size);

}  // namespace selvedge
