#include "converter/dress/garment_parts.h"

#include <doctest/doctest.h>

#include <filesystem>
#include <sstream>

#include "converter/dress/choose_materials.h"
#include "converter/dress/fallback.h"
#include "format/check/gltf.h"
#include "format/gltf/access.h"
#include "format/gltf/edit.h"
#include "format/gltf/fabric_extension.h"
#include "format/gltf/read_scene.h"
#include "format/picture/image.h"
#include "format/picture/picture_type.h"
#include "tests/converter/workshop.h"
#include "tests/format/raw_glb.h"
#include "tests/require.h"
#include "tests/shared_data.h"

using namespace selvedge;
using test::Workshop;
namespace fs = std::filesystem;

namespace {

/// Red and green stripes; the left half has an alpha of 1/5.
Image stripes(int side) {
  Image image{side, side, 4, {}};
  for (int i = 0; i < side * side; ++i) {
    const bool red = i / side % 2 == 0;
    image.pixels.insert(image.pixels.end(),
                        {red ? 1.0F : 0, red ? 0 : 1.0F, 0, i % side < side / 2 ? 0.2F : 1});
  }
  return image;
}

int add_texture(GltfDocument& document, const Image& image) {
  const int view = append_view(document, test::need(encode_png(image, Transfer::keep)));
  document.json["images"].push_back({{"name", "stripes"}, {"mimeType", "image/png"}, {"bufferView", view}});
  document.json["textures"].push_back({{"source", document.json["images"].size() - 1}});
  return static_cast<int>(document.json["textures"].size()) - 1;
}

/// A square with a picture, a mask and normals.
struct Worn : Workshop {
  explicit Worn(const char* mode = "MASK") {
    GltfDocument document = test::need(load_gltf(garment));
    const int picture = add_texture(document, stripes(64));
    const int normals = add_texture(document, Image{4, 4, 3, std::vector<float>(48, 0.7F)});
    Json& material = document.json["materials"][0];
    material["pbrMetallicRoughness"] = {
        {"baseColorTexture",
         {{"index", picture}, {"extensions", {{"KHR_texture_transform", {{"scale", {2, 1}}}}}}}},
        {"baseColorFactor", {0.5, 0.25, 1, 1}},
        {"metallicRoughnessTexture", {{"index", picture}}}};
    material["normalTexture"] = {{"index", normals}, {"scale", 0.5}};
    material["occlusionTexture"] = {{"index", normals}};
    material["alphaMode"] = mode;
    if (std::string(mode) == "MASK") material["alphaCutoff"] = 0.25;
    document.json["extensionsUsed"].push_back("KHR_texture_transform");
    REQUIRE(save_gltf(document, garment));
  }

  /// The scene of the dressed garment, in which `check` finds nothing.
  Scene checked(const DressOptions& options) const {
    test::need(dress(options));
    Scene scene;
    for (const Error& issue : check_gltf(output, {}, &scene)) FAIL_CHECK(to_line(issue));
    return scene;
  }
};

DressOptions all() { return {.all_cloth = true}; }
/// In the fabric's own colour.
DressOptions undyed() { return {.all_cloth = true, .color_options = {.keeps_base_color = false}}; }

V3f color_of(const SceneMaterial& material) {
  return {material.base_color.x, material.base_color.y, material.base_color.z};
}

/// 3 x 2 pixels, of which the lossless one has red, half of green, blue; nothing, dark, brown: written
/// by libwebp (npm sharp) as a lossless picture, a lossy one, and a canvas with alpha.
constexpr const char* pictures[] = {
    "UklGRkoAAABXRUJQVlA4TD0AAAAvAkAAEC9AkG1TiXndX+YaZNI27Vv/emZtYhpiOrj1b4lA0mZLvjd/"
    "4DucJavaBArZRoBD9wKdwkX0P4YX"
    "AA==",
    "UklGRmoAAABXRUJQVlA4IF4AAABwAgCdASoDAAIAAMASJagCdLoAD1APxANCle7AAP7Sv2/t/saf9Rp/+Z/pXtH/"
    "7+uZg0vz3OPgAlrWh4//"
    "nMf+xlv1c/ub/+8Z/1d/uMt+rn9zf/Qj8tvxt+VO9+AA",
    "UklGRogAAABXRUJQVlA4WAoAAAAQAAAAAgAAAQAAQUxQSAcAAAAA/4D/AP//"
    "AFZQOCBaAAAA8AEAnQEqAwACAADAEiWoAnS6AAMJBv3sAP78"
    "dr/+P+DJz/6XL3sk40P+/0RPvW0WiV3dwDT/89//2Mt+rn9zf/3ZP/cP9xlv1c/ub/7F3+LTM+O/wPZr4XAA"};

}  // namespace

