#include "samples/subdivide.h"

#include <doctest/doctest.h>

#include <cmath>

namespace selvedge::samples {
namespace {

/// `columns` x `rows` unit squares in the plane z = 0, labelled by their column.
QuadSurface grid(int columns, int rows) {
  QuadSurface surface;
  for (int y = 0; y <= rows; ++y) {
    for (int x = 0; x <= columns; ++x) surface.positions.emplace_back(x, y, 0);
  }
  const auto at = [&](int x, int y) { return y * (columns + 1) + x; };
  for (int y = 0; y < rows; ++y) {
    for (int x = 0; x < columns; ++x) {
      surface.quads.push_back({at(x, y), at(x + 1, y), at(x + 1, y + 1), at(x, y + 1)});
      surface.labels.push_back(x);
    }
  }
  return surface;
}

/// A cube of side 2 around the origin.
QuadSurface cube() {
  QuadSurface surface;
  for (int i = 0; i < 8; ++i) surface.positions.emplace_back(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1);
  surface.quads = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
  surface.labels = {0, 1, 2, 3, 4, 5};
  return surface;
}

TEST_CASE("every quad becomes four with the label of its parent") {
  const QuadSurface fine = subdivide(grid(3, 2), 2);
  REQUIRE(fine.quads.size() == 3 * 2 * 16);
  REQUIRE(fine.labels.size() == fine.quads.size());
  for (std::size_t q = 0; q < fine.quads.size(); ++q) {
    V3d middle(0, 0, 0);
    for (const int v : fine.quads[q]) middle += fine.positions[v] / 4;
    // Flat, evenly spaced: the columns keep their place, but for the outermost, whose corners are rounded.
    CHECK(std::abs(middle.x - (fine.labels[q] + 0.5)) < 0.5);
    CHECK(middle.z == 0);
  }
}

TEST_CASE("a cube's corner moves to where Catmull and Clark put it") {
  const QuadSurface fine = subdivide(cube(), 1);
  CHECK(fine.positions.size() == 8 + 12 + 6);
  // Valence 3: (Q + 2 R + 0 S) / 3 with Q = 1/3 (face points' mean), R = 2/3 (edge middles' mean): 5/9.
  for (int axis = 0; axis < 3; ++axis) CHECK(fine.positions[7][axis] == doctest::Approx(5.0 / 9));
}

TEST_CASE("no level of subdivision changes nothing") {
  const QuadSurface surface = grid(2, 2);
  const QuadSurface same = subdivide(surface, 0);
  CHECK(same.positions == surface.positions);
  CHECK(same.quads == surface.quads);
}

}  // namespace
}  // namespace selvedge::samples
