// Reads pairs of directions from a JSON file (docs/bake.md).
#pragma once

#include <array>
#include <string>
#include <vector>

#include "format/base/error.h"
#include "format/fabric/directions.h"

namespace selvedge {

/// Pairs by PairKind. The file is a JSON object with any of the members "validation", "held-out" and "rim",
/// each a list of {"light": [x, y, z], "view": [x, y, z]}; directions are normalised. Refuses
/// (json_malformed, with the JSON pointer) other members, directions that do not point above the cloth (z <
/// 0.001 of their length) and more than 65,536 pairs of a set.
Result<std::array<std::vector<DirectionPair>, 3>> read_pairs(const std::string& path);

}  // namespace selvedge