TEST_CASE(
    "dress: mask, normals and occlusion of a garment stay, and its colours leave where they are unwanted") {
  const Worn worn;
  const Scene scene = worn.checked(undyed());
  const SceneMaterial& material = scene.materials[0];
  const GarmentTextures& kept = material.garment_textures;
  REQUIRE(kept.mask.image >= 0);
  CHECK(kept.mask_cutoff == 0.25F);
  CHECK(kept.mask.transform.scale == V2d(2, 1));
  CHECK(kept.tint == V3f(1, 1, 1));
  CHECK(kept.tint_texture.image == -1);
  CHECK(kept.normal_scale == 0.5F);
  const Image mask = test::need(decode_image(scene.images[kept.mask.image].bytes, "mask", Transfer::keep));
  const Image before = stripes(64);
  REQUIRE(mask.pixels.size() == before.pixels.size());
  for (std::size_t i = 3; i < mask.pixels.size(); i += 4)
    CHECK(mask.pixels[i] == doctest::Approx(before.pixels[i]).epsilon(1e-6));
  // The fallback has the same outline in the colour of the cloth, and the same normals.
  CHECK(material.base_color_texture.image == kept.mask.image);
  CHECK(material.alpha_mode == AlphaMode::mask);
  CHECK(material.alpha_cutoff == 0.25F);
  const V3f mean = mean_color(bake_fallback(test::net_fabric(V2d(5, 4))).color);
  for (int c = 0; c < 3; ++c) CHECK(color_of(material)[c] == doctest::Approx(mean[c]).epsilon(0.02));
  CHECK(material.normal_texture.image == kept.normal.image);
  CHECK(material.occlusion_texture.image == kept.normal.image);
  // The stripes are gone, and so is what the fallback would have had of the fabric.
  CHECK(scene.images.size() == 2);
  const Json json = test::need(load_gltf(worn.output)).json;
  CHECK(json["images"].size() == 2);
  CHECK(json["textures"].size() == 2);
  CHECK(fs::file_size(worn.output) <= fs::file_size(worn.garment) + fs::file_size(worn.fabric) + 2000);
}

TEST_CASE("dress: cloth has the garment's print and colour, and other colours can take their place") {
  const Worn worn;
  const SceneMaterial printed = worn.checked(all()).materials[0];
  CHECK(printed.garment_textures.tint_texture.image >= 0);
  CHECK(printed.garment_textures.tint_texture.image == printed.garment_textures.mask.image);
  // 0.5, 0.25, 1 of yarn that reflects 0.3, 0.2, 0.3.
  for (int c = 0; c < 3; ++c) {
    const float factor = std::array{0.5F / 0.3F, 0.25F / 0.2F, 1 / 0.3F}[c];
    CHECK(printed.garment_textures.tint[c] == doctest::Approx(factor).epsilon(1e-3));
  }
  CHECK(printed.base_color_texture.image == printed.garment_textures.tint_texture.image);
  DressOptions options = all();
  options.color_options.color = V3f(0.15F, 0.2F, 0);
  const SceneMaterial colored = worn.checked(options).materials[0];
  CHECK((colored.garment_textures.tint - V3f(0.5F, 1, 0)).length() < 1e-3F);
  CHECK(colored.garment_textures.tint_texture.image == -1);
  options = all();
  options.color_options.tint = V3f(2, 0.5F, 0.25F);
  const SceneMaterial dyed = worn.checked(options).materials[0];
  CHECK(dyed.garment_textures.tint == V3f(2, 0.5F, 0.25F));
  const V3f mean = mean_color(bake_fallback(test::net_fabric(V2d(5, 4))).color);
  CHECK(color_of(dyed).y == doctest::Approx(mean.y * 0.5F).epsilon(0.02));
}

