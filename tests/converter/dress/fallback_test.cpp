#include "converter/dress/fallback.h"

#include <doctest/doctest.h>

#include <cmath>
#include <numbers>

#include "converter/dress/dress.h"
#include "format/fabric/evaluate.h"
#include "format/gltf/access.h"
#include "format/gltf/document.h"
#include "format/gltf/read_scene.h"
#include "format/picture/image.h"
#include "tests/converter/fabrics.h"
#include "tests/converter/workshop.h"
#include "tests/format/yarn_data.h"
#include "tests/require.h"

using namespace selvedge;
using test::Workshop;

namespace {

const DressOptions everything{.all_cloth = true};

}  // namespace

TEST_CASE("fallback: a Lambert fabric's base colour is its albedo, and it has no sheen") {
  const Fallback fallback = bake_fallback(test::lambert_fabric(V2d(5, 5), 4, V3f(0.5F, 0.25F, 0.1F)));
  CHECK(fallback.color.pixels[0] == doctest::Approx(0.5).epsilon(1e-5));  // floats
  CHECK(fallback.color.pixels[1] == doctest::Approx(0.25).epsilon(1e-5));
  CHECK(fallback.color.pixels[3] == 1);
  CHECK_FALSE(fallback.has_holes);
  CHECK(fallback.factors.sheen_color == V3f(0, 0, 0));
}

TEST_CASE("fallback: a Lambert sheet that transmits keeps both its colours") {
  // 0.5, 0.25, 0.1 come back and 0.2, 0.1, 0.05 go through: by the extension, base colour times 1 - t and
  // colour times t.
  Fabric fabric = test::lambert_fabric(V2d(5, 5), 4, V3f(0.5F, 0.25F, 0.1F));
  Fabric through = test::lambert_fabric(V2d(5, 5), 4, V3f(0.2F, 0.1F, 0.05F));
  through.side = Side::through;
  fabric.add_side(std::move(through));
  const Fallback fallback = bake_fallback(fabric);
  CHECK(fallback.factors.transmission == doctest::Approx(0.2).epsilon(0.01));
  const V3f base = mean_color(fallback.color);
  const std::array<V3f, 2> expected{V3f(0.5F, 0.25F, 0.1F), V3f(0.2F, 0.1F, 0.05F)};
  for (int c = 0; c < 3; ++c) {
    CHECK(base[c] * (1 - fallback.factors.transmission) == doctest::Approx(expected[0][c]).epsilon(0.01));
    CHECK(fallback.factors.transmission_color[c] * fallback.factors.transmission ==
          doctest::Approx(expected[1][c]).epsilon(0.01));
  }
  fabric.sides = {};
  CHECK(bake_fallback(fabric).factors.transmission == 0);
}

TEST_CASE("fallback: a lobe's base colour is the nearest Lambertian one, in closed form") {
  // f = l.z (Cz l.z v.z)^n darkens towards the rim. The base colour b with the least integral of
  // v.z (b l.z / pi - f)^2 over both hemispheres is 6 pi Cz^n / ((n + 2) (n + 3)).
  Fabric fabric = test::lambert_fabric(V2d(5, 5), 1, V3f(0, 0, 0));
  fabric.levels[0].set_layer(LayerKind::lobes, {15, {0, 0, 0, 0.6F, 2, 0, 0, 0, 0.5F, 3, 0, 0, 0, 0.4F, 4}});
  const Fallback fallback = bake_fallback(fabric);
  const double pi = std::numbers::pi;
  CHECK(fallback.factors.sheen_color == V3f(0, 0, 0));
  // The integrals are sums over 36 directions of equal solid angle.
  CHECK(fallback.color.pixels[0] == doctest::Approx(6 * pi * 0.36 / 20).epsilon(1e-2));
  CHECK(fallback.color.pixels[1] == doctest::Approx(6 * pi * 0.125 / 30).epsilon(1e-2));
  CHECK(fallback.color.pixels[2] == doctest::Approx(6 * pi * 0.0256 / 42).epsilon(1e-2));
}

TEST_CASE("dress: the picture of the fallback holds its colour sRGB-encoded, and the opacity as it is") {
  const Workshop workshop;
  REQUIRE(workshop.dress(everything));
  const Scene scene = test::need(read_scene(workshop.output));
  const SceneMaterial& material = scene.materials[0];
  CHECK(material.alpha_mode == AlphaMode::mask);
  CHECK(material.alpha_cutoff == 0.5F);
  const SceneImage& encoded = scene.images[material.base_color_texture.image];
  const Image stored = test::need(decode_image(encoded.bytes, "stored", Transfer::keep));
  const Fallback fallback = bake_fallback(test::need(read_fabric(workshop.fabric)));
  const Image& linear = fallback.color;
  REQUIRE(stored.pixels.size() == linear.pixels.size());
  for (std::size_t i = 0; i < linear.pixels.size(); ++i) {
    // IEC 61966-2-1, written out.
    const double value = linear.pixels[i];
    const double srgb = value <= 0.0031308 ? 12.92 * value : 1.055 * std::pow(value, 1 / 2.4) - 0.055;
    CHECK(std::abs(stored.pixels[i] - (i % 4 == 3 ? value : srgb)) <= 0.5 / 255 + 1e-6);  // rounded to 8 bits
  }
}

