#include "converter/dress/colourways.h"

#include <doctest/doctest.h>

#include <filesystem>

#include "format/check/gltf.h"
#include "format/gltf/fabric_extension.h"
#include "format/gltf/read_scene.h"
#include "tests/converter/workshop.h"
#include "tests/require.h"

using namespace selvedge;
using test::Workshop;
namespace fs = std::filesystem;

namespace {

constexpr const char* variants = "KHR_materials_variants";

/// Squares in a flat matt fabric, whose mean colour is its albedo.
struct Pale : Workshop {
  explicit Pale(int primitives = 1) : Workshop(test::square(primitives)) {
    REQUIRE(write_fabric(fabric, test::lambert_fabric(V2d(5, 4), 8, V3f(0.5F, 0.25F, 0.125F))));
  }

  /// The dressed garment in a variant.
  SceneMaterial worn_in(const std::string& variant, std::size_t primitive = 0) const {
    const Scene scene = test::need(read_scene(output, {}, {.scene = "", .variant = variant}));
    return scene.materials[scene.primitives[primitive].material];
  }

  void check() const {
    Scene scene;
    for (const Error& issue : check_gltf(output, {}, &scene)) FAIL_CHECK(to_line(issue));
  }
};

void check_near(const V3f& color, const V3f& wanted) {
  for (int c = 0; c < 3; ++c) CHECK(color[c] == doctest::Approx(wanted[c]).epsilon(0.01));
}

}  // namespace

TEST_CASE("dress: a colourway gives the cloth a mean colour, as the factor on the fabric's own") {
  const Pale pale;
  const DressReport report =
      test::need(pale.dress({.all_cloth = true, .colourways = {{"dusk", V3f(0.25F, 0.0625F, 0)}}}));
  pale.check();
  REQUIRE(report.variants.size() == 1);
  CHECK(report.variants[0].base_material == 0);
  CHECK(report.variants[0].index == 1);
  CHECK(report.warnings.empty());
  check_near(report.variants[0].tint.value(), V3f(0.5F, 0.25F, 0));
  const SceneMaterial dusk = pale.worn_in("dusk");
  CHECK(dusk.name == "cloth 0 dusk");
  check_near(dusk.garment_textures.tint, V3f(0.5F, 0.25F, 0));
  // The fallback is the fabric's picture times the same factor.
  check_near(V3f(dusk.base_color.x, dusk.base_color.y, dusk.base_color.z), V3f(0.5F, 0.25F, 0));
  CHECK(dusk.base_color_texture.transform.scale == V2d(200, 250));
  const SceneMaterial plain = pale.worn_in("");
  CHECK(plain.name == "cloth 0");
  CHECK(plain.garment_textures.tint == V3f(1, 1, 1));
  CHECK(plain.base_color_texture.image == dusk.base_color_texture.image);
}

TEST_CASE("dress: a colourway that is brighter than the fabric is told, and has a largest factor") {
  const Pale pale;
  const DressReport bright =
      test::need(pale.dress({.all_cloth = true, .colourways = {{"white", V3f(1, 1, 1)}}}));
  pale.check();
  check_near(pale.worn_in("white").garment_textures.tint, V3f(2, 4, 8));
  CHECK(pale.worn_in("white").base_color.z == 1);
  CHECK(bright.warnings.empty());
  REQUIRE(bright.issues.size() == 1);
  CHECK(bright.issues[0].code == Code::variant_unreached);
  CHECK(bright.issues[0].place == "variant \"white\"");
  CHECK(tint_for_color(V3f(1, 0.5F, 0), V3f(0, 1, 0)) == V3f(16, 0.5F, 0));
}

