// JSON members that the attribute texts of fabric files and samples files share.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "format/base/error.h"
#include "format/fabric/directions.h"

namespace selvedge {

/// A provenance as a JSON object; {} if it is not one.
nlohmann::json provenance_json(const std::string& provenance);

/// Rounds to the digits of an fmt format. Parsed from text, so that 19.16 does not become 19.160000000000004.
nlohmann::json short_number(double value, const char* form = "{:.4g}");

/// `layout`, `columns` and `rows`.
nlohmann::json grid_json(const DirectionGrid& grid);

/// The inverse of grid_json(), for grids of 1 to `max_directions` directions. FABRIC_UNSUPPORTED if the
/// layout is unknown, else FABRIC_MEMBER; the place is a JSON pointer relative to the grid.
Result<DirectionGrid> grid_from_json(const nlohmann::json& grid, int max_directions);

}  // namespace selvedge
