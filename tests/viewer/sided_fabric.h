// Fabrics with all four sides, for the viewer's tests.
#pragma once

#include "format/fabric/fabric.h"

namespace selvedge::test {

/// The fabrics make(0) ... make(3) as front and other sides, with light through the yarn, if there is any.
template <class Make>
Fabric sided_fabric(const Make& make) {
  Fabric fabric = make(0);
  if (const auto yarns = fabric.levels.front().yarns()) {
    YarnData data = yarns->data();
    data.light_through = data.station_light;
    for (std::size_t i = 0; i < data.light_through.size(); ++i)
      data.light_through[i] = 0.02F * static_cast<float>(i % 7) - 0.01F;
    fabric.levels.front().set_yarns(std::make_shared<const Yarns>(std::move(data), fabric.period_mm));
  }
  for (const Side side : other_sides) {
    Fabric other = make(static_cast<int>(index_of(side)));
    other.side = side;
    other.levels.front().set_yarns(nullptr);
    fabric.add_side(std::move(other));
  }
  return fabric;
}

}  // namespace selvedge::test
