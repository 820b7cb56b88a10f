// Changes the fabrics of a garment.
#pragma once

#include <span>
#include <vector>

#include "format/fabric/fabric.h"
#include "format/scene/scene.h"

namespace selvedge {

/// For each material, its fabric; -1 where it has none.
std::vector<int> fabrics_of(const Scene& scene);
/// Whether no material has a fabric.
bool has_no_fabric(const Scene& scene);

/// `scene` with fabric choice[i] (index into `fabrics`) on material i; -1 takes the fabric away. Materials
/// without a fabric keep none, as they lack its texture transform. The yarns keep their size on the cloth:
/// the texture transform is scaled by old period / new period (by the geometric mean of both sides' ratios
/// where it rotates). Scene::fabrics is left alone. Preconditions: choice.size() == materials; the indices
/// exist.
Scene change_fabrics(const Scene& scene, std::span<const Fabric> fabrics, std::span<const int> choice);

/// How a fabric lies on a material, relative to what the file says.
struct FabricFit {
  double stitch_scale = 1;  ///< factor on the stitches' size
  int quarter_turns = 0;
  V3f tint{1, 1, 1};  ///< linear; times GarmentTextures::tint
};

/// Fits the fabrics of `scene`; fits[i]: of material i. Stitches stay as wide and as high as they are
/// through a quarter turn. Precondition: Scene's references are indices into `fabrics`.
void fit_fabrics(std::span<const FabricFit> fits, std::span<const Fabric> fabrics, Scene& scene);

/// Puts on a variant of the file: an index into Scene::variants. GLTF_ACCESSOR for a material that is not
/// there.
Result<void> wear_variant(int variant, Scene& scene);

/// Whether two scenes with the same primitives look alike but for factors on the light of their fabrics.
bool differ_by_tints(const Scene& a, const Scene& b);

}  // namespace selvedge
