// The machine that figures of time were measured on.
#pragma once

#include <string>

namespace selvedge {

struct Machine {
  std::string processor;  ///< model, or "unknown"
  int cores = 0;          ///< that programs can use at once
};

Machine this_machine();

}  // namespace selvedge
