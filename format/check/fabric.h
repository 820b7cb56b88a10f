// The checker of fabric files: it lists all broken rules; a reader stops at the first.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "format/base/error.h"
#include "format/fabric/fabric.h"

namespace selvedge {

/// Decodes every chunk of every level and reports every rule of spec/fabric.md that the file breaks, errors
/// and warnings. Empty: a good file. Places are JSON pointers into the attribute text, or
/// "part/level N/channel/x,y".
Issues check_fabric(const std::string& path, const FabricLimits& limits = {});
Issues check_fabric(std::span<const std::uint8_t> bytes, const std::string& name,
                    const FabricLimits& limits = {});

}  // namespace selvedge
