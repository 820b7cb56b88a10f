// Preparations of a bake before its first ray: checks of options, scene, header.
#pragma once

#include "converter/bake/bake.h"

namespace selvedge {

/// A cell scaled so that its longer period lies in [1, 2) units: single precision then suits every size.
struct TracedCell {
  RayScene scene;
  double mm = 1;  ///< per unit of the scene; a power of two, so that nothing is rounded
  double thickness_mm() const { return static_cast<double>(scene.bounds().max.z) * mm; }
};
/// `ground` as in BakeOptions. Refuses a mesh that validate() refuses.
Result<TracedCell> trace_cell(const CellMesh& mesh, const std::string& name, std::optional<double> ground);

/// Height of the reference plane above the lowest point of `mesh`, mm; `cell` is made of `mesh`.
Result<double> plane_of(const CellMesh& mesh, const TracedCell& cell, const std::string& name,
                        const BakeOptions& options);

/// The seed of item `index` of an independent stream of random numbers.
std::uint64_t seed_of(std::uint64_t seed, std::uint64_t stream, std::uint64_t index);

Result<void> check_options(const BakeOptions& options, const std::string& name);

/// XXH3-128 of all members of the mesh that light depends on.
std::string digest_of(const CellMesh& mesh);

/// The header without the noise, which is known only after the bake. `plane_mm`, `thickness_mm`: mm.
SamplesHeader samples_header(const CellMesh& mesh, const BakeOptions& options, double plane_mm,
                             double thickness_mm, const std::string& provenance);

}  // namespace selvedge
