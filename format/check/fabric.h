// The checker of fabric files: the reader (FabricReader), which continues after an error.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "format/base/error.h"
#include "format/fabric/fabric.h"

namespace selvedge {

struct CheckedFabric {
  Issues issues;                 ///< empty: a good file
  std::optional<Fabric> fabric;  ///< unless there are errors
};

/// Places are JSON pointers into the attribute text, or "part/level N/channel/x,y".
CheckedFabric check_fabric(const std::string& path, const FabricLimits& limits = {});
CheckedFabric check_fabric(std::span<const std::uint8_t> bytes, const std::string& name,
                           const FabricLimits& limits = {});

}  // namespace selvedge
