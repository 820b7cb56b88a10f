// Writes a plan as JSON and reads it back (docs/plan.md).
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "converter/plan/scene_plan.h"

namespace selvedge {

nlohmann::ordered_json plan_json(const ScenePlan& plan);

/// The joint demand of materials of a plan file: of all if `materials` is empty, else of those with these
/// names or "#index". If no frame sees any of them, only the coarsest level is needed (min_mm is infinite).
/// Errors: JSON_MALFORMED, also if members contradict each other; MATERIAL_MISSING.
Result<TexelDemand> read_plan(const std::string& path, const std::vector<std::string>& materials);

}  // namespace selvedge
