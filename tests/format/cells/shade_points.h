// Points of yarn shaded as images have them, for tests against Yarns.
#pragma once

#include <vector>

#include "format/cells/cell_shading.h"
#include "format/fabric/lifted.h"

namespace selvedge::test {

struct CellPoint {
  std::int32_t piece = 0;
  V3f from_start{0, 0, 0};
};

/// Radiance that leaves points of the yarn towards the viewer, without shadows within the cell.
inline std::vector<V3f> shade_points(const CellYarn& yarn, const YarnPieces& pieces, const CellView& view,
                                     std::span<const CellPoint> points) {
  std::vector<FrontLamp> lamps;
  for (const CellLamp& lamp : view.lamps)
    if (lamp.direction.z > 0)
      lamps.push_back({.raised_direction = clamp_rise(lamp.direction),
                       .irradiance = lamp.irradiance,
                       .horizon_fade = std::min(1.0F, lamp.direction.z / min_ray_rise)});
  std::vector<Group> table;
  const std::vector<LightSlot> slots = light_slots(yarn, view);
  fill_station_table(yarn, view, nullptr, table);
  const ShadingJob job{yarn, pieces, view, lamps, slots, table, 0};
  std::vector<V3f> result;
  for (std::size_t first = 0; first < points.size(); first += ShadingBatch::capacity) {
    ShadingBatch batch{};
    std::vector<Group> raw(ShadingBatch::capacity, Group{});
    batch.count = std::min(ShadingBatch::capacity, points.size() - first);
    for (std::size_t i = 0; i < batch.count; ++i) {
      const CellPoint& point = points[first + i];
      batch.piece[i] = point.piece;
      batch.texel[i] = static_cast<std::uint32_t>(i);
      batch.x[i] = point.from_start.x;
      batch.y[i] = point.from_start.y;
      batch.z[i] = point.from_start.z;
    }
    shade(job, batch, raw.data());
    for (std::size_t i = 0; i < batch.count; ++i) result.emplace_back(raw[i][0], raw[i][1], raw[i][2]);
  }
  return result;
}

}  // namespace selvedge::test
