// A plan as JSON and back (docs/plan.md).
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "converter/plan/scene_plan.h"

namespace selvedge {

nlohmann::ordered_json plan_json(const ScenePlan& plan);

/// The levels that materials of a plan file need together: all materials where `materials` is empty, else
/// those of a name, or "#index". No finer level than the last where no frame sees any of them (min_mm is
/// infinite). JSON_MALFORMED, also of members that contradict each other; MATERIAL_MISSING.
Result<TexelDemand> read_plan(const std::string& path, const std::vector<std::string>& materials);

}  // namespace selvedge
