// What a bake is going to do, decided before the first ray.
#pragma once

#include "converter/bake/bake.h"

namespace selvedge {

/// A mesh whose longer period lies in [1, 2): so no size is too small or too large for single precision.
struct ScaledMesh {
  CellMesh mesh;
  double mm = 1;  ///< per unit of the mesh; a power of two, so that nothing is rounded
};
ScaledMesh scaled_to_unit(const CellMesh& mesh);

/// Height of the texels' plane above the lowest point of `mesh`, mm; `scene` is that mesh in units of `mm`.
Result<double> plane_of(const CellMesh& mesh, const RayScene& scene, const std::string& name,
                        const BakeOptions& options, double mm);

Result<void> check_options(const BakeOptions& options, const std::string& name);

/// XXH3-128 of everything of the mesh that light depends on.
std::string digest_of(const CellMesh& mesh);

/// Everything but the noise, which is known afterwards. `plane_mm`, `thickness_mm`: mm.
SamplesHeader header_of(const CellMesh& mesh, const BakeOptions& options, double plane_mm,
                        double thickness_mm, const std::string& provenance);

/// Views first, then the pairs of each kind, then the heights: what can be baked by itself.
struct BakeUnit {
  enum class What { view, pair, heights };
  What what = What::view;
  PairKind kind = PairKind::validation;
  std::size_t index = 0;  ///< of the view, or of the pair in its kind
  bool is_view() const { return what == What::view; }
};
std::vector<BakeUnit> units_of(const SamplesHeader& header);

}  // namespace selvedge
