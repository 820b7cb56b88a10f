#include "format/fabric/slabs.h"

#include <doctest/doctest.h>

#include <cmath>

#include "format/fabric/evaluate.h"
#include "tests/format/fabrics.h"
#include "tests/require.h"

using namespace selvedge;

namespace {

/// One level of `width` x `height` texels of 1 mm, with one slab everywhere, top and bottom as given.
Fabric slab_fabric(int width, int height, float top, float bottom, const SlabShape& shape = {}) {
  Fabric fabric;
  fabric.period_mm = {static_cast<float>(width), static_cast<float>(height)};
  fabric.reference_height = 1;
  fabric.views = {1, 1};
  FabricLevel level;
  level.width = width;
  level.height = height;
  const auto entries = static_cast<std::size_t>(level.texels() * shape.entries());
  level.set_heights({shape, std::vector<float>(entries, top), std::vector<float>(entries, bottom)});
  fabric.levels.push_back(level);
  return fabric;
}

/// A rib along y: columns of texels below `first` are 1 mm high, the others 0.25 mm.
Fabric rib(int width, int first) {
  Fabric fabric = slab_fabric(width, 1, 1, 0);
  std::vector<float> top;
  for (int i = 0; i < width; ++i) top.push_back(i < first ? 1.0F : 0.25F);
  fabric.levels[0].set_heights({{}, top, std::vector<float>(top.size(), 0.0F)});
  return fabric;
}

V3f towards(double x, double z) {
  const double length = std::hypot(x, z);
  return {static_cast<float>(x / length), 0, static_cast<float>(z / length)};
}

}  // namespace

TEST_CASE("seen from above every column is met where it stands") {
  const Fabric fabric = slab_fabric(5, 3, 0.7F, 0.2F, {2, 1, 1});
  const SlabMarch march(fabric.levels[0], fabric);
  for (int j = 0; j < 3; ++j) {
    for (int i = 0; i < 10; ++i) {
      const auto hit = test::need(march(V2d((i + 0.5) / 10, (j + 0.5) / 3), {0, 0, 1}));
      CHECK(hit.texel == static_cast<std::size_t>(5 * j + i / 2));
      CHECK(hit.entry == static_cast<std::size_t>(i % 2));
    }
  }
}

TEST_CASE("a ray meets the flat top where the line through the plane's point has its height") {
  // Plane at 1 mm, top at 0.4 mm: seen from +x the ray lands 0.6 tan(angle) further to -x.
  const Fabric fabric = slab_fabric(16, 1, 0.4F, 0.1F);
  const SlabMarch march(fabric.levels[0], fabric);
  for (const double slope : {-7.3, -1.9, -0.4, 0.0, 0.7, 2.6, 11.0}) {
    for (double u = -2.03; u < 2; u += 0.117) {
      const auto hit = test::need(march(V2d(u, 0.5), towards(slope, 1)));
      const double landed = u - 0.6 * slope / 16;
      CHECK(hit.texel == static_cast<std::size_t>((landed - std::floor(landed)) * 16));
    }
  }
}

TEST_CASE("rows run downwards while y points up") {
  const Fabric fabric = slab_fabric(1, 8, 0.5F, 0.0F);
  const SlabMarch march(fabric.levels[0], fabric);
  // Seen from +y the ray goes on to -y on its way down: to a greater v.
  const auto hit = test::need(march(V2d(0.5, 2.5 / 8), V3f(0, 0.9F, std::sqrt(1 - 0.81F))));
  CHECK(hit.texel == static_cast<std::size_t>(2.5 + 0.5 * 0.9 / std::sqrt(1 - 0.81)));
}

TEST_CASE("a rib hides what lies behind it as far as its height reaches") {
  // Ribs 1 mm high over texels 0 and 1 of 8; beyond them 0.25 mm. Seen at 45 degrees from -x the ray rises
  // towards -x: from the low part it meets the rib's side if it is nearer than 0.75 mm to it.
  const Fabric fabric = rib(8, 2);
  const SlabMarch march(fabric.levels[0], fabric);
  const V3f view = towards(-1, 1);
  int hidden = 0;
  for (int i = 0; i < 800; ++i) {
    const double on_low = 2 + 6 * (i + 0.5) / 800;  // place on the low part, mm
    const double on_plane = on_low - (1 - 0.25);    // where the same ray passes the plane
    const auto hit = test::need(march(V2d(on_plane / 8, 0.5), view));
    const bool behind = on_low - 2 < 0.75;
    CHECK((hit.texel < 2) == behind);
    hidden += behind ? 1 : 0;
  }
  CHECK(hidden == 100);
}

