// The queries of spec/conformance, read from their JSON.
#pragma once

#include <nlohmann/json.hpp>

#include "apps/selvedge/closed_environment.h"

namespace selvedge {

/// Throws the Failure JSON_MALFORMED: a member that is missing, of another form or out of range, which is the
/// place; or none ("").
[[noreturn]] void malformed(const char* place, const char* message);

/// `evaluate`. Other members are ignored. Throws Failure.
FabricQuery query_from(const nlohmann::json& line);

/// `environment`, with view and axis turned into the fabric's frame. Throws Failure.
EnvironmentQuery environment_query_from(const nlohmann::json& line);

}  // namespace selvedge
