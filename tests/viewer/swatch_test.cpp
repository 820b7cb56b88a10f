#include "viewer/swatch.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#include "format/fabric/evaluate.h"
#include "format/scene/swatch.h"
#include "tests/require.h"
#include "tests/viewer/paths.h"
#include "tests/viewer/rays.h"
#include "tests/viewer/shapes.h"
#include "viewer/renderer.h"

namespace selvedge {
namespace {

Result<Frame> render_swatch(const Fabric& fabric, const SwatchOptions& swatch_options,
                            RenderOptions options) {
  const Swatch swatch = test::need(make_swatch(fabric, swatch_options));
  options.width = swatch.width;
  options.height = swatch.height;
  options.levels.forced_level = swatch_options.level;
  options.layers = 1;
  return render(swatch.scene, {fabric}, swatch.camera, options);
}

/// Radiance times opacity, and opacity, of a texel; by_size: the mean of the texels of the finer level that
/// lie within it.
V4f texel_of(const Fabric& fabric, int level, bool by_size, const V2i& at, const V3f& light,
             const V3f& view) {
  const int parts = by_size && level > 0 ? 2 : 1;
  V4f sum(0, 0, 0, 0);
  for (int i = 0; i < parts * parts; ++i) {
    const Shading s =
        evaluate(fabric, level - parts + 1, parts * at.x + i % parts, parts * at.y + i / parts, light, view);
    sum += V4f(s.radiance.x * s.alpha, s.radiance.y * s.alpha, s.radiance.z * s.alpha, s.alpha);
  }
  return sum / static_cast<float>(parts * parts);
}

/// Largest difference between a swatch of one pixel per texel and the reference, relative to the peak.
double difference(const Fabric& fabric, int level, const V2i& repeats, const V3d& view, const V3d& light,
                  int swatch_level) {
  SwatchOptions swatch;
  swatch.repeats = repeats;
  swatch.level = swatch_level;
  swatch.view = view;
  if (swatch_level < 0) swatch.pixels_per_texel = std::pow(0.5, level);
  RenderOptions options;
  options.lights = {{light.normalized(), V3f(1, 1, 1)}};
  const Frame frame = test::need(render_swatch(fabric, swatch, options));
  const FabricLevel& stored = fabric.levels[level];
  REQUIRE(frame.width == stored.width * repeats.x);
  REQUIRE(frame.height == stored.height * repeats.y);
  double peak = 0;
  double worst = 0;
  for (int y = 0; y < frame.height; ++y) {
    for (int x = 0; x < frame.width; ++x) {
      const V4f expected = texel_of(fabric, level, swatch_level < 0, V2i(x % stored.width, y % stored.height),
                                    V3f(light.normalized()), V3f(view.normalized()));
      const V4f& pixel = frame.pixels[y * frame.width + x];
      for (int c = 0; c < 3; ++c) {
        const auto value = static_cast<double>(expected[c]);
        peak = std::max(peak, value);
        worst = std::max(worst, std::abs(value - pixel[static_cast<unsigned>(c)]));
      }
      worst = std::max(worst, static_cast<double>(std::abs(expected.w - pixel.w)) * peak);
    }
  }
  REQUIRE(peak > 0);
  return worst / peak;
}

// Texels of cell images have 11 bits of mantissa.
constexpr double rounding = 0x1p-11;

TEST_CASE("a swatch of one pixel per texel equals the reference evaluation on every level") {
  for (const V2i& size : {V2i(8, 8), V2i(5, 3), V2i(16, 4), V2i(1, 1), V2i(33, 20)}) {
    const Fabric fabric = test::random_fabric(size.x, size.y, 7);
    for (std::size_t level = 0; level < fabric.levels.size(); ++level) {
      CAPTURE(level);
      const int k = static_cast<int>(level);
      CHECK(difference(fabric, k, {2, 1}, V3d(0.2, 0.4, 0.8), V3d(-0.3, 0.6, 0.7), k) < rounding);
    }
  }
}

TEST_CASE("a pixel of 2^k texels is the mean of four texels of the level below k") {
  const Fabric fabric = test::random_fabric(32, 32, 3);
  for (int k = 0; k < 5; ++k) {
    CAPTURE(k);
    CHECK(difference(fabric, k, {4, 4}, V3d(0.3, -0.5, 0.7), V3d(0, 0.3, 1), -1) < rounding);
  }
}

TEST_CASE("a swatch refuses what cannot be shown") {
  const Fabric fabric = test::random_fabric(4, 4, 1);
  const auto code_of = [&](const SwatchOptions& options) {
    return test::error_of(make_swatch(fabric, options)).code;
  };
  SwatchOptions options;
  options.view = V3d(1, 0, 0);
  CHECK(code_of(options) == Code::option_out_of_range);
  options = {};
  options.level = 3;
  CHECK(code_of(options) == Code::option_out_of_range);
  options = {};
  options.pixels_per_texel = 1e9;
  CHECK(code_of(options) == Code::option_out_of_range);
}

TEST_CASE("a swatch from a place looks as the reference evaluation's picture of it") {
  for (const V2i& size : {V2i(16, 16), V2i(12, 20)}) {
    Fabric fabric = test::random_fabric(size.x, size.y, 3);
    fabric.period_mm = V2f(4, 5);
    for (const SwatchView view : all_swatch_views) {
      CAPTURE(name_of(view));
      const double db = test::swatch_decibels(fabric, swatch_shot(view, V2d(fabric.period_mm), 64, 48), -1);
      MESSAGE(name_of(view), ": ", db, " dB");
      // At a grazing angle pixels lie across the texels' rows.
      CHECK(db > (view == SwatchView::grazing ? 22 : 30));
    }
  }
}

}  // namespace
}  // namespace selvedge
