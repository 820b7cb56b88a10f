#include "viewer/raster/raster.h"

#include <doctest/doctest.h>

#include <numeric>

#include "format/base/random.h"

namespace selvedge {

TEST_CASE(
    "a mesh without cracks covers each pixel once, also where vertices and edges lie on pixels' centres") {
  constexpr int width = 70;
  constexpr int height = 50;
  constexpr int cells = 12;
  for (const bool exact : {true, false}) {
    Random random(exact ? 1 : 2);
    MergedSurfaces mesh;
    ProjectedVertices projected{width, height, {}, {}};
    for (int j = 0; j <= cells; ++j) {
      for (int i = 0; i <= cells; ++i) {
        // Around the whole frame, each vertex near its place (no triangle turns over), at its own depth.
        const auto near = [&](int k, int size) {
          const double step = (size + 20.0) / cells;
          const double at = -10 + step * (k + 0.2 * (2 * random.uniform() - 1));
          return exact ? std::round(at) + 0.5 : at;
        };
        const double x = near(i, width);
        const double y = near(j, height);
        const double w = exact ? 1 : 0.5 + random.uniform();
        projected.screen.push_back({static_cast<float>((x - width / 2.0) * w),
                                    static_cast<float>((y - height / 2.0) * w), static_cast<float>(w), 0});
        projected.clip.emplace_back(0.0F, 0.0F, static_cast<float>(w * (random.uniform() - 0.5)),
                                    static_cast<float>(w));
      }
    }
    const auto add = [&](int a, int b, int c) {
      const auto corner = [](int k) { return static_cast<std::uint32_t>(k); };
      mesh.triangles.push_back({{corner(a), corner(b), corner(c)}, 0, 1});
    };
    for (int j = 0; j < cells; ++j) {
      for (int i = 0; i < cells; ++i) {
        const int at = j * (cells + 1) + i;
        add(at, at + 1, at + cells + 2);
        add(at, at + cells + 2, at + cells + 1);
      }
    }
    std::vector<std::uint32_t> list(mesh.triangles.size());
    std::iota(list.begin(), list.end(), 0U);
    constexpr int first_row = 6;
    constexpr int rows = 41;
    Raster raster;
    raster.begin(mesh, projected, list, false, first_row, rows);
    RasterRows drawn;
    for (int strip = 0; strip * Raster::strip_rows < rows; ++strip) {
      raster.draw(strip, drawn);
      std::vector<std::uint32_t> pixels;
      int wrong = 0;
      for (int y = strip * Raster::strip_rows; y < std::min(rows, (strip + 1) * Raster::strip_rows); ++y) {
        for (int x = 0; x < width; ++x) {
          const std::size_t at = (y - strip * Raster::strip_rows) * drawn.stride + x;
          wrong += drawn.count[at] != 1 || !(drawn.depth[at] > 0 && drawn.depth[at] < 1) ? 1 : 0;
          if (x % 3 == 0) pixels.push_back(static_cast<std::uint32_t>(y * width + x));
        }
      }
      CHECK(wrong == 0);
      std::vector<DeepHit> hits;
      raster.find_hits(strip, pixels, hits);
      REQUIRE(hits.size() == pixels.size());
      for (const DeepHit& hit : hits) {
        const int y = static_cast<int>(hit.pixel) / width - strip * Raster::strip_rows;
        const std::size_t at = y * drawn.stride + hit.pixel % width;
        CHECK(pixels[hit.deep_pixel] == hit.pixel);
        CHECK(static_cast<std::int32_t>(hit.surface) == drawn.surface[at]);
        CHECK(hit.depth == doctest::Approx(drawn.depth[at]).epsilon(1e-5));
      }
    }
  }
}

}  // namespace selvedge
