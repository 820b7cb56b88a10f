// PLY files, read by ourselves: OpenMesh 9 crashes on some damaged headers, and it misreads lists whose
// length is not a byte.
#pragma once

#include <string>

#include "converter/mesh/openmesh.h"

namespace selvedge {

/// Reads ASCII and binary PLY of both byte orders with any numeric types: x, y, z, nx, ny, nz, red, green,
/// blue (also r, g, b and diffuse_*) of element "vertex", the colours and the list vertex_indices (or
/// vertex_index) of element "face"; everything else is passed over. Colours of integer type are divided by
/// the type's largest value and count as sRGB-coded. Refuses headers that it cannot follow and bodies that
/// end early (file_damaged).
Result<RawMesh> import_ply(const std::string& bytes, const std::string& file);

}  // namespace selvedge