TEST_CASE("dress: a pale fabric reaches pale colours, a dark one no bright ones") {
  struct Case {
    V3f cloth, color;
    bool is_reached;
  };
  const V3f knit(0.39F, 0.34F, 0.27F), jeans(0.09F, 0.10F, 0.14F), navy(0.035F, 0.045F, 0.09F);
  const V3f white(0.9F, 0.9F, 0.9F), cream(0.89F, 0.79F, 0.63F), sky(0.19F, 0.35F, 0.58F);
  const V3f red(0.35F, 0.009F, 0.009F), ink(0.02F, 0.03F, 0.06F);
  for (const auto& [cloth, color, is_reached] :
       {Case{knit, white, true}, Case{knit, cream, true}, Case{knit, sky, true}, Case{knit, red, true},
        Case{jeans, ink, true}, Case{jeans, cream, false}, Case{jeans, sky, false}, Case{jeans, red, false},
        Case{navy, ink, true}, Case{navy, sky, false}, Case{navy, red, false}})
    CHECK(unreached_variant("", "", cloth, color / cloth).has_value() == !is_reached);
}

TEST_CASE("dress: a colourway in another fabric has its repeats and its fallback") {
  const Pale pale;
  const std::string other = pale.folder / "other.exr";
  REQUIRE(write_fabric(other, test::net_fabric(V2d(10, 8))));
  const DressReport report = test::need(pale.dress({.all_cloth = true, .colourways = {{"net", {}, other}}}));
  pale.check();
  CHECK(report.variants[0].repeats == V2d(100, 125));
  const Scene scene = test::need(read_scene(pale.output));
  REQUIRE(scene.fabrics.size() == 2);
  CHECK(scene.fabrics[1].bytes.size() == fs::file_size(other));
  const SceneMaterial net = pale.worn_in("net");
  CHECK(net.fabric.value().fabric == 1);
  CHECK(net.fabric.value().transform.scale == V2d(100, 125));
  CHECK(pale.worn_in("").normal_texture.image == -1);
  CHECK(scene.fabrics[1].name == "other");
}

TEST_CASE("dress: the garment's own variants stay, and a name that is taken is an error") {
  Pale pale(2);
  pale.edit([](Json& json) {
    json["extensionsUsed"] = {variants};
    json["extensions"][variants]["variants"] = {{{"name", "day"}}, {{"name", "night"}}};
    json["meshes"][0]["primitives"][0]["extensions"][variants]["mappings"] = {
        {{"material", 1}, {"variants", {1}}}};
  });
  test::need(pale.dress({.materials = {"cloth 0"}, .colourways = {{"dusk", V3f(0, 0, 0)}}}));
  pale.check();
  CHECK(test::need(read_scene(pale.output)).variants == std::vector<std::string>{"day", "night", "dusk"});
  CHECK(pale.worn_in("day").name == "cloth 0");
  CHECK(pale.worn_in("night").name == "cloth 1");
  CHECK(pale.worn_in("dusk").name == "cloth 0 dusk");
  CHECK(pale.worn_in("dusk", 1).name == "cloth 1");
  fs::remove(pale.output);
  const Colourway night{"night", V3f(0, 0, 0)};
  const Colourway noon{"noon", V3f(0, 0, 0)};
  for (const std::vector<Colourway>& taken : {std::vector{night}, std::vector{noon, noon}}) {
    const Error error = test::error_of(pale.dress({.all_cloth = true, .colourways = taken}));
    CHECK(error.code == Code::option_out_of_range);
    CHECK(error.message == "the garment has a \"" + taken[0].name + "\" already");
    CHECK_FALSE(fs::exists(pale.output));
  }
}

TEST_CASE("dress: a garment with mappings to variants that do not exist is refused") {
  Pale pale(2);
  pale.edit([](Json& json) {
    json["extensionsUsed"] = {variants};
    json["extensions"][variants]["variants"] = {{{"name", "night"}}};
    json["meshes"][0]["primitives"][1]["extensions"][variants]["mappings"] = {
        {{"material", 0}, {"variants", {0, 1}}}};
  });
  const Error error =
      test::error_of(pale.dress({.materials = {"cloth 0"}, .colourways = {{"dusk", V3f(0, 0, 0)}}}));
  CHECK(error.code == Code::gltf_accessor);
  CHECK(error.place == "/meshes/0/primitives/1/extensions/KHR_materials_variants/mappings/0/variants/1");
}