TEST_CASE("dress: the report names the kept and the replaced members") {
  const DressReport report = test::need(Worn().dress(undyed()));
  CHECK(report.materials[0].kept_members ==
        std::vector<std::string>{"maskTexture", "normalTexture", "occlusionTexture"});
  CHECK(report.materials[0].replaced_members == std::vector<std::string>{"baseColorTexture \"stripes\"",
                                                                         "baseColorFactor 0.5 0.25 1",
                                                                         "metallicRoughnessTexture"});
  // All four corners of the square lie in one texel of the repeated picture.
  CHECK(report.warnings.empty());
  CHECK(test::need(Worn().dress(all())).materials[0].kept_members ==
        std::vector<std::string>{"tintTexture", "maskTexture", "normalTexture", "occlusionTexture"});
  Workshop plain;  // of a grey that programs write by default
  CHECK(test::need(plain.dress(all())).materials[0].kept_members.empty());
  CHECK(test::need(plain.dress(undyed())).materials[0].replaced_members ==
        std::vector<std::string>{"baseColorFactor 0.8 0.8 0.8"});
}

TEST_CASE("dress: an opaque material has no mask, and a blended one is cut in the middle") {
  CHECK(Worn("OPAQUE").checked(all()).materials[0].garment_textures.mask.image == -1);
  DressOptions bright = all();
  bright.color_options.tint = V3f(2, 0.5F, 16);
  CHECK(color_of(Worn("OPAQUE").checked(bright).materials[0]) == V3f(1, 0.5F, 1));
  const Worn sheer("BLEND");
  const SceneMaterial material = sheer.checked(all()).materials[0];
  CHECK(material.garment_textures.mask.image >= 0);
  CHECK(material.garment_textures.mask_cutoff == 0.5F);
  CHECK(test::need(sheer.dress(undyed())).materials[0].replaced_members[2].starts_with("alphaMode BLEND"));
  Workshop veil;
  veil.edit([](Json& json) {
    json["materials"][0]["alphaMode"] = "BLEND";
    json["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"] = {1, 1, 1, 0.4};
  });
  CHECK(test::need(veil.dress(all()))
            .warnings.back()
            .ends_with("its alpha of 0.4 is not kept: the cloth is opaque"));
}

TEST_CASE("dress: a dressed garment that is dressed again keeps its parts") {
  const Worn worn;
  const Scene once = worn.checked(all());
  Worn again;
  fs::copy_file(worn.output, again.garment, fs::copy_options::overwrite_existing);
  const Scene twice = again.checked(all());
  CHECK(twice.materials[0].garment_textures.mask_cutoff == once.materials[0].garment_textures.mask_cutoff);
  CHECK(twice.images[twice.materials[0].garment_textures.mask.image].bytes ==
        once.images[once.materials[0].garment_textures.mask.image].bytes);
  CHECK(twice.images.size() == once.images.size());
}