TEST_CASE("fallback: a fabric that brightens towards the rim gets a sheen of that colour") {
  Fabric fabric = test::lambert_fabric(V2d(5, 5), 4, V3f(0.2F, 0.2F, 0.2F));
  fabric.views = nearly_square_grid(64);
  const std::vector<V3f> views = cell_directions(fabric.views);
  for (FabricLevel& level : fabric.levels) {
    level.add_layer(LayerKind::table, 3 * 64, 1);
    for (std::size_t i = 0; i < level.view_table().size(); ++i)
      level.view_table()[i].x += 1.0F - views[i % 64].z;
  }
  const Fallback fallback = bake_fallback(fabric);
  // Green has none of its own: the sheen gives back what red's takes from its base.
  CHECK(fallback.factors.sheen_color.x > 0.05F);
  CHECK(fallback.factors.sheen_color.y < 0.1F * fallback.factors.sheen_color.x);
}

TEST_CASE("fallback: the picture shows the yarn where the fabric has it, in the yarn's colour") {
  const Fabric fabric = test::with_yarn(test::lambert_fabric(V2d(5, 5), 4, V3f(0.2F, 0.3F, 0.4F)), 1);
  const Fallback fallback = bake_fallback(fabric);
  REQUIRE(fallback.color.width == 64);
  const V3f up(0, 0, 1);
  const auto shade = [&](const V2d& uv, const V3f& light) {
    return fabric.levels[0].yarns()->shade(uv, fabric.reference_height, light, up);
  };
  std::size_t differing = 0;
  V3d sum(0, 0, 0);
  double seen = 0;
  for (int i = 0; i < 64 * 64; ++i) {
    const V2d uv((i % 64 + 0.5) / 64, (i / 64 + 0.5) / 64);
    if (fallback.color.pixels[4 * i + 3] != shade(uv, up).alpha) ++differing;
    // Lights of equal solid angle on a spiral.
    const double z = std::fmod((i + 0.5) * 0.7548776662466927, 1);
    const double turn = 2 * std::numbers::pi * std::fmod(i * 0.5698402909980532, 1);
    const V3f light(V3d(std::sqrt(1 - z * z) * std::cos(turn), std::sqrt(1 - z * z) * std::sin(turn), z));
    const Shading shading = shade(uv, light);
    sum += V3d(shading.radiance) * (2 * std::numbers::pi * shading.alpha);
    seen += shading.alpha;
  }
  CHECK(differing == 0);
  for (int c = 0; c < 3; ++c) {
    CHECK(fallback.factors.albedo[c] == doctest::Approx(sum[c] / seen).epsilon(0.02));
    CHECK(mean_color(fallback.color)[c] == doctest::Approx(fallback.factors.base_color[c]).epsilon(0.02));
  }
}

TEST_CASE("fallback: a file keeps the factors in 300 bytes, and other members of that name are fitted anew") {
  Fabric fabric = test::lambert_fabric(V2d(5, 5), 4, V3f(0.5F, 0.25F, 0.1F));
  const FallbackFactors fitted = fit_fallback(fabric);
  fabric.fallback = fallback_json_text(fitted);
  CHECK(fabric.fallback.size() <= 300);
  const test::Folder folder;
  const std::string file = folder / "k.fabric.exr";
  REQUIRE(write_fabric(file, fabric));
  const Fabric read = test::need(read_fabric(file));
  CHECK(fallback_json_text(fallback_of(read)) == fabric.fallback);
  for (const char* text :
       {R"({"metallicFactor":0})", R"({"baseColor":[2,0,0]})", R"({"baseColor":7})", "{}"}) {
    fabric.fallback = text;
    CHECK(fallback_json_text(fallback_of(fabric)) == fallback_json_text(fitted));
  }
  // The factors of the file hold, whatever the fabric looks like.
  FallbackFactors other = fitted;
  other.base_color = V3f(0.25F, 0.5F, 0.75F);
  fabric.fallback = fallback_json_text(other);
  CHECK(mean_color(bake_fallback(fabric).color).z == doctest::Approx(0.75));
}

TEST_CASE("fallback: holes take the mean colour") {
  const Fallback fallback = bake_fallback(test::net_fabric(V2d(5, 4), 16));
  CHECK(fallback.has_holes);
  CHECK(fallback.color.pixels[3] == 0);
  CHECK(fallback.color.pixels[0] > 0.05F);
}
