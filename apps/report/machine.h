// The machine that figures of time were measured on.
#pragma once

#include <nlohmann/json_fwd.hpp>

namespace selvedge {

/// `processor` (its model, or "unknown"), `cores` that programs can use at once, and `threads`
/// (thread_count()).
nlohmann::ordered_json machine_json();

}  // namespace selvedge
