#include "format/fabric/holes.h"

#include "format/fabric/evaluate.h"

namespace selvedge {

bool has_holes(const Fabric& fabric, int level) {
  const FabricLevel& of = fabric.levels[level];
  const V3f up(0, 0, 1);
  double openness = 0;
  for (int y = 0; y < of.height; ++y) {
    for (int x = 0; x < of.width; ++x) {
      openness += 1 - static_cast<double>(evaluate(fabric, level, x, y, up, up).alpha);
    }
  }
  return openness > 0.0005 * of.texels();
}

}  // namespace selvedge
