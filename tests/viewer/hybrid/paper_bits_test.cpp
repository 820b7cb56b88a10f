// The published path: colours of 8 bits in the index pass.
#include <doctest/doctest.h>

#include <cmath>

#include "tests/format/fabrics.h"
#include "tests/viewer/indexed.h"
#include "tests/viewer/small_frames.h"

namespace selvedge {
namespace {

/// Whether a number is a whole one but for rounding.
bool is_whole(float x) { return std::abs(x - std::round(x)) < 2e-3F; }

TEST_CASE(
    "in the paper's bits directions have 255 steps, levels 25.5 in one, and texels lie under each other") {
  Scene scene;
  test::add(scene, test::sphere(48, 24, V2d(9, 5)), test::material(0));
  const std::vector<Fabric> fabrics{test::random_fabric(12, 10, 6)};
  const Camera camera = test::camera_for(scene, test::small({}));
  const test::Indexed exact = test::index_nearest(scene, fabrics, camera, 120, 100, {});
  const test::Indexed coded = test::index_nearest(scene, fabrics, camera, 120, 100, {}, 0, 0, true);
  REQUIRE(coded.blocks.size() == exact.blocks.size());
  int blended = 0;
  int moved = 0;
  for (std::size_t i = 0; i < coded.blocks.size(); ++i) {
    const PixelBlock& a = exact.blocks[i];
    const PixelBlock& b = coded.blocks[i];
    for (std::size_t lane = 0; lane < b.count; ++lane) {
      for (const auto& [before, after] :
           {std::pair(a.normal.x[lane], b.normal.x[lane]), std::pair(a.normal.z[lane], b.normal.z[lane]),
            std::pair(a.tangent.y[lane], b.tangent.y[lane])}) {
        CHECK(std::abs(before - after) < 1.001F / 255);
        CHECK(is_whole((after + 1) * 127.5F));
      }
      if (b.texel_count < 2 || !(b.texels[0].weight[lane] > 0 && b.texels[1].weight[lane] > 0)) continue;
      ++blended;
      const auto& [finer, coarser] = std::tie(b.texels[0], b.texels[1]);
      REQUIRE(coarser.level[lane] == finer.level[lane] + 1);
      CHECK(is_whole((static_cast<float>(finer.level[lane]) + coarser.weight[lane]) * 25.5F));
      const PackedLevel& fine = coded.packed[0].levels[finer.level[lane]];
      const PackedLevel& coarse = coded.packed[0].levels[coarser.level[lane]];
      const int x = (2 * (finer.texel[lane] % fine.width) + 1) * coarse.width / (2 * fine.width);
      const int y = (2 * (finer.texel[lane] / fine.width) + 1) * coarse.height / (2 * fine.height);
      CHECK(coarser.texel[lane] == y * coarse.width + x);
      moved += a.texel_count == 2 && a.texels[0].level[lane] == finer.level[lane] &&
               a.texels[0].texel[lane] != finer.texel[lane];
    }
  }
  CHECK(blended > 50);
  CHECK(moved == 0);
}

TEST_CASE(
    "the paper's bits hold 256 texels a side of the paper's layers, and a fabric's yarn is drawn as texels") {
  Scene scene;
  test::add(scene, test::square(1), test::material(0));
  RenderOptions options = test::small({test::from_the_side});
  options.path = RenderPath::paper;
  const Camera camera = test::camera_for(scene, options);
  const auto draw = [&](const Fabric& fabric) { return render(scene, {fabric}, camera, options); };
  CHECK(draw(test::random_fabric(256, 2, 1)).has_value());
  const Fabric wide = test::random_fabric(257, 2, 1);
  const Fabric products = test::random_product_fabric(4, 4, {3, 3}, 1, 5);
  for (const Fabric& fabric : {wide, products})
    CHECK(test::error_of(draw(fabric)).code == Code::option_out_of_range);
}

}  // namespace
}  // namespace selvedge
