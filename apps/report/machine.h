// The machine that figures of time were measured on.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

namespace selvedge {

struct Machine {
  std::string processor;  ///< model, or "unknown"
  int cores = 0;          ///< that programs can use at once
};

Machine this_machine();

/// `processor`, `cores` and `threads` (thread_count()), as reports have them.
nlohmann::ordered_json machine_json();

}  // namespace selvedge
