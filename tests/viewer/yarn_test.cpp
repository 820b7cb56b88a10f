#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#include "format/picture/swatch_picture.h"
#include "tests/format/fabrics.h"
#include "tests/format/yarn_data.h"
#include "tests/require.h"
#include "tests/viewer/sided_fabric.h"
#include "viewer/render.h"

using namespace selvedge;
using namespace selvedge::test;

namespace {

Fabric yarn_fabric(int texels) {
  Fabric fabric = random_fabric(texels, texels, {4, 4}, 1, 5);
  Random random(11);
  YarnData data = plied(tangle(random, fabric.period_mm, 5));
  for (YarnCurve& curve : data.curves) curve.gloss = {0.3F, 0.4F};
  fabric.levels.front().set_yarns(std::make_shared<const Yarns>(std::move(data), fabric.period_mm));
  return fabric;
}

/// Share of pixels that differ by more than a step of 8 bits.
double share_of_different(const Frame& a, const Frame& b) {
  int count = 0;
  for (std::size_t i = 0; i < a.pixels.size(); ++i) {
    float worst = 0;
    for (unsigned c = 0; c < 4; ++c) worst = std::max(worst, std::abs(a.pixels[i][c] - b.pixels[i][c]));
    count += worst > 1.0F / 255 ? 1 : 0;
  }
  return static_cast<double>(count) / static_cast<double>(a.pixels.size());
}

}  // namespace

TEST_CASE("the hybrid path draws yarn, its blend with level 0 and light from behind as the reference does") {
  for (const int texels : {1, 16}) {
    for (const bool sided : {false, true}) {
      const Fabric fabric =
          sided ? sided_fabric([&](int) { return yarn_fabric(texels); }) : yarn_fabric(texels);
      for (const SwatchView view : all_swatch_views) {
        CAPTURE(texels);
        CAPTURE(sided);
        CAPTURE(name_of(view));
        SwatchShot shot = swatch_shot(view, V2d(fabric.period_mm), 80, 60);
        if (sided) shot.lights = {{V3d(0.3, 0.4, -0.866), V3f(2, 1, 1)}, shot.lights.front()};
        RenderOptions options;
        options.width = shot.width;
        options.height = shot.height;
        options.lights = shot.lights;
        options.levels = best_levels;
        const Frame frame =
            need(render(swatch_scene(V2d(fabric.period_mm), shot), {fabric}, shot.camera, options));
        // Points that fall on the other side of an edge of yarn by the rounding of coordinates.
        CHECK(share_of_different(frame, draw_swatch(fabric, shot, best_levels)) < 0.01);
      }
    }
  }
}
