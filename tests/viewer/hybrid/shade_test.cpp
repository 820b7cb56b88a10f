// The published path: colours of 8 bits in the index pass.
#include "viewer/hybrid/shade.h"

#include <doctest/doctest.h>

#include <cmath>

#include "tests/format/fabrics.h"
#include "tests/viewer/frame_scene.h"
#include "tests/viewer/small_frames.h"

namespace selvedge {
namespace {

TEST_CASE("in the paper's bits directions have 255 steps, and levels 25.5 in one") {
  const auto is_whole = [](float x) { return std::abs(x - std::round(x)) < 2e-3F; };
  Scene scene;
  test::add(scene, test::sphere(48, 24, V2d(9, 5)), test::material(0));
  const std::vector<Fabric> fabrics{test::random_fabric(12, 10, 6)};
  const test::FrameOf frame(scene, fabrics, test::camera_for(scene, test::small({})), {120, 100});
  int blended = 0;
  frame.each_pixel(3, [&](TriangleSide seen, int x, int y) {
    const GarmentPoint point = garment_point(frame.scene(), seen, x, y);
    const V3f rounded = round_to_paper_bits(point.normal);
    for (int axis = 0; axis < 3; ++axis) {
      CHECK(std::abs(rounded[axis] - point.normal[axis]) < 1.001F / 255);
      CHECK(is_whole((rounded[axis] + 1) * 127.5F));
    }
    const PaperTexels texels = paper_texels(fabrics[0], point, -1);
    if (texels.coarser_weight > 0 && texels.coarser_weight < 1) {
      ++blended;
      CHECK(is_whole((static_cast<float>(texels.finer_level) + texels.coarser_weight) * 25.5F));
    }
    const FabricLevel& level = fabrics[0].levels[texels.finer_level];
    CHECK(is_whole(texels.uv.x * static_cast<float>(level.width) - 0.5F));
    CHECK(std::abs(texels.uv.x - point.uv.x) < 0.5001F / static_cast<float>(level.width));
  });
  CHECK(blended > 20);
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
