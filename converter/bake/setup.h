// Preparations of a bake before its first ray: checks of options, scene, header.
#pragma once

#include "converter/bake/bake.h"
#include "converter/light/ray_scene.h"
#include "converter/mesh/cell_mesh.h"

namespace selvedge {

/// A cell scaled so that its longer period lies in [1, 2) units: single precision then suits every size.
struct TracedCell {
  RayScene scene;
  double mm_per_unit = 1;  ///< per unit of the scene; a power of two, so that nothing is rounded
  double thickness_mm() const { return static_cast<double>(scene.bounds().max.z) * mm_per_unit; }
};
/// Refuses a mesh that validate() refuses.
Result<TracedCell> trace_cell(const CellMesh& mesh, const std::string& name);

/// Height of the texels' plane above the lowest point of a cell, in thicknesses of the cell: there a texel
/// keeps to the same piece of yarn from all views.
inline constexpr double plane_height_fraction = 0.9;

/// The seed of item `index` of an independent stream of random numbers.
std::uint64_t seed_of(std::uint64_t seed, std::uint64_t stream, std::uint64_t index);

Result<void> check_options(const BakeOptions& options, const std::string& name);

/// XXH3-128 of all that light depends on.
std::string digest_of(const CellMesh& mesh);
std::string digest_of(const YarnCell& cell);

/// The header without the noise, which is known only after the bake. `cell`: with the yarn that is stored, if
/// any, and the thickness. `digest`: of all that light depends on.
SamplesHeader samples_header(const YarnCell& cell, const std::string& digest, const BakeOptions& options,
                             double plane_mm, const std::string& provenance);

}  // namespace selvedge
