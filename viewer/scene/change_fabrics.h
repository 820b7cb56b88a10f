// Changes the fabrics of a garment.
#pragma once

#include <span>
#include <vector>

#include "format/fabric/fabric.h"
#include "format/scene/scene.h"

namespace selvedge {

/// For each material, its fabric; -1 where it has none.
std::vector<int> fabrics_of(const Scene& scene);

/// `scene` with fabric choice[i] (index into `fabrics`) on material i; -1 takes the fabric away. Materials
/// without a fabric keep none, as they lack its texture transform. The yarns keep their size on the cloth:
/// the texture transform is scaled by old period / new period (by the geometric mean of both sides' ratios
/// where it rotates). Scene::fabrics is left alone. Preconditions: choice.size() == materials; the indices
/// exist.
Scene change_fabrics(const Scene& scene, std::span<const Fabric> fabrics, std::span<const int> choice);

}  // namespace selvedge
