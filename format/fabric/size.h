// Sizes of fabric files, counted without writing them.
#pragma once

#include "format/fabric/file.h"

namespace selvedge {

/// Size of the file that write_fabric() makes. Refuses an invalid fabric, but not values beyond the
/// precision.
Result<std::uint64_t> fabric_file_bytes(const Fabric& fabric, const FabricWriteOptions& options = {});

}  // namespace selvedge
