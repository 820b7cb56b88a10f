// The yarn itself, drawn by the shader path and by the hybrid path, on Mesa's software rasteriser.
#include "format/fabric/yarns.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "format/scene/swatch.h"
#include "tests/require.h"
#include "tests/viewer/shapes.h"
#include "viewer/render.h"

namespace selvedge {
namespace {

/// Waves along x and, half a wave higher, along y; glossy, twisted, and lit by other yarn at random.
YarnData waves(float period, int curves, bool strands) {
  // As close as fabrics: flat sections change from segment to segment, and the hybrid path does not
  // look for such edges in a pixel.
  constexpr int nodes = 48;
  YarnData data;
  Random random(3);
  for (int c = 0; c < curves; ++c) {
    YarnCurve curve;
    curve.nodes = nodes;
    curve.stations = 3;
    curve.turns = c % 2 == 0 ? V2i(1, 0) : V2i(0, 1);
    curve.radius = 0.08F * period;
    curve.albedo = {0.7F, 0.5F, 0.3F};
    curve.gloss = {0.2F, 0.4F};
    curve.fibre_slope = 0.5F;
    if (c % 2 == 1) curve.flattening = 0.6F;  // one round and one of plies
    if (c >= 2) curve.plies = {c, 3, 2 * c + 1, 0.5F, {-0.5F, 0.25F, 0.75F}};
    // Three quarters have strands: wide and thin ones, one as of yarn turned over.
    if (strands && c % 4 > 0)
      curve.strands = {c % 4 == 1 ? 9 : c % 4 == 2 ? -16 : 400, 5, 22, 7 * c, 0.1F, 3};
    data.curves.push_back(curve);
    const float side = (static_cast<float>(c / 2) + 0.5F) / static_cast<float>((curves + 1) / 2);
    for (int i = 0; i < nodes; ++i) {
      const float along = static_cast<float>(i) / nodes;
      const float wave = std::sin(2 * std::numbers::pi_v<float> * (along + 0.5F * side)) * 0.1F;
      const V3f node(along, side + wave, c % 2 == 0 ? 0.2F + wave : 0.2F - wave);
      data.nodes.push_back((c % 2 == 0 ? node : V3f(node.y, node.x, node.z)) * period);
    }
    for (int i = 0; i < curve.stations * light_values_per_station; ++i)
      data.light.push_back(static_cast<float>(0.02 * random.uniform()));
  }
  return data;
}

/// No yarn if there are no curves.
Fabric fabric_of(float period, int curves, bool strands = false) {
  Fabric fabric = test::random_fabric(2, 2, 5);
  fabric.period_mm = {period, period};
  fabric.reference_height = 0.2F * period;
  if (curves > 0)
    fabric.levels.front().set_yarns(
        std::make_shared<const Yarns>(waves(period, curves, strands), fabric.period_mm));
  return fabric;
}

Frame drawn(const Fabric& fabric, const SwatchShot& shot, RenderPath path, const LevelOptions& levels) {
  RenderOptions options;
  options.path = path;
  options.context = ContextKind::osmesa;
  options.width = shot.width;
  options.height = shot.height;
  options.layers = 1;
  options.levels = levels;
  options.lights = shot.lights;
  return test::need(render(swatch_scene(V2d(fabric.period_mm), shot), {fabric}, shot.camera, options));
}

/// The share of pixels that differ by more than 1/255 of the peak.
double share_apart(const Frame& a, const Frame& b) {
  float peak = 0;
  for (const V4f& p : a.pixels) peak = std::max({peak, p.x, p.y, p.z});
  REQUIRE(peak > 0);
  int apart = 0;
  for (std::size_t i = 0; i < a.pixels.size(); ++i) {
    const V4f d = a.pixels[i] - b.pixels[i];
    const float worst = std::max({std::abs(d.x), std::abs(d.y), std::abs(d.z), std::abs(d.w) * peak});
    apart += worst <= peak / 255 ? 0 : 1;
  }
  return apart / static_cast<double>(a.pixels.size());
}

/// Hybrid and shader beside each other. `without`: the shader's picture has to differ from the picture of
/// this fabric.
double share_apart(const Fabric& fabric, SwatchView view, const LevelOptions& levels,
                   const Fabric* without = nullptr) {
  const SwatchShot shot = swatch_shot(view, V2d(fabric.period_mm), 96, 72);
  const Frame shader = drawn(fabric, shot, RenderPath::shader, levels);
  if (without != nullptr) CHECK(share_apart(shader, drawn(*without, shot, RenderPath::shader, levels)) > 0.5);
  const double share = share_apart(drawn(fabric, shot, RenderPath::hybrid, levels), shader);
  MESSAGE(name_of(view), ": ", share);
  return share;
}

/// Of points at edges of yarns and shadows, rounding takes either side.
constexpr double at_edges = 0.002;

}  // namespace

TEST_CASE("hybrid and shader show the same yarn from every place, and where it blends with texels") {
  const Fabric fabric = fabric_of(3, 4);
  const Fabric texels = fabric_of(3, 0);
  for (const SwatchView view : {SwatchView::near, SwatchView::middle, SwatchView::grazing})
    CHECK(share_apart(fabric, view, {}, &texels) <= at_edges);
  CHECK(share_apart(fabric, SwatchView::far, {}) <= at_edges);
  LevelOptions levels;
  levels.bias = 4;
  CHECK(share_apart(fabric, SwatchView::near, levels) <= at_edges);
  levels.blend = false;
  levels.points = 3;
  CHECK(share_apart(fabric, SwatchView::middle, levels) <= at_edges);
}

TEST_CASE("hybrid and shader show the same strands, wide and thin") {
  // Where a pixel's corners look alike, the hybrid path does not look for the edge of a strand between them.
  const double at_strands = 0.01;
  const Fabric fabric = fabric_of(3, 4, true);
  const Fabric smooth = fabric_of(3, 4);
  for (const SwatchView view : {SwatchView::near, SwatchView::middle, SwatchView::grazing})
    CHECK(share_apart(fabric, view, {}) <= at_strands);
  const SwatchShot shot = swatch_shot(SwatchView::near, V2d(fabric.period_mm), 96, 72);
  CHECK(share_apart(drawn(fabric, shot, RenderPath::shader, {}),
                    drawn(smooth, shot, RenderPath::shader, {})) > 0.3);
}

TEST_CASE("hybrid and shader agree on one yarn, on no yarn and on repeats of 0.01 mm and 10 m") {
  CHECK(share_apart(fabric_of(3, 1), SwatchView::near, {}) <= at_edges);
  CHECK(share_apart(fabric_of(3, 0), SwatchView::near, {}) <= at_edges);
  for (const float period : {0.01F, 10000.0F}) {
    CHECK(share_apart(fabric_of(period, 4), SwatchView::near, {}) <= at_edges);
    CHECK(share_apart(fabric_of(period, 4), SwatchView::grazing, {}) <= at_edges);
  }
}

}  // namespace selvedge
