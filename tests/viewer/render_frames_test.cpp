// Frames as such: supersampling, bands, extreme sizes, refusals.
#include <doctest/doctest.h>

#include <cmath>

#include "tests/require.h"
#include "tests/viewer/small_frames.h"

namespace selvedge {
namespace {

using test::camera_for;
using test::from_the_side;
using test::middle;
using test::render_or_fail;
using test::small;

TEST_CASE("supersampling converges to the same picture and smooths the outline") {
  Scene scene;
  test::add(scene, test::sphere(64, 32, V2d(1, 1)), test::material(-1));
  RenderOptions options = small({from_the_side});
  const Camera camera = camera_for(scene, options);
  const Frame rough = render_or_fail(scene, {}, camera, options);
  options.supersample = 3;
  const Frame smooth = render_or_fail(scene, {}, camera, options);
  int partial = 0;
  double rough_area = 0;
  double smooth_area = 0;
  for (std::size_t i = 0; i < smooth.pixels.size(); ++i) {
    if (smooth.pixels[i].w > 0 && smooth.pixels[i].w < 1) ++partial;
    rough_area += rough.pixels[i].w;
    smooth_area += smooth.pixels[i].w;
  }
  CHECK(partial > 50);
  CHECK(smooth_area == doctest::Approx(rough_area).epsilon(0.01));
  const V4f d = middle(rough) - middle(smooth);
  CHECK(std::sqrt(d.dot(d)) < 0.01);
}

TEST_CASE("frames that need several bands have no seams") {
  Scene scene;
  test::add(scene, test::sphere(64, 32, V2d(1, 1)), test::material(-1));
  RenderOptions options;
  // More than the 2^21 pixels of a band.
  options.width = 16;
  options.height = 16;
  options.supersample = 1;
  options.lights = {from_the_side};
  const Camera camera = camera_for(scene, options);
  options.width = options.height = 1600;
  RenderStats stats;
  const Frame large = render_or_fail(scene, {}, camera, options, &stats);
  double steepest = 0;
  for (int y = 400; y < 1200; ++y) {
    for (const int x : {700, 800, 900}) {
      const std::size_t i = static_cast<std::size_t>(y * 1600 + x);
      steepest = std::max<double>(steepest, std::abs(large.pixels[i].x - large.pixels[i + 1600].x));
    }
  }
  // The sphere's radiance changes by at most 3 / pi over some 700 pixels.
  CHECK(steepest < 0.005);
}

TEST_CASE("render refuses with a code") {
  Scene scene;
  test::add(scene, test::square(1), test::material(0));
  const RenderOptions good = small({});
  const Camera camera = camera_for(scene, good);
  const std::vector<Fabric> fabrics{test::random_fabric(4, 4, 1)};
  const auto code_of = [&](const Scene& s, const std::vector<Fabric>& f, const RenderOptions& o) {
    return test::error_of(render(s, f, camera, o)).code;
  };
  CHECK(code_of(Scene{}, {}, good) == Code::garment_empty);
  RenderOptions options = good;
  options.width = 0;
  CHECK(code_of(scene, fabrics, options) == Code::option_out_of_range);
  options = good;
  options.supersample = 1000;
  CHECK(code_of(scene, fabrics, options) == Code::option_out_of_range);
  options = good;
  options.layers = 0;
  CHECK(code_of(scene, fabrics, options) == Code::option_out_of_range);
  scene.primitives[0].tex_coords[0].clear();
  CHECK(code_of(scene, fabrics, good) == Code::garment_no_uvs);
}

}  // namespace
}  // namespace selvedge