TEST_CASE(
    "dress --all leaves alone what is no cloth by names or factors, but for a document's only material") {
  const auto named = [](const std::string& name) { return Json{{"name", name}}; };
  const auto chosen_of = [](GltfDocument& document) {
    return test::need(choose_materials(document, Scene(), {.all_cloth = true})).materials;
  };
  // Beside cotton, and a material of another name.
  const auto is_cloth = [&](const Json& material, const Json& mesh, const char* beside = "") {
    GltfDocument document;
    Json shown = mesh;
    shown["primitives"] = {{{"material", 1}}};
    document.json = {{"materials", {named("cotton"), material, named(beside)}},
                     {"meshes", {{{"primitives", {{{"material", 0}}}}}, shown}},
                     {"nodes", {{{"name", shown.value("parent", "")}, {"children", {1}}}, {{"mesh", 1}}}}};
    const ChosenMaterials chosen = test::need(choose_materials(document, Scene(), {.all_cloth = true}));
    const bool cloth = std::ranges::find(chosen.materials, 1) != chosen.materials.end();
    CHECK(cloth == std::ranges::none_of(chosen.skipped_materials, [](const std::string& line) {
            return line.ends_with("--material '#1' dresses it");
          }));
    CHECK(test::need(choose_materials(document, Scene(), {.materials = {"#1"}})).materials ==
          std::vector<int>{1});
    // Alone it is cloth whatever it is called.
    document.json["meshes"].erase(0);
    document.json["materials"] = Json::array({material});
    document.json["meshes"][0]["primitives"][0]["material"] = 0;
    CHECK(chosen_of(document) == std::vector<int>{0});
    return cloth;
  };
  constexpr const char* others =
      "Buttons|metalZip_02|shoe sole|Std_Eyelash|leftEyes|HAIR|skin.001|wooden_leg|Wolf3D_Skin|Wolf3D_Head|"
      "Wolf3D_Teeth|avaturn_look_0|avaturn_body|male_body|N00_000_00_Body_00_SKIN (Instance)|"
      "N00_000_00_EyeIris_00_EYE|Std_Skin_Head|Mannequin|shirt_buttons|Jacket_Zipper|sofa_legs|Lamp02|"
      "lampBulb|"
      "TVScreen|text|wall paint|pipe.004|Soil|Leaf|plantLeaves|Floor|Chrome|glass_window|Haut|Zähne|cheveux|"
      "piel|botón|Holz|皮肤|白目|髪|Brows|Soldier_VisorMat|Eyewear|扣子|Augenbrauen|Knöpfe|lunettes|studio_"
      "backdrop";
  constexpr const char* cloths =
      "|console|Skinny jeans|unzipped|chair "
      "cover|Body|Bodysuit|BodySuit|face_mask|headband|hair_band|hairband|"
      "leafprint_dress|leaf_print_dress|floor_length_gown|Armour|Eyelet_lace_top|button_down_shirt|metal_"
      "jacket|"
      "fabric_gold|Silver silk|pants_leg|Female_Dress_Body|Wolf3D_Outfit_Top|N00_002_01_Tops_01_CLOTH|"
      "jacket_text|shower curtain|Texture_01|Material.001|上衣服|chemise|Vorhang";
  for (const auto& [list, cloth] : {std::pair(others, false), std::pair(cloths, true)}) {
    std::istringstream names(list);
    for (std::string name; std::getline(names, name, '|');) {
      CAPTURE(name);
      CHECK(is_cloth(named(name), Json::object()) == cloth);
    }
  }
  // A body, a head or a leg is one beside skin or hair.
  for (const char* name : {"Body", "Head", "arms", "Leg"}) CHECK_FALSE(is_cloth(named(name), {}, "Hair_02"));
  // Where the material's name says nothing, its meshes, their nodes and the parents of these may.
  CHECK_FALSE(is_cloth(named("Black"), named("Buttons")));
  CHECK_FALSE(is_cloth(named("Black"), {{"parent", "Lamp_3"}}));
  CHECK(is_cloth(named("Black"), {{"name", "Shirt"}, {"parent", "Mannequin"}}));
  CHECK(is_cloth(named("cotton_2"), named("Lamp")));
  const auto metal = [](double roughness) {
    return Json{{"pbrMetallicRoughness", {{"metallicFactor", 1}, {"roughnessFactor", roughness}}}};
  };
  CHECK_FALSE(is_cloth({{"extensions", {{"KHR_materials_transmission", {{"transmissionFactor", 1}}}}}}, {}));
  CHECK_FALSE(is_cloth(metal(0.2), {}));
  CHECK(is_cloth(metal(1), {}));  // a forgotten factor
  GltfDocument document;
  document.json = {{"materials", {named("a"), named("b")}}};
  CHECK(test::need(choose_materials(document, Scene(), {.all_cloth = true, .excluded_materials = {"a"}}))
            .materials == std::vector<int>{1});
  CHECK(test::error_of(choose_materials(document, Scene(), {.all_cloth = true, .excluded_materials = {"c"}}))
            .code == Code::material_missing);
  CHECK(test::error_of(
            choose_materials(document, Scene(), {.all_cloth = true, .excluded_materials = {"a", "b"}}))
            .code == Code::material_missing);
  // A garment whose meshes are called hair is one; other names and factors are told with the way to dress
  // them.
  document.json["meshes"] = {{{"name", "Hair001"}, {"primitives", {{{"material", 0}}, {{"material", 1}}}}}};
  CHECK(chosen_of(document) == std::vector<int>{0, 1});
  document.json["materials"] = {named("Hair"), named("Body")};
  CHECK(
      test::error_of(choose_materials(document, Scene(), {.all_cloth = true}))
          .message.ends_with("\"Body\" was left alone: a \"body\" is no cloth; --material '#1' dresses it"));
}

