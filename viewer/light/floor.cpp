#include "viewer/light/floor.h"

#include <Imath/ImathBox.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "format/base/parallel.h"
#include "format/scene/camera.h"

namespace selvedge {
namespace {

constexpr int side = Floor::grid_size;
constexpr double around = 2;  ///< width of the grid, in widths of the scene
constexpr double sky = 0.6;   ///< fraction of an even sky in the light

/// Height over the floor of the scene's lower side, [z][x]; infinite beside it.
std::vector<float> lower_side(const MergedSurfaces& mesh, const Floor& floor) {
  std::vector<float> heights(side * side, std::numeric_limits<float>::infinity());
  const double cells = side / floor.width;
  constexpr int max_points = 1 << 26;  // of all triangles; of those after them the corners
  int points = 0;
  for (const MergedTriangle& triangle : mesh.triangles) {
    const V3d a(mesh.positions[triangle.corners[0]]);
    const V3d b = V3d(mesh.positions[triangle.corners[1]]) - a;
    const V3d c = V3d(mesh.positions[triangle.corners[2]]) - a;
    const double longest = std::max({b.length(), c.length(), (c - b).length()});
    const int steps =
        points > max_points ? 1 : std::clamp(static_cast<int>(2 * longest * cells) + 1, 1, 2 * side);
    points += steps * steps / 2;
    for (int i = 0; i <= steps; ++i) {
      for (int j = 0; j <= steps - i; ++j) {
        const V3d p = a + b * (static_cast<double>(i) / steps) + c * (static_cast<double>(j) / steps);
        const int x = static_cast<int>((p.x - floor.centre.x) * cells + side / 2.0);
        const int z = static_cast<int>((p.z - floor.centre.y) * cells + side / 2.0);
        float& height = heights[std::clamp(z, 0, side - 1) * side + std::clamp(x, 0, side - 1)];
        height = std::min(height, static_cast<float>(p.y - floor.height));
      }
    }
  }
  return heights;
}

}  // namespace

float Floor::hidden_fraction_at(double x, double z) const {
  const double cells = side / width;
  const double u = (x - centre.x) * cells + side / 2.0 - 0.5;
  const double v = (z - centre.y) * cells + side / 2.0 - 0.5;
  if (!(u > 0 && v > 0 && u < side - 1 && v < side - 1)) return 0;
  const int i = static_cast<int>(u);
  const int j = static_cast<int>(v);
  const auto s = static_cast<float>(u - i);
  const float* row = &hidden_fraction[j * side + i];
  const float near = row[0] + (row[1] - row[0]) * s;
  const float far = row[side] + (row[side + 1] - row[side]) * s;
  return near + (far - near) * static_cast<float>(v - j);
}

Floor find_floor(const MergedSurfaces& mesh) {
  Imath::Box3f box;
  for (const V3f& p : mesh.positions) box.extendBy(p);
  if (box.isEmpty()) return {};
  Floor floor;
  floor.height = box.min.y;
  floor.centre = {box.center().x, box.center().z};
  floor.width = std::max(around * static_cast<double>(std::max(box.size().x, box.size().z)), 1e-9);
  floor.hidden_fraction.resize(side * side);
  const std::vector<float> heights = lower_side(mesh, floor);
  parallel_for(0, side, [&](int z) {
    std::array<float, side> sums{};
    for (int k = 0; k < side * side; ++k) {
      if (!std::isfinite(heights[k])) continue;
      // In cells. Closer than 1.5, one would not do for the integral, and edges would show the grid.
      const float h = std::clamp(heights[k] * static_cast<float>(side / floor.width), 1.5F, 1e6F);
      const int aside = k / side - z;
      for (int x = 0; x < side; ++x) {
        const auto apart = static_cast<float>(k % side - x);
        const float r2 = apart * apart + static_cast<float>(aside * aside) + h * h;
        sums[x] += h * h / (r2 * r2);
      }
    }
    for (int x = 0; x < side; ++x) {
      const double off = std::max(std::abs(2 * x + 1 - side), std::abs(2 * z + 1 - side)) / (side - 1.0);
      floor.hidden_fraction[z * side + x] = static_cast<float>(
          sky * std::min(sums[x] / std::numbers::pi, 1.0) * std::clamp(4 * (1 - off), 0.0, 1.0));
    }
  });
  return floor;
}

void add_floor(const Floor& floor, const Camera& camera, const V3d& origin, Frame& frame) {
  const ViewDirections rays = view_directions(camera, frame.width, frame.height);
  const bool parallel = camera.projection == Projection::parallel;
  parallel_for(0, frame.height, [&](int y) {
    for (int x = 0; x < frame.width; ++x) {
      V4f& pixel = frame.pixels[static_cast<std::size_t>(y) * frame.width + x];
      if (pixel.w >= 1) continue;
      const double right = x + 0.5 - 0.5 * frame.width;
      const double up = 0.5 * frame.height - y - 0.5;
      V3d from = camera.position - origin;
      if (parallel)
        from +=
            camera.right * (camera.window_centre.x + 2 * camera.window_half_size.x * right / frame.width) +
            camera.up * (camera.window_centre.y + 2 * camera.window_half_size.y * up / frame.height);
      const V3d away = -(V3d(rays.centre_direction) + V3d(rays.step_right) * right + V3d(rays.step_up) * up);
      const double drop = from.y - floor.height;
      if (!(away.y < 0) || !(parallel || drop > 0)) continue;
      const V3d place = from + away * (drop / -away.y);
      pixel.w += (1 - pixel.w) * floor.hidden_fraction_at(place.x, place.z);
    }
  });
}

}  // namespace selvedge
