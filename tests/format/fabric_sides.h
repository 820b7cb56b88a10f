// A fabric with all sides, for the tests.
#pragma once

#include "tests/format/fabrics.h"
#include "tests/format/yarn_data.h"

namespace selvedge::test {

/// All four cases of sides, with grids, bases and scales of their own, and yarn that lets light through.
inline Fabric four_sides() {
  Fabric fabric = with_yarn(random_product_fabric(6, 4, {2, 3}, 2, 8), 3);
  YarnData data = fabric.levels.front().yarns()->data();
  Random random(5);
  for (auto* light : {&data.station_light, &data.light_through}) {
    light->resize(data.station_light.size());
    for (float& value : *light) value = std::round(uniform(random, -8, 8)) / 64;
  }
  fabric.levels.front().set_yarns(std::make_shared<const Yarns>(data, fabric.period_mm));
  for (const Side side : other_sides) {
    Fabric other =
        side == Side::back
            ? random_fabric(6, 4, {3, 3}, 1, 9)
            : random_product_fabric(6, 4, side == Side::through ? DirectionGrid{2, 3} : DirectionGrid{3, 3},
                                    1, 9 + index_of(side));
    other.side = side;
    other.radiance_scale = 0.5F;
    other.provenance = "{}";
    fabric.add_side(std::move(other));
  }
  return fabric;
}

}  // namespace selvedge::test