TEST_CASE("dress --all: what moves with head and fingers is a body, and cloth moves with either at most") {
  // The side of the other material, in metres: clothes are much of a figure, a visor is not.
  for (const auto& [first, second, side, body] :
       {std::tuple("mixamorig:Head", "mixamorig:LeftHandThumb1", 1.0, true),
        {"head", "f_finger.01.L", 0.6, true},
        {"head", "f_finger.01.L", 0.4, false},
        {"Spine", "LeftHand", 1.0, false},
        {"thumb", "LeftHandThumb2", 1.0, false},
        {"Head", "Neck", 1.0, false}}) {
    CAPTURE(first);
    Workshop workshop;
    GltfDocument document = test::need(load_gltf(workshop.garment));
    Json mesh = document.json["meshes"][0];
    mesh["primitives"][0]["material"] = 1;
    std::vector<float> joints;
    std::vector<float> weights;
    for (int i = 0; i < 4; ++i) {
      joints.insert(joints.end(), {i < 2 ? 0.0F : 1.0F, 0, 0, 0});
      weights.insert(weights.end(), {1, 0, 0, 0});
    }
    mesh["primitives"][0]["attributes"]["JOINTS_0"] = append_float_accessor(document, joints, 4, false);
    mesh["primitives"][0]["attributes"]["WEIGHTS_0"] = append_float_accessor(document, weights, 4, false);
    document.json["materials"] = {{{"name", "a"}}, {{"name", "b"}}};
    document.json["meshes"].push_back(mesh);
    const std::size_t nodes = document.json["nodes"].size();
    document.json["nodes"][0]["scale"] = {side, side, side};
    document.json["scenes"][0]["nodes"].push_back(nodes);
    for (const Json& node : {Json{{"mesh", 1}, {"skin", 0}}, Json{{"name", first}}, Json{{"name", second}}})
      document.json["nodes"].push_back(node);
    document.json["skins"] = {{{"joints", {nodes + 1, nodes + 2}}}};
    const Scene scene = test::need(read_scene(document));
    CHECK(test::need(choose_materials(document, scene, {.all_cloth = true})).materials.size() ==
          (body ? 1 : 2));
  }
}

