#include "converter/bake/slab_heights.h"

#include "format/base/parallel.h"

namespace selvedge {
namespace {

struct Interval {
  double top = 0;
  double bottom = 0;
};

/// The yarns that a vertical line at (x, y) passes through, from the uppermost on.
std::vector<Interval> intervals_at(const RayScene& scene, double x, double y, std::size_t max_count) {
  const double height = static_cast<double>(scene.bounds().max.z);
  const double step = 1e-5 * height;  // moves the ray past a surface that it met
  constexpr int max_surfaces = 256;
  std::vector<Interval> found;
  int depth = 0;
  double start_z = height * 1.01 + step;
  for (int i = 0; i < max_surfaces; ++i) {
    SurfacePoint point;
    if (!scene.trace(V3d(x, y, start_z), V3d(0, 0, -1), point) || scene.is_ground(point)) break;
    const double z = static_cast<double>(point.position.z);
    if (depth == 0) {
      if (found.size() == max_count) break;
      found.push_back({z, z - height / 50});
      depth = 1;
    } else {
      depth += point.back ? -1 : 1;
      if (depth == 0) found.back().bottom = z;
    }
    start_z = z - step;
  }
  return found;
}

}  // namespace

HeightLayer cell_heights(const RayScene& scene, int width, int height, const SlabShape& shape) {
  constexpr int lines = 3;  // per side of a column
  const V2d period = scene.period();
  const std::size_t entries = shape.entries();
  const std::size_t slabs = shape.slabs;
  const std::size_t values = width * height * entries;
  std::vector<float> top(values, 0);
  std::vector<float> bottom(values, 0);
  parallel_for(0, height * shape.rows, [&](int row) {
    for (int column = 0; column < width * shape.columns; ++column) {
      std::vector<Interval> sum(slabs);
      std::vector<int> count(slabs, 0);
      for (int line = 0; line < lines * lines; ++line) {
        const double u = (column + (line % lines + 0.5) / lines) / (width * shape.columns);
        const int below = line / lines;
        const double v = (row + (below + 0.5) / lines) / (height * shape.rows);
        const auto met = intervals_at(scene, u * period.x, (1 - v) * period.y, slabs);
        for (std::size_t s = 0; s < met.size(); ++s) {
          sum[s].top += met[s].top;
          sum[s].bottom += met[s].bottom;
          ++count[s];
        }
      }
      const int texel = row / shape.rows * width + column / shape.columns;
      const int cell = row % shape.rows * shape.columns + column % shape.columns;
      for (std::size_t s = 0; s < slabs; ++s) {
        if (2 * count[s] < lines * lines) continue;
        const std::size_t entry = s * shape.columns * shape.rows + cell;
        const std::size_t index = texel * entries + entry;
        top[index] = static_cast<float>(sum[s].top / count[s]);
        bottom[index] = static_cast<float>(sum[s].bottom / count[s]);
      }
    }
  });
  return {shape, std::move(top), std::move(bottom)};
}

}  // namespace selvedge
