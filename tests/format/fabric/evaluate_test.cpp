#include "format/fabric/evaluate.h"

#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "format/fabric/lafortune.h"
#include "tests/format/fabrics.h"

using namespace selvedge;

TEST_CASE("a Lambert texel gives albedo / pi times the light's cosine, from everywhere") {
  const Fabric fabric = test::lambert_fabric(4, 4, {0.2F, 0.5F, 0.8F});
  for (const DirectionPair& pair : random_pairs(100, 0.01, 1)) {
    const Shading s = evaluate(fabric, 0, 1, 2, pair.light, pair.view);
    CHECK(s.alpha == 1);
    CHECK(s.radiance.y == doctest::Approx(0.5 / std::numbers::pi * static_cast<double>(pair.light.z)));
  }
}

TEST_CASE("light and view below the cloth give nothing") {
  const Fabric fabric = test::lambert_fabric(1, 1, {1, 1, 1});
  const V3f up(0, 0, 1);
  const V3f below = V3f(0.6F, 0, -0.8F);
  CHECK(evaluate(fabric, 0, 0, 0, below, up).radiance == V3f(0, 0, 0));
  CHECK(evaluate(fabric, 0, 0, 0, up, below).radiance == V3f(0, 0, 0));
}

TEST_CASE("at a stored view the table's own entry is taken, times the lobes in the texel's frame") {
  const Fabric fabric = test::random_fabric(4, 4, {4, 4}, 2, 9);
  const FabricLevel& level = fabric.levels[0];
  const V3f light = V3f(0.3F, -0.2F, 0.9F).normalized();
  for (int texel = 0; texel < 16; ++texel) {
    const auto t = static_cast<std::size_t>(texel);
    for (int v = 0; v < 16; ++v) {
      const V3f view = direction_of(fabric.views, v);
      const std::size_t entry = t * 16 + static_cast<std::size_t>(v);
      const Shading s = evaluate(fabric, 0, texel % 4, texel / 4, light, view);
      CHECK(s.alpha == doctest::Approx(level.opacity()[entry]).epsilon(1e-4));
      if (level.opacity()[entry] == 0) continue;
      // Equations (1) and (2), written out with the frame's three axes.
      const V3d n(level.frame()[t].normal);
      const V3d x(level.frame()[t].tangent);
      const V3d y = n.cross(x);
      const V3d l(V3d(light).dot(x), V3d(light).dot(y), V3d(light).dot(n));
      const V3d e(V3d(view).dot(x), V3d(view).dot(y), V3d(view).dot(n));
      for (int c = 0; c < 3; ++c) {
        const float* p = &level.lobes()[(t * 3 + static_cast<std::size_t>(c)) * 9];
        double sum = p[0];
        for (int j = 0; j < 2; ++j) {
          const float* q = p + 1 + 4 * j;
          const double base = q[0] * l.x * e.x + q[1] * l.y * e.y + q[2] * l.z * e.z;
          if (base > 0) sum += std::pow(base, static_cast<double>(q[3]));
        }
        const double expected = level.view_table()[entry][c] * sum * std::max(0.0, l.z);
        // The neighbours' weights at a cell's own direction are rounding only (1e-6 of the square).
        CHECK(s.radiance[c] == doctest::Approx(expected).epsilon(1e-4).scale(0.01));
      }
    }
  }
}

TEST_CASE("the colour of a hole takes no part in the interpolation of the table") {
  Fabric fabric = test::lambert_fabric(1, 1, {1, 1, 1});
  fabric.views = {2, 1};
  FabricLevel& level = fabric.levels[0];
  level.set(LayerKind::opacity, {2, {1, 0}});
  level.set(LayerKind::table, {6, {1, 1, 1, 9, 9, 9}});
  // Half way between the two cells.
  const Shading s = evaluate(fabric, 0, 0, 0, {0, 0, 1}, {0, 0, 1});
  CHECK(s.alpha == doctest::Approx(0.5));
  CHECK(s.radiance.x == doctest::Approx(1 / std::numbers::pi));
}

TEST_CASE("blending two levels weights radiance by alpha") {
  const Shading a{{1, 1, 1}, 0.5F};
  const Shading b{{3, 3, 3}, 1.0F};
  const Shading s = blend(a, b, 0.25F);
  CHECK(s.alpha == doctest::Approx(0.625));
  CHECK(s.radiance.x == doctest::Approx((0.75 * 0.5 * 1 + 0.25 * 1 * 3) / 0.625));
  CHECK(blend({{7, 7, 7}, 0}, {{8, 8, 8}, 0}, 0.5F).radiance == V3f(0, 0, 0));
}

