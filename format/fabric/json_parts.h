// JSON members that the attributes of fabrics and of samples share.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "format/base/error.h"
#include "format/fabric/directions.h"
#include "format/fabric/fabric.h"

namespace selvedge {

/// The JSON object that a provenance is; {} where it is none.
nlohmann::json provenance_json(const std::string& provenance);

/// `layout`, `columns` and `rows`.
nlohmann::json grid_json(const DirectionGrid& grid);

/// `level` and `texels`.
nlohmann::json whole_json(const WholeFabric& whole);

/// The inverse of grid_json(), for grids of 1 to `most` directions. FABRIC_UNSUPPORTED where the layout is
/// unknown, else FABRIC_MEMBER; the place is a JSON pointer from the grid on.
Result<DirectionGrid> grid_from(const nlohmann::json& grid, int most);

}  // namespace selvedge
