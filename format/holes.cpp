#include "format/holes.h"

#include "format/evaluate.h"

namespace selvedge {

bool has_holes(const Fabric& fabric, int level) {
  const FabricLevel& of = fabric.levels[static_cast<std::size_t>(level)];
  const V3f up(0, 0, 1);
  int open = 0;
  double openness = 0;
  for (int y = 0; y < of.height; ++y) {
    for (int x = 0; x < of.width; ++x) {
      const float alpha = evaluate(fabric, level, x, y, up, up).alpha;
      if (alpha < 0.5F) ++open;
      openness += 1 - static_cast<double>(alpha);
    }
  }
  if (first_level(fabric) > 0) return openness > 0.0005 * of.texels();
  return open * 1000 > of.texels();
}

}  // namespace selvedge