TEST_CASE("no weights turn the largest number into an infinity") {
  const float most = std::numeric_limits<float>::max();
  for (float weight = 0; weight < 1; weight += 0.01F) {
    const Shading s = blend({V3f(most, 0, 1), 0.3F}, {V3f(most, 0, 1), 0.7F}, weight);
    CHECK(std::isfinite(s.radiance.x));
    CHECK(s.radiance.y == 0);
  }
  Fabric fabric;
  fabric.views = {2, 2};
  FabricLevel level;
  level.width = 1;
  level.height = 1;
  level.set(LayerKind::lobes, {3, {0, 1, most}});
  level.add(LayerKind::table, 12, most);
  level.set(LayerKind::opacity, {4, {0.1F, 0.7F, 0.3F, 0.9F}});
  fabric.levels.push_back(level);
  for (const DirectionPair& pair : random_pairs(1000, 0.05, 3)) {
    const Shading s = evaluate(fabric, 0, 0, 0, pair.light, pair.view);
    CHECK(s.radiance.x == 0);
    CHECK(std::isfinite(s.radiance.y));
    CHECK(std::isfinite(s.radiance.z));
  }
}

TEST_CASE("texture coordinates repeat, rows run downwards") {
  const Fabric fabric = test::random_fabric(4, 2, {1, 1}, 0, 9);
  const V3f up(0, 0, 1);
  const auto same = [&](V2d uv, int x, int y) {
    CHECK(evaluate(fabric, 0.0, uv, up, up).radiance == evaluate(fabric, 0, x, y, up, up).radiance);
  };
  same({0.1, 0.1}, 0, 0);
  same({0.9, 0.9}, 3, 1);
  same({-0.1, 5.6}, 3, 1);
  same({1e9 + 0.3, -3.9}, 1, 0);
  CHECK(wrap_texel(-1e-18, 4) == 3);
}

TEST_CASE("products add up to a polynomial of the directions' functions") {
  // phi_1 = v_x + 2 over the views, psi_0 = (l_z, 1, 0), psi_1 = (0, 0, l_x): at the grid's own directions
  // interpolation changes nothing.
  Fabric fabric;
  fabric.views = {4, 4};
  fabric.lights = {3, 5};
  const auto views = directions_of(fabric.views);
  const auto lights = directions_of(fabric.lights);
  ProductBases bases;
  for (const V3f& v : views) bases.view.push_back(v.x + 2);
  for (const V3f& l : lights) bases.light.emplace_back(l.z, 1.0F, 0.0F);
  for (const V3f& l : lights) bases.light.emplace_back(0.0F, 0.0F, l.x);
  FabricLevel level;
  level.width = level.height = 1;
  level.bases = std::make_shared<ProductBases>(bases);
  level.pairs = {{0, 0}, {1, 0}, {1, 1}};
  level.set(LayerKind::products, {3, {0.5F, 0.25F, 2}});
  fabric.levels = {level};
  REQUIRE(validate(fabric));
  for (const V3f& v : views) {
    for (const V3f& l : lights) {
      const Shading s = evaluate(fabric, 0, 0, 0, l, v);
      const float phi = v.x + 2;
      CHECK(s.alpha == 1);
      CHECK(s.radiance.x == doctest::Approx(l.z * l.z * (0.5F + 0.25F * phi)).epsilon(1e-4));
      CHECK(s.radiance.y == doctest::Approx(l.z * (0.5F + 0.25F * phi)).epsilon(1e-4));
      CHECK(s.radiance.z == doctest::Approx(l.z * std::max(0.0F, 2 * phi * l.x)).epsilon(1e-4));
    }
  }
  SUBCASE("a light table is a term of its own") {
    fabric.levels[0].add(LayerKind::light, 45);
    for (V3f& s : fabric.levels[0].light_table()) s = V3f(1, 2, 3);
    const Shading s = evaluate(fabric, 0, 0, 0, lights[7], views[5]);
    CHECK(s.radiance.y == doctest::Approx(lights[7].z * (2.5F + 0.25F * (views[5].x + 2))).epsilon(1e-4));
  }
  SUBCASE("a light table alone multiplies the view table") {
    fabric.levels[0].remove(LayerKind::products);
    fabric.levels[0].add(LayerKind::light, 45);
    for (V3f& s : fabric.levels[0].light_table()) s = V3f(1, 2, 3);
    fabric.levels[0].add(LayerKind::table, 48);
    for (V3f& t : fabric.levels[0].view_table()) t = V3f(2, 2, 0.5F);
    const Shading s = evaluate(fabric, 0, 0, 0, lights[7], views[5]);
    CHECK(s.radiance.x == doctest::Approx(lights[7].z * 2));
    CHECK(s.radiance.z == doctest::Approx(lights[7].z * 1.5F));
  }
}
