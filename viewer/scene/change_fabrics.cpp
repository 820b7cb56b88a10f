#include "viewer/scene/change_fabrics.h"

#include <cmath>

namespace selvedge {

std::vector<int> fabrics_of(const Scene& scene) {
  std::vector<int> result;
  for (const SceneMaterial& material : scene.materials)
    result.push_back(material.fabric ? material.fabric->fabric : -1);
  return result;
}

Scene change_fabrics(const Scene& scene, std::span<const Fabric> fabrics, std::span<const int> choice) {
  Scene result = scene;
  for (std::size_t i = 0; i < result.materials.size(); ++i) {
    std::optional<FabricReference>& reference = result.materials[i].fabric;
    if (!reference || reference->fabric == choice[i]) continue;
    if (choice[i] < 0) {
      reference.reset();
      continue;
    }
    const V2d old_period(fabrics[reference->fabric].period_mm);
    const V2d new_period(fabrics[choice[i]].period_mm);
    V2d ratio = old_period / new_period;
    if (reference->transform.rotation != 0) ratio = V2d(std::sqrt(ratio.x * ratio.y));
    reference->transform.offset *= ratio;
    reference->transform.scale *= ratio;
    reference->fabric = choice[i];
  }
  return result;
}

}  // namespace selvedge
