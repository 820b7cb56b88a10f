#include "converter/bake/truth_swatch.h"

#include <doctest/doctest.h>

#include <cmath>
#include <numbers>

#include "converter/stitch/find_cell.h"
#include "tests/converter/bake_cells.h"
#include "tests/converter/load_cell.h"
#include "tests/format/files.h"
#include "tests/require.h"

using namespace selvedge;
using namespace selvedge::test;

namespace {

constexpr double pi = std::numbers::pi;

Light light_from(const V3f& direction, const V3f& irradiance) {
  return {.direction = V3d(direction).normalized(), .irradiance = irradiance};
}

/// One repeat as a parallel camera sees it whose image plane is the cloth: pixels are texels.
SwatchShot texels_of(const CellMesh& mesh, int width, int height, const V3f& view, const V3f& light) {
  SwatchShot shot;
  const V2d size = mesh.period / 1000.0;
  shot.camera.projection = Projection::parallel;
  shot.camera.position = V3d(size.x / 2, size.y / 2, 0);
  shot.camera.to_viewer = V3d(view).normalized();
  shot.camera.window_half_size = size / 2;
  shot.width = width;
  shot.height = height;
  shot.lights = {light_from(light, V3f(1, 1, 1))};
  return shot;
}

TruthSwatch traced(const CellMesh& mesh, const SwatchShot& shot, const TruthOptions& options) {
  return test::need(trace_swatch(mesh, "test", shot, options));
}

}  // namespace

TEST_CASE("a traced Lambert sheet is albedo / pi times the cosine times the light, from every place") {
  const CellMesh mesh = floor_of(5, 1, 0.6F);
  for (const SwatchView view : all_swatch_views) {
    SwatchShot shot = swatch_shot(view, mesh.period, 12, 9);
    shot.lights = {light_from({0.3F, -0.4F, 0.8F}, V3f(2, 1, 1)), light_from({0, 0, 1}, V3f(0.5F, 0, 0))};
    TruthOptions options{.samples = 4};
    const TruthSwatch swatch = traced(mesh, shot, options);
    const double cosine = shot.lights[0].direction.z;
    for (const V4f& pixel : swatch.frame.pixels) {
      // Rounded to single precision on the way.
      CHECK(static_cast<double>(pixel.x) == doctest::Approx(0.6 / pi * (2 * cosine + 0.5)).epsilon(1e-6));
      CHECK(static_cast<double>(pixel.y) == doctest::Approx(0.3 / pi * cosine).epsilon(1e-6));
      CHECK(pixel.w == 1);
    }
    CHECK(swatch.noise < 1e-7);
    CHECK(swatch.alpha_noise == 0);
  }
}

TEST_CASE("what is not yarn in a traced swatch is a hole, and its fraction the opacity") {
  // The left half is a floor: 6 of 12 columns of one repeat.
  const CellMesh mesh = floor_of(2, 0.5F, 0.8F);
  const TruthSwatch swatch = traced(mesh, texels_of(mesh, 12, 4, V3f(0, 0, 1), V3f(0, 0, 1)), TruthOptions());
  for (int y = 0; y < 4; ++y) {
    for (int x = 0; x < 12; ++x) {
      const V4f& pixel = swatch.frame.pixels[12 * y + x];
      CHECK(pixel.w == (x < 6 ? 1 : 0));
      CHECK(static_cast<double>(pixel.x) == doctest::Approx(x < 6 ? 0.8 / pi : 0).epsilon(1e-6));
    }
  }
}

TEST_CASE("a traced swatch of one repeat is what the bake sees, texel by texel") {
  const auto mesh = test::need(load_cell("plain-knit"));
  constexpr int width = 8;
  constexpr int height = 6;
  BakeOptions bake_options{.width = width,
                           .height = height,
                           .views = 1,
                           .lights = 1,
                           .samples = 2,
                           .bounces = 3,
                           .truth_samples = 256};
  const std::vector<DirectionPair> pairs{
      {V3f(V3d(0.2, 0.3, 0.9).normalized()), V3f(0, 0, 1)},
      {V3f(V3d(-0.6, 0.1, 0.7).normalized()), V3f(V3d(0.7, -0.4, 0.4).normalized())}};
  bake_options.pairs = ByPairKind<std::vector<DirectionPair>>{};
  (*bake_options.pairs)[static_cast<std::size_t>(PairKind::held_out)] = pairs;
  const Baked baked = test::need(bake(mesh, "test", bake_options));
  const PairSamples& truth = baked.samples.pairs[index_of(PairKind::held_out)];
  for (std::size_t p = 0; p < pairs.size(); ++p) {
    TruthOptions options{.samples = 256, .bounces = 3};
    const TruthSwatch swatch =
        traced(mesh, texels_of(mesh, width, height, pairs[p].view, pairs[p].light), options);
    double squared = 0;
    double expected = 0;
    double mean = 0;
    double mean_expected = 0;
    for (std::size_t i = 0; i < swatch.frame.pixels.size(); ++i) {
      const std::size_t at = p * swatch.frame.pixels.size() + i;
      const V4f& pixel = swatch.frame.pixels[i];
      const V3d seen(truth.radiance[at] * truth.alpha[at]);
      squared += (V3d(V3f(pixel.x, pixel.y, pixel.z)) - seen).length2();
      expected += V3d(truth.noise[at]).length2();
      mean += static_cast<double>(pixel.x);
      mean_expected += seen.x;
    }
    const double count = 3.0 * width * height;
    const double own = std::sqrt(expected / count);
    CAPTURE(own);
    CAPTURE(swatch.noise);
    // Both are estimates of the same mean: they differ by both errors together. 144 values: 30 % more or
    // less is 5 standard deviations.
    const double rms = std::sqrt(squared / count);
    const double both = std::hypot(own, swatch.noise);
    CHECK(rms < 1.3 * both);
    // The mean over the cell: 48 independent errors.
    CHECK(std::abs(mean - mean_expected) / 48 < 5 * both / std::sqrt(48.0));
  }
}

TEST_CASE("the noise of a traced swatch is its distance from one with many rays") {
  const auto mesh = test::need(load_cell("plain-weave"));
  const SwatchShot shot = swatch_shot(SwatchView::middle, mesh.period, 24, 18);
  TruthOptions few{.samples = 16};
  TruthOptions many{.samples = 1024, .seed = 2};
  const TruthSwatch a = traced(mesh, shot, few);
  const TruthSwatch b = traced(mesh, shot, many);
  double squared = 0;
  for (std::size_t i = 0; i < a.frame.pixels.size(); ++i) {
    const V4f d = a.frame.pixels[i] - b.frame.pixels[i];
    squared += static_cast<double>(d.x * d.x + d.y * d.y + d.z * d.z);
  }
  const double rms = std::sqrt(squared / (3.0 * 24 * 18));
  // 1,296 values whose colours go together: a few per cent either way.
  CHECK(rms > 0.85 * a.noise);
  CHECK(rms < 1.15 * std::hypot(a.noise, b.noise));
}

TEST_CASE("a light that stands somewhere is refused by the traced swatch") {
  const CellMesh mesh = floor_of(1, 1, 0.5F);
  SwatchShot shot = swatch_shot(SwatchView::near, mesh.period, 4, 3);
  shot.lights[0].kind = LightKind::point;
  CHECK(test::error_of(trace_swatch(mesh, "test", shot)).code == Code::option_out_of_range);
}