TEST_CASE("dress: vertex colours of a garment are the cloth's, unless they are white or others are wanted") {
  for (const float red : {1.0F, 0.5F}) {
    for (const bool given : {false, true}) {
      const Workshop plain;
      GltfDocument document = test::need(load_gltf(plain.garment));
      const std::vector<V4f> colours(4, V4f(red, 1, 1, 0.5F));
      document.json["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] =
          append_float_accessor(document, floats_of(colours), 4, false);
      REQUIRE(save_gltf(document, plain.garment));
      DressOptions options = all();
      if (given) options.color_options.color = V3f(0.3F, 0.2F, 0.3F);
      const DressReport report = test::need(plain.dress(options));
      const Scene scene = test::need(read_scene(plain.output));
      CHECK(scene.primitives[0].colors.empty() == (given && red < 1));
      const std::vector<std::string> said =
          red < 1 ? std::vector<std::string>{"COLOR_0"} : std::vector<std::string>{};
      if (!given) CHECK(report.materials[0].kept_members == said);
      if (!given)
        CHECK(scene.materials[0].garment_textures.tint.x ==
              doctest::Approx(red < 1 ? 0.8 / 0.3 : 1).epsilon(1e-3));
      if (given && red < 1) CHECK(report.materials[0].replaced_members.front() == "COLOR_0");
      CHECK(check_gltf(plain.output).empty());
    }
  }
}

TEST_CASE("dress: materials on one picture share its mask, and textures on other UV sets are left out") {
  Worn worn;
  worn.edit([](Json& json) {
    const Json material = json["materials"][0];
    Json primitive = json["meshes"][0]["primitives"][0];
    primitive["material"] = json["materials"].size();
    json["meshes"][0]["primitives"].push_back(primitive);
    json["materials"].push_back(material);
    json["materials"].back()["normalTexture"]["texCoord"] = 2;
    json["materials"].back()["pbrMetallicRoughness"]["baseColorFactor"] = {1, 1, 1, 1};
  });
  const DressReport report = test::need(worn.dress(undyed()));
  const Json json = test::need(load_gltf(worn.output)).json;
  CHECK(std::ranges::count_if(json["images"], [](const Json& image) {
          return string_of(member(image, "name")) == "mask";
        }) == 1);
  const auto own = [&](std::size_t material) -> const Json& {
    return json["materials"][material]["extensions"]["SELVEDGE_materials_fabric"];
  };
  const std::size_t other = json["materials"].size() - 1;
  CHECK(own(0)["maskTexture"]["index"] == own(other)["maskTexture"]["index"]);
  CHECK(own(0).contains("normalTexture"));
  CHECK_FALSE(own(other).contains("normalTexture"));
  CHECK(std::ranges::count_if(report.warnings, [](const std::string& line) {
          return line.ends_with(
              "normalTexture is on TEXCOORD_2, and only the sets 0 and 1 are read: it is left out");
        }) == 1);
}

TEST_CASE("dress: what a mask cuts has no backing, which would show beside it") {
  const Worn worn;
  DressOptions options = all();
  options.backing = V3f(0, 0, 0);
  const DressReport report = test::need(worn.dress(options));
  CHECK(report.backed_primitive_count == 0);
  CHECK(std::ranges::count_if(report.warnings, [](const std::string& line) {
          return line.find("has no backing") != std::string::npos;
        }) == 1);
}

TEST_CASE("dress: pictures in WebP are read, kept as a print, and pass through as they are") {
  for (const char* picture : pictures) {
    Workshop workshop;
    workshop.edit([&](Json& json) {
      json["extensionsUsed"] = {"EXT_texture_webp"};
      json["extensionsRequired"] = {"EXT_texture_webp"};
      json["images"] = Json::array({Json{{"uri", std::string("data:image/webp;base64,") + picture}}});
      json["textures"] = Json::array({Json{{"extensions", {{"EXT_texture_webp", {{"source", 0}}}}}}});
      json["materials"][0]["pbrMetallicRoughness"] = {{"baseColorTexture", {{"index", 0}}}};
    });
    const Scene scene = test::need(read_scene(workshop.garment));
    CHECK(scene.remarks.empty());
    const SceneImage& encoded = scene.images.at(scene.materials[0].base_color_texture.image);
    CHECK(picture_size(encoded.bytes) == Imath::Vec2<std::int64_t>(3, 2));
    const Image image = test::need(decode_image(encoded.bytes, "webp", Transfer::keep));
    REQUIRE(image.pixels.size() == 24);
    if (picture == pictures[0]) {
      const std::vector<int> expected{255, 0, 0, 255, 0,  255, 0,  128, 0,   0,   255, 255,
                                      0,   0, 0, 0,   10, 20,  30, 255, 200, 100, 50,  255};
      for (std::size_t i = 0; i < expected.size(); ++i)
        CHECK(image.pixels[i] * 255 == doctest::Approx(expected[i]));
    }
    CHECK(test::error_of(decode_image(encoded.bytes, "webp", Transfer::keep, {.pixels = 5})).code ==
          Code::file_too_large);
    REQUIRE(workshop.dress({.all_cloth = true, .color_options = {.keeps_base_color = true}}));
    const Scene dressed = test::need(read_scene(workshop.output));
    CHECK(dressed.images.at(dressed.materials[0].base_color_texture.image).bytes == encoded.bytes);
  }
}
