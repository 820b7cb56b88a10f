// A fabric as a file: the multi-part OpenEXR of spec/fabric.md.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "format/fabric.h"

namespace selvedge {

struct FabricWriteOptions {
  bool half_lobes = false;    ///< under a large exponent half precision ruins a lobe: 32 bits by default
  bool float_tables = false;  ///< view table, opacity and frames in 32 bits instead of 16
};

/// Writes atomically. Same fabric and options, same bytes. Refuses an invalid fabric and values that do not
/// fit into the chosen precision.
Result<void> write_fabric(const std::string& path, const Fabric& fabric,
                          const FabricWriteOptions& options = {});

/// Reads all levels and layers, verifies every digest and validates every value.
Result<Fabric> read_fabric(const std::string& path, const FabricLimits& limits = {});
Result<Fabric> read_fabric(std::span<const std::uint8_t> bytes, const std::string& name,
                           const FabricLimits& limits = {});

/// The JSON text of the file's attribute, for `info`; checked for being a fabric's, nothing decoded.
Result<std::string> read_fabric_header(const std::string& path);

}  // namespace selvedge