TEST_CASE("a ray passes under yarn that ends above it, and through gaps") {
  Fabric fabric = slab_fabric(4, 1, 1, 0.8F, {1, 1, 2});
  // The lower slab is there in texel 3 only.
  fabric.levels[0].set_heights({{1, 1, 2}, {0, 0, 1, 0, 0, 0, 0, 0.2F}, {0, 0, 0.8F, 0, 0, 0, 0, 0.1F}});
  const SlabMarch march(fabric.levels[0], fabric);
  const auto above = test::need(march(V2d(1.5 / 4, 0.5), {0, 0, 1}));
  CHECK(above.texel == 1);
  CHECK(above.entry == 0);
  const auto below = test::need(march(V2d(3.5 / 4, 0.5), {0, 0, 1}));
  CHECK(below.texel == 3);
  CHECK(below.entry == 1);
  CHECK_FALSE(march(V2d(0.5 / 4, 0.5), {0, 0, 1}));
  // From -x under texel 1's yarn: at x = 2 mm the ray is at 0.5 mm, at texel 3's middle near its slab.
  const auto under = test::need(march(V2d((3.5 - 0.85 * 2) / 4, 0.5), towards(-2, 1)));
  CHECK(under.texel == 1);
  const auto past = test::need(march(V2d((3.5 - 0.85 * 0.5) / 4, 0.5), towards(-0.5, 1)));
  CHECK(past.texel == 3);
}

TEST_CASE("of slabs in one cell the ray takes the one it comes to first") {
  Fabric fabric = slab_fabric(1, 1, 1, 0, {1, 1, 3});
  fabric.levels[0].set_heights({{1, 1, 3}, {0.3F, 0.9F, 0.6F}, {0.2F, 0.8F, 0.5F}});
  const SlabMarch march(fabric.levels[0], fabric);
  CHECK(march(V2d(0.5, 0.5), {0, 0, 1})->entry == 1);
}

TEST_CASE("marches end, whatever the numbers are") {
  for (const float height : {1e-30F, 1.0F, 1e30F}) {
    for (const float period : {1e-30F, 1.0F, 1e30F}) {
      Fabric fabric = slab_fabric(3, 2, height, 0, {1, 1, 1});
      fabric.period_mm = {period, period};
      fabric.reference_height = -height;
      std::vector<float> top(6, 0.0F);
      top[4] = height;
      fabric.levels[0].set_heights({{}, top, std::vector<float>(6, 0.0F)});
      for (const V3f& view : {V3f(1, 0, 0), V3f(0, -1, 0), V3f(0.6F, 0.8F, -0.1F), V3f(0, 0, 1)}) {
        const Shading s = evaluate(fabric, 0, 1, 1, {0, 0, 1}, view);
        CHECK(std::isfinite(s.alpha));
        CHECK(std::isfinite(s.radiance.x));
      }
    }
  }
}

TEST_CASE("a level whose entries have no yarn is a hole") {
  const Fabric fabric = slab_fabric(2, 2, 0, 0);
  const Shading s = evaluate(fabric, 0, 1, 1, {0, 0, 1}, {0.6F, 0, 0.8F});
  CHECK(s.alpha == 0);
  CHECK(s.radiance == V3f(0, 0, 0));
}

