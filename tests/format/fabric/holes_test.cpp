#include "format/fabric/evaluate.h"

#include <doctest/doctest.h>

#include "tests/format/fabrics.h"

namespace selvedge {
namespace {

/// 32 x 32 texels, `open` of them a hole, and coarser levels with the mean opacity of their children.
Fabric with_holes(int open) {
  Fabric fabric = test::lambert_fabric(32, 32, V3f(0.5F));
  fabric.period_mm = {5, 5};
  for (std::size_t k = 0; k < fabric.levels.size(); ++k) {
    FabricLevel& level = fabric.levels[k];
    level.add_layer(LayerKind::opacity, 1, k == 0 ? 1.0F : 0.0F);
    for (int y = 0; k > 0 && y < level.height; ++y) {
      for (int x = 0; x < level.width; ++x) {
        const FabricLevel& finer = fabric.levels[k - 1];
        float sum = 0;
        for (const int at : {0, 1, finer.width, finer.width + 1})
          sum += finer.opacity()[2 * y * finer.width + 2 * x + at];
        level.opacity()[y * level.width + x] = sum / 4;
      }
    }
    if (k == 0) std::fill_n(level.opacity().begin(), open, 0.0F);
  }
  return fabric;
}

}  // namespace

TEST_CASE("all levels of a fabric have holes, or none has") {
  for (const int open : {0, 1, 2, 40, 1024}) {
    CAPTURE(open);
    const Fabric fabric = with_holes(open);
    for (int level = 0; level < static_cast<int>(fabric.levels.size()); ++level) {
      CAPTURE(level);
      CHECK(has_holes(fabric, level) == (open > 0));  // one of 1,024 is more than 0.05 %
    }
  }
}

TEST_CASE("what is open by less than one part in two thousand is closed") {
  Fabric fabric = with_holes(0);
  fabric.levels[0].opacity()[7] = 0.6F;  // 0.04 %
  CHECK_FALSE(has_holes(fabric, 0));
  fabric.levels[0].opacity()[8] = 0.8F;  // 0.06 %
  CHECK(has_holes(fabric, 0));
}

}  // namespace selvedge
