#include "format/fabric/directions.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "format/base/random.h"

namespace selvedge {
namespace {

using std::numbers::pi;

V3f random_direction(Random& random, double z_min) {
  const double z = z_min + (1 - z_min) * random.uniform();
  const double phi = 2 * pi * random.uniform();
  const double planar = std::sqrt(std::max(0.0, 1 - z * z));
  return V3f(V3d(planar * std::cos(phi), planar * std::sin(phi), z));
}

}  // namespace

DirectionGrid nearly_square_grid(int count) {
  int columns = std::max(1, static_cast<int>(std::sqrt(static_cast<double>(std::max(1, count)))));
  while (columns > 1 && count % columns != 0) --columns;
  return {columns, std::max(1, count) / columns};
}

V2d square_to_disc_polar(const V2d& square) {
  const double a = 2 * square.x - 1;
  const double b = 2 * square.y - 1;
  if (std::abs(a) > std::abs(b)) return {a, (pi / 4) * (b / a)};
  return {b, b != 0 ? pi / 2 - (pi / 4) * (a / b) : 0};
}

V3d square_to_hemisphere(const V2d& square) {
  const V2d disc = square_to_disc_polar(square);
  const double r = disc.x;
  const double phi = disc.y;
  // Lift of the disc: solid angle 2 pi (1 - z) is proportional to the disc's area pi r^2.
  const double lift = std::sqrt(std::max(0.0, 2 - r * r));
  return {r * std::cos(phi) * lift, r * std::sin(phi) * lift, std::max(0.0, 1 - r * r)};
}

V2d hemisphere_to_square(const V3d& direction) {
  const double planar = std::hypot(direction.x, direction.y);
  if (planar == 0) return {0.5, 0.5};
  // r = sqrt(1 - z) without cancellation near the pole.
  const double z = std::clamp(direction.z, 0.0, 1.0);
  const double length = std::hypot(planar, z);
  const double sine = planar / length;
  const double r = sine / std::sqrt(1 + z / length);
  double phi = std::atan2(direction.y, direction.x);
  if (phi < -pi / 4) phi += 2 * pi;
  double a = 0;
  double b = 0;
  if (phi < pi / 4) {
    a = r;
    b = phi * a / (pi / 4);
  } else if (phi < 3 * pi / 4) {
    b = r;
    a = -(phi - pi / 2) * b / (pi / 4);
  } else if (phi < 5 * pi / 4) {
    a = -r;
    b = (phi - pi) * a / (pi / 4);
  } else {
    b = -r;
    a = -(phi - 3 * pi / 2) * b / (pi / 4);
  }
  return {std::clamp((a + 1) / 2, 0.0, 1.0), std::clamp((b + 1) / 2, 0.0, 1.0)};
}

V3f cell_direction(const DirectionGrid& grid, int cell) {
  const int column = cell % grid.columns;
  const int row = cell / grid.columns;
  return V3f(square_to_hemisphere({(column + 0.5) / grid.columns, (row + 0.5) / grid.rows}));
}

std::vector<V3f> cell_directions(const DirectionGrid& grid) {
  std::vector<V3f> directions;
  directions.reserve(grid.count());
  for (int cell = 0; cell < grid.count(); ++cell) directions.push_back(cell_direction(grid, cell));
  return directions;
}

DirectionTaps interpolate(const DirectionGrid& grid, const V3f& direction) {
  return interpolate(grid, hemisphere_to_square(V3d(direction)));
}

DirectionTaps interpolate(const DirectionGrid& grid, const V2d& square) {
  const double column = std::clamp(square.x * grid.columns - 0.5, 0.0, grid.columns - 1.0);
  const double row = std::clamp(square.y * grid.rows - 0.5, 0.0, grid.rows - 1.0);
  const int c0 = static_cast<int>(column);
  const int r0 = static_cast<int>(row);
  const int c1 = std::min(c0 + 1, grid.columns - 1);
  const int r1 = std::min(r0 + 1, grid.rows - 1);
  const auto fc = static_cast<float>(column - c0);
  const auto fr = static_cast<float>(row - r0);
  return {{r0 * grid.columns + c0, r0 * grid.columns + c1, r1 * grid.columns + c0, r1 * grid.columns + c1},
          {(1 - fc) * (1 - fr), fc * (1 - fr), (1 - fc) * fr, fc * fr}};
}

std::vector<DirectionPair> random_direction_pairs(int count, double z_min, std::uint64_t seed) {
  std::vector<DirectionPair> pairs;
  for (int i = 0; i < count; ++i) {
    Random random(seed, i);
    const V3f light = random_direction(random, z_min);
    pairs.push_back({light, random_direction(random, z_min)});
  }
  return pairs;
}

}  // namespace selvedge