TEST_CASE("a texel is the mean over its cells") {
  // Two of four cells have yarn.
  Fabric fabric = slab_fabric(1, 1, 1, 0, {2, 2, 1});
  FabricLevel& level = fabric.levels[0];
  level.set_heights({{2, 2, 1}, {1, 0, 0, 1}, std::vector<float>(4, 0.0F)});
  fabric.lights = {1, 1};
  level.bases = std::make_shared<ProductBases>(ProductBases{{}, {V3f(0.25F, 0.5F, 1)}});
  level.pairs = {{0, 0}};
  level.set(LayerKind::products, {4, {1, 100, 100, 3}});
  REQUIRE(validate(fabric));
  const Shading s = evaluate(fabric, 0, 0, 0, {0, 0, 1}, {0, 0, 1});
  CHECK(s.alpha == doctest::Approx(0.5));
  CHECK(s.radiance.x == doctest::Approx(0.5));
  CHECK(s.radiance.z == doctest::Approx(2));
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
      CHECK(s.radiance.x == doctest::Approx(l.z * (0.5F + 0.25F * phi)).epsilon(1e-4));
      CHECK(s.radiance.y == doctest::Approx(0.5F + 0.25F * phi).epsilon(1e-4));
      CHECK(s.radiance.z == doctest::Approx(std::max(0.0F, 2 * phi * l.x)).epsilon(1e-4));
    }
  }
  SUBCASE("a light table is a term of its own") {
    fabric.levels[0].add(LayerKind::light, 45);
    for (V3f& s : fabric.levels[0].light_table()) s = V3f(1, 2, 3);
    const Shading s = evaluate(fabric, 0, 0, 0, lights[7], views[5]);
    CHECK(s.radiance.y == doctest::Approx(2.5F + 0.25F * (views[5].x + 2)).epsilon(1e-4));
  }
  SUBCASE("a light table alone multiplies the view table") {
    fabric.levels[0].remove(LayerKind::products);
    fabric.levels[0].add(LayerKind::light, 45);
    for (V3f& s : fabric.levels[0].light_table()) s = V3f(1, 2, 3);
    fabric.levels[0].add(LayerKind::table, 48);
    for (V3f& t : fabric.levels[0].view_table()) t = V3f(2, 2, 0.5F);
    const Shading s = evaluate(fabric, 0, 0, 0, lights[7], views[5]);
    CHECK(s.radiance.x == doctest::Approx(2));
    CHECK(s.radiance.z == doctest::Approx(1.5));
  }
}

TEST_CASE("products that do not fit their bases and heights are refused") {
  Fabric fabric = test::random_slab_fabric(4, 2, {2, 2}, 1, 3);
  REQUIRE(validate(fabric));
  FabricLevel& level = fabric.levels[1];
  SUBCASE("a function that is not there") { level.pairs[0].y = 2; }
  SUBCASE("entries that are not the heights'") { level.add(LayerKind::products, 1); }
  SUBCASE("no bases") { level.bases = nullptr; }
  SUBCASE("other bases than the other levels'") {
    ProductBases other = *level.bases;
    other.view[0] += 1;
    level.bases = std::make_shared<ProductBases>(other);
  }
  SUBCASE("a coefficient too few") {
    Layer layer = level[LayerKind::products];
    layer.values.pop_back();
    level.set(LayerKind::products, layer);
  }
  SUBCASE("no products") { level.pairs.clear(); }
  SUBCASE("other cells than the other levels'") { level.cells = {1, 1, 4}; }
  CHECK(test::error_of(validate(fabric)).code == Code::fabric_malformed);
}

TEST_CASE("a ray stays within the level however many repeats it passes") {
  for (const float period : {1e-3F, 1e-20F, 1e-38F, 1e-45F}) {
    Fabric fabric = slab_fabric(7, 5, 3e38F, 2e38F, {3, 2, 1});
    fabric.period_mm = {period, period};
    fabric.reference_height = -3e38F;
    const SlabMarch march(fabric.levels[0], fabric);
    for (int i = 0; i < 1000; ++i) {
      const double angle = 0.0063 * i;
      const V2d uv((i + 0.5) / 1000, 0.5);
      const auto hit = test::need(march(uv, V3f(V3d(0.8 * std::cos(angle), 0.8 * std::sin(angle), 0.6))));
      REQUIRE(hit.texel < 35);
      REQUIRE(hit.entry < 6);
    }
  }
}

TEST_CASE("the cells that a ray may visit are bounded before it is marched") {
  // 0.75 mm deep, cells of 0.5 mm along x and 1 mm along y.
  const Fabric fabric = slab_fabric(4, 4, 1, 0.25F, {2, 1, 1});
  const SlabMarch march(fabric.levels[0], fabric);
  CHECK(march.max_cells({0, 0, 1}) == 3);
  CHECK(march.max_cells(towards(1, 1)) == doctest::Approx(3 + 1.5));
  CHECK(march.max_cells({0, 1, 0}) == doctest::Approx(3 + 0.75 * 32));
  Fabric narrow = fabric;
  narrow.period_mm = {1e-30F, 1};
  CHECK(SlabMarch(narrow.levels[0], narrow).max_cells(towards(1, 1)) == max_cells_per_ray);
  const Fabric empty = slab_fabric(4, 4, 0, 0);
  CHECK(SlabMarch(empty.levels[0], empty).max_cells(towards(1, 1)) == 0);
}
