#include "format/fabric/directions.h"

#include <doctest/doctest.h>

#include <cmath>

using namespace selvedge;

TEST_CASE("the square and the hemisphere are each other's inverse") {
  for (int i = 0; i <= 40; ++i) {
    for (int j = 0; j <= 40; ++j) {
      const V2d square(i / 40.0, j / 40.0);
      const V3d direction = square_to_hemisphere(square);
      CHECK(direction.length() == doctest::Approx(1).epsilon(1e-12));
      const V2d back = hemisphere_to_square(direction);
      // sqrt(1 - z) at the pole costs half of the digits.
      CHECK(std::abs(back.x - square.x) < 1e-7);
      CHECK(std::abs(back.y - square.y) < 1e-7);
    }
  }
}

TEST_CASE("cells of the grid have equal solid angle") {
  // Closed form: integral of z over the hemisphere is pi, of 1 is 2 pi; a fine equal-area grid has
  // mean z = 1/2 and mean z^2 = 1/3 with an error of the midpoint rule.
  const std::vector<V3f> directions = cell_directions({128, 128});
  double z = 0;
  double z2 = 0;
  V3d sum(0, 0, 0);
  for (const V3f& d : directions) {
    z += d.z;
    z2 += static_cast<double>(d.z) * d.z;
    sum += V3d(d);
  }
  const auto n = static_cast<double>(directions.size());
  CHECK(z / n == doctest::Approx(0.5).epsilon(1e-3));
  CHECK(z2 / n == doctest::Approx(1.0 / 3).epsilon(1e-3));
  CHECK(std::abs(sum.x / n) < 1e-6);
  CHECK(std::abs(sum.y / n) < 1e-6);
}

TEST_CASE("interpolation at a cell's own direction takes that cell alone") {
  for (const DirectionGrid grid :
       {DirectionGrid{8, 8}, DirectionGrid{8, 16}, DirectionGrid{1, 7}, DirectionGrid{1, 1}}) {
    for (int cell = 0; cell < grid.count(); ++cell) {
      const DirectionTaps taps = interpolate(grid, cell_direction(grid, cell));
      float own = 0;
      float sum = 0;
      for (std::size_t t = 0; t < 4; ++t) {
        sum += taps.weight[t];
        if (taps.cell[t] == cell) own += taps.weight[t];
      }
      CHECK(sum == doctest::Approx(1));
      CHECK(own == doctest::Approx(1).epsilon(1e-5));
    }
  }
}

TEST_CASE("interpolation holds its values at the rim and below the horizon") {
  const DirectionGrid grid{8, 8};
  const DirectionTaps rim = interpolate(grid, V3f(1, 0, 0));
  const DirectionTaps below = interpolate(grid, V3f(1, 0, -0.5F).normalized());
  for (std::size_t t = 0; t < 4; ++t) {
    CHECK(rim.cell[t] == below.cell[t]);
    CHECK(rim.weight[t] == below.weight[t]);
    CHECK(rim.cell[t] >= 0);
    CHECK(rim.cell[t] < 64);
  }
}

TEST_CASE("a grid of a count is the most nearly square one") {
  CHECK(nearly_square_grid(64) == DirectionGrid{8, 8});
  CHECK(nearly_square_grid(128) == DirectionGrid{8, 16});
  CHECK(nearly_square_grid(32) == DirectionGrid{4, 8});
  CHECK(nearly_square_grid(7) == DirectionGrid{1, 7});
  CHECK(nearly_square_grid(1) == DirectionGrid{1, 1});
}

TEST_CASE("random pairs are uniform in solid angle above their limit") {
  const int count = 20000;
  const auto pairs = random_direction_pairs(count, 0.15, 7);
  double mean = 0;
  for (const DirectionPair& pair : pairs) {
    CHECK(pair.light.z >= 0.15F);
    CHECK(pair.view.z >= 0.15F);
    mean += pair.light.z / static_cast<double>(count);
  }
  // z is uniform on [0.15, 1]: mean 0.575, standard error 0.85/sqrt(12 count) = 0.0017; bound: 5 of them.
  CHECK(std::abs(mean - 0.575) < 5 * 0.85 / std::sqrt(12.0 * count));
}
