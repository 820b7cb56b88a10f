#include "converter/dress/dress.h"

#include <doctest/doctest.h>

#include <cmath>
#include <filesystem>
#include <map>

#include "converter/dress/true_size.h"
#include "converter/dress/uv_scale.h"
#include "format/check/gltf.h"
#include "format/fabric/evaluate.h"
#include "format/fabric/file.h"
#include "format/gltf/access.h"
#include "format/gltf/document.h"
#include "format/gltf/read_scene.h"
#include "format/picture/image.h"
#include "tests/converter/fabrics.h"
#include "tests/converter/workshop.h"
#include "tests/format/encoded_cloths.h"
#include "tests/format/yarn_data.h"
#include "tests/require.h"
#include "tests/shared_data.h"

using namespace selvedge;
using test::square;
using test::Workshop;
namespace fs = std::filesystem;

namespace {

constexpr const char* extension = "SELVEDGE_materials_fabric";

const DressOptions everything{.all_cloth = true};

}  // namespace

TEST_CASE("dress: one metre of 5 x 4 mm takes 200 x 250 repeats, and twice that at scale 2") {
  for (const double scale : {1.0, 2.0}) {
    Workshop workshop;
    workshop.edit([&](Json& json) { json["nodes"][0]["scale"] = {scale, scale, scale}; });
    const Result<DressReport> report = workshop.dress({.materials = {"cloth 0"}});
    REQUIRE_MESSAGE(report.has_value(), to_line(report.error()));
    REQUIRE(report->materials.size() == 1);
    CHECK(report->materials[0].repeats.x == doctest::Approx(200 * scale).epsilon(1e-12));
    CHECK(report->materials[0].repeats.y == doctest::Approx(250 * scale).epsilon(1e-12));
    CHECK(report->materials[0].uv_size.metres_per_uv.x == doctest::Approx(scale));
    CHECK(report->materials[0].uv_size.stretched_fraction == 0);
    CHECK(report->warnings.empty());
    CHECK(report->bytes == fs::file_size(workshop.output));
    const Scene scene = test::need(read_scene(workshop.output));
    REQUIRE(scene.materials[0].fabric);
    CHECK(scene.materials[0].fabric->transform.scale.x == doctest::Approx(200 * scale));
    CHECK(scene.materials[0].base_color_texture.transform.scale.y == doctest::Approx(250 * scale));
    CHECK(scene.fabrics[0].bytes.size() == fs::file_size(workshop.fabric));
    CHECK(read_fabric(scene.fabrics[0].bytes, "embedded").has_value());
  }
}

TEST_CASE("dress: repeats that are given win over the physical size") {
  const Workshop workshop;
  const DressReport report = test::need(workshop.dress({.all_cloth = true, .repeats = V2d(7, 9)}));
  CHECK(report.materials[0].repeats == V2d(7, 9));
  CHECK(report.materials[0].uv_size.metres_per_uv.x == doctest::Approx(1));
}

TEST_CASE("dress: a garment in centimetres, or of a known height, gets its true size") {
  for (const bool by_height : {false, true}) {
    Workshop workshop;
    workshop.edit([&](Json& json) { json["nodes"][0]["scale"] = {100, 100, 100}; });
    DressOptions options = everything;
    if (by_height)
      options.garment_height = 1;
    else
      options.metres_per_unit = 0.01;
    const DressReport report = test::need(workshop.dress(options));
    CHECK(report.warnings.empty());
    CHECK(report.bounds.size().y == doctest::Approx(1));
    CHECK(report.materials[0].repeats.x == doctest::Approx(200).epsilon(1e-6));
    const Scene scene = test::need(read_scene(workshop.output));
    CHECK(bounds_of(scene).size().y == doctest::Approx(1));
  }
}

TEST_CASE("dress: the size is measured without strays, which are named, and without undressed materials") {
  Workshop workshop;
  workshop.edit([](Json& json) {
    // A copy of the cloth far away, in small, as a button and as cloth.
    for (const char* name : {"button", "scrap"}) {
      Json mesh = json["meshes"][0];
      mesh["name"] = name;
      mesh["primitives"][0]["material"] = name == std::string("button") ? 1 : 0;
      json["scenes"][0]["nodes"].push_back(json["nodes"].size());
      json["nodes"].push_back(
          {{"mesh", json["meshes"].size()}, {"scale", {0.01, 0.01, 0.01}}, {"translation", {0, 107, 0}}});
      json["meshes"].push_back(mesh);
    }
    json["materials"].push_back({{"name", "button"}});
  });
  for (const double height : {0.0, 2.0}) {
    DressOptions options = everything;
    if (height > 0) options.garment_height = height;
    const DressReport report = test::need(workshop.dress(options));
    CHECK(report.bounds.size().y == doctest::Approx(height > 0 ? height : 1));
    for (const std::string part :
         {"\"button/0\" of material \"button\"", "\"scrap/0\" of material \"cloth 0\""})
      CHECK(std::ranges::any_of(report.warnings, [&](const std::string& line) {
        return line.starts_with(part + " lies " + (height > 0 ? "21" : "10"));
      }));
  }
}

TEST_CASE("dress: primitives without texture coordinates do not cost the others theirs") {
  for (const bool printed : {false, true}) {
    for (const double part : {0.1, 1.0}) {  // of the side of the square
      Workshop workshop;
      workshop.edit([&](Json& json) {
        json["meshes"].push_back(json["meshes"][0]);
        json["meshes"][1]["primitives"][0]["attributes"].erase("TEXCOORD_0");
        json["scenes"][0]["nodes"].push_back(json["nodes"].size());
        json["nodes"].push_back({{"mesh", 1}, {"scale", {part, part, part}}});
        if (!printed) return;
        json["images"].push_back({{"uri", "none.png"}});
        json["textures"].push_back(Json::object({{"source", 0}}));
        json["materials"][0]["normalTexture"] = {{"index", 0}};
      });
      const DressReport report = test::need(workshop.dress(everything));
      const Scene scene = test::need(read_scene(workshop.output));
      CHECK(report.unwrap_reports.size() == (part < 1 ? 0 : 1));
      CHECK(scene.materials[0].fabric->tex_coord == (printed && part == 1 ? 1 : 0));
      for (const ScenePrimitive& p : scene.primitives) CHECK_FALSE(p.tex_coords[0].empty());
      if (printed || part < 1) CHECK(scene.primitives[1].tex_coords[0][0] == V2d(0, 0));
    }
  }
}

TEST_CASE("dress: the cloth is scaled, turned and moved") {
  const Workshop workshop;
  DressOptions options = everything;
  options.scale = 2;
  options.offset = V2d(0.25, 0.5);
  options.rotation_degrees = 90;
  REQUIRE(workshop.dress(options));
  const UvTransform transform = test::need(read_scene(workshop.output)).materials[0].fabric.value().transform;
  // Repeats of 5 x 4 mm lie on their side: 4 mm along u.
  CHECK(transform.scale.x == doctest::Approx(125));
  CHECK(transform.scale.y == doctest::Approx(100));
  CHECK(transform.rotation == doctest::Approx(1.5707963267948966));
  CHECK(transform.offset == V2d(0.25, 0.5));
  // A metre along u is a metre of courses.
  CHECK(std::abs(transform.apply_linear({1, 0}).y) == doctest::Approx(125));
  options.rotation_degrees = 30;
  CHECK(test::error_of(workshop.dress(options)).code == Code::option_out_of_range);
}

TEST_CASE(
    "dress: once, the middle of a repeat lies on the middle of the front, its corner on other materials'") {
  // A front, the inside of a back, a sleeve before both, and a collar; of the front, half faces aside.
  Garment garment = square(4);
  const auto lay = [&](int i, float side, float z, float u) {
    GarmentPrimitive& p = garment.primitives[i];
    p.material = i / 3;
    for (V3f& place : p.positions) place = place * side + V3f(0, 0, z);
    for (V2f& uv : p.tex_coords) uv = uv * side + V2f(u, 0);
  };
  lay(0, 1, 0.25F, 0);
  lay(1, 1, -0.25F, 2);
  lay(2, 0.5F, 0.75F, 4);
  lay(3, 0.25F, 0, 0);
  GarmentPrimitive& front = garment.primitives[0];
  front.positions.insert(front.positions.end(), {V3f(1, 0, -0.75F), V3f(1, 1, -0.75F)});
  front.normals.resize(6, V3f(1, 0, 0));
  front.tex_coords.insert(front.tex_coords.end(), {V2f(2, 1), V2f(2, 0)});
  front.indices.insert(front.indices.end(), {1, 4, 5, 1, 5, 2});
  const DressOptions turned{.all_cloth = true, .rotation_degrees = 90, .offset = V2d(0.25, 0)};
  struct Case {
    DressOptions options;
    bool is_vrm = false;
    V2d middle{0.5, 0.5};
    std::string remark = "3 of its 3 parts reach beyond the repeat of 0.005 x 0.004 m";
  };
  const std::vector<Case> cases{
      {everything},
      {turned, false, {0.5, 0.5}, "3 of its 3 parts reach beyond the repeat of 0.004 x 0.005 m"},
      {{.all_cloth = true, .scale = 1000},
       false,
       {0.5, 0.5},
       "1 of its 3 parts reach beyond the repeat of 5 x 4 m"},
      {{.all_cloth = true, .scale = 4000}, false, {0.5, 0.5}, ""},
      {{.all_cloth = true, .scale = 4000}, true, {1, 0.5}, ""},  // the largest, as none is seen from behind
  };
  for (Case each : cases) {
    Workshop workshop(garment);
    if (each.is_vrm) workshop.edit([](Json& json) { json["extensions"]["VRM"] = Json::object(); });
    each.options.lies_once = true;
    const DressReport report = test::need(workshop.dress(each.options));
    const Scene scene = test::need(read_scene(workshop.output));
    const auto place = [&](int material, const V2d& uv) {
      return scene.materials[material].fabric->transform.apply(uv) - each.options.offset;
    };
    CHECK((place(0, each.middle) - V2d(0.5, 0.5)).length() < 1e-3);
    CHECK(place(1, V2d(0.125, 0.125)).length() < 1e-3);
    const bool is_told = std::ranges::any_of(report.warnings, [&](const std::string& line) {
      return line.find(each.remark.empty() ? "beyond the repeat" : each.remark) != std::string::npos;
    });
    CHECK(is_told == !each.remark.empty());
  }
}

TEST_CASE("dress: stretched cloth is told by its fraction of the area") {
  const UvSize even = test::need(Workshop().dress(everything)).materials[0].uv_size;
  CHECK(even.stretched_fraction == 0);
  CHECK(even.metres_per_uv_p5 == even.metres_per_uv_p95);
  Garment sheared = square(1);
  for (V2f& uv : sheared.primitives[0].tex_coords) uv.x += uv.y;
  // u' = u + v: both axes are as long as their medians, but the diagonals 1.31 and 0.54 of them.
  const Workshop leaning(sheared);
  const DressReport report = test::need(leaning.dress(everything));
  CHECK(report.materials[0].uv_size.stretched_fraction == doctest::Approx(1));
  REQUIRE(report.warnings.size() == 1);
  CHECK(report.warnings[0].find("100 % of its area") != std::string::npos);
}

TEST_CASE("dress: primitives that disagree on the size are reported") {
  Garment garment = square(2);
  garment.primitives[1].material = 0;
  for (V2f& uv : garment.primitives[1].tex_coords)
    uv = uv * 0.5F + V2f(1, 0);  // two metres per unit, beside the other
  const Workshop workshop(garment);
  const Result<DressReport> report = workshop.dress({.materials = {"cloth 0"}});
  REQUIRE(report);
  CHECK(report->materials[0].primitive_count == 2);
  const UvSize& size = report->materials[0].uv_size;
  CHECK(size.metres_per_uv_p5 == V2d(1, 1));
  CHECK(size.metres_per_uv_p95 == V2d(2, 2));
  CHECK(size.stretched_fraction == doctest::Approx(0.5));
  CHECK(report->warnings.size() == 1);
}

TEST_CASE("dress: the fallback is a core material on the same UV set and transform") {
  const Workshop workshop;
  REQUIRE(workshop.dress(everything));
  const GltfDocument document = test::need(load_gltf(workshop.output));
  const Json& json = document.json;
  const Json& material = json["materials"][0];
  const Json& transform = material["extensions"][extension]["fabric"]["extensions"]["KHR_texture_transform"];
  CHECK(material["pbrMetallicRoughness"]["baseColorTexture"]["extensions"]["KHR_texture_transform"] ==
        transform);
  CHECK(material["pbrMetallicRoughness"]["metallicFactor"] == 0);
  CHECK(material["pbrMetallicRoughness"]["roughnessFactor"] == 1);
  CHECK(material["extensions"]["KHR_materials_specular"]["specularFactor"] == 0);
  CHECK(material["alphaMode"] == "MASK");  // a sixteenth of the net is holes
  CHECK(material["alphaCutoff"] == 0.5);
  CHECK(material["doubleSided"] == true);
  CHECK(json["extensions"][extension]["fabrics"][0]["mimeType"] == "image/x-exr");
  CHECK_FALSE(json.contains("extensionsRequired"));
  for (const Json& texture : json["textures"]) {
    const Json& sampler = json["samplers"][texture["sampler"].get<std::size_t>()];
    CHECK(sampler["wrapS"] == 10497);
    CHECK(sampler["minFilter"] == 9987);
  }
}

TEST_CASE("dress: what the fallback replaces goes and the rest stays") {
  Workshop workshop;
  workshop.edit([](Json& json) {
    json["extensionsUsed"] = {"KHR_materials_sheen", "KHR_materials_emissive_strength", "X_other"};
    json["materials"][0]["emissiveFactor"] = {1, 0, 0};
    json["materials"][0]["extras"] = {{"note", 1}};
    json["materials"][0]["extensions"] = {{"KHR_materials_clearcoat", {{"clearcoatFactor", 1}}},
                                          {"KHR_materials_emissive_strength", {{"emissiveStrength", 2}}},
                                          {"X_other", {{"a", 1}}}};
  });
  REQUIRE(workshop.dress(everything));
  const GltfDocument document = test::need(load_gltf(workshop.output));
  const Json& material = document.json["materials"][0];
  CHECK_FALSE(material["extensions"].contains("KHR_materials_clearcoat"));
  CHECK(material["extensions"]["KHR_materials_emissive_strength"]["emissiveStrength"] == 2);
  CHECK(material["extensions"]["X_other"]["a"] == 1);
  CHECK(material["emissiveFactor"] == Json({1, 0, 0}));
  CHECK(material["extras"] == Json({{"note", 1}}));
}

TEST_CASE("dress: without the fallback the core material is left as it was") {
  const Workshop workshop;
  DressOptions options = everything;
  options.has_fallback = false;
  const Json before = load_gltf(workshop.garment)->json["materials"][0];
  REQUIRE(workshop.dress(options));
  Json after = load_gltf(workshop.output)->json["materials"][0];
  CHECK(after.contains("extensions"));
  after.erase("extensions");
  CHECK(after == before);
  // Extensions that may not stand beside a fabric go all the same.
  Workshop old;
  old.edit([](Json& json) {
    json["extensionsUsed"] = {"KHR_materials_unlit", "KHR_materials_pbrSpecularGlossiness"};
    for (const Json& name : json["extensionsUsed"]) json["materials"][0]["extensions"][name] = Json::object();
  });
  CHECK(test::need(old.dress(options)).materials[0].replaced_members.size() == 2);
  CHECK_FALSE(has_error(check_gltf(old.output)));
}

TEST_CASE("dress: a fabric beside the glTF is referred to from the output's folder") {
  const Workshop workshop;
  fs::create_directories(workshop.folder.path() / "out");
  const std::string output = workshop.folder / "out/dressed.gltf";
  const DressReport report = test::need(dress(workshop.garment, workshop.fabric, output, everything));
  CHECK_FALSE(report.embedded);
  REQUIRE(report.warnings.size() == 1);
  CHECK(report.warnings[0].find("../net.exr: lies outside of the document's folder") != std::string::npos);
  const SceneLimits anywhere{.document = {.external_files = ExternalFiles::anywhere}};
  const GltfDocument document = test::need(load_gltf(output, anywhere.document));
  CHECK(document.json["extensions"][extension]["fabrics"][0]["uri"] == "../net.exr");
  CHECK(test::error_of(read_scene(output)).code == Code::gltf_reference);
  const Scene scene = test::need(read_scene(output, anywhere));
  CHECK(fs::equivalent(scene.fabrics[0].path, workshop.fabric));
}

TEST_CASE("dress: dressing again replaces the reference and makes nothing twice") {
  Workshop workshop;
  REQUIRE(workshop.dress(everything));
  const Json once = load_gltf(workshop.output)->json;
  const std::string again = workshop.folder / "again.glb";
  REQUIRE(dress(workshop.output, workshop.fabric, again, {.all_cloth = true, .repeats = V2d(3, 3)}));
  const Json twice = load_gltf(again)->json;
  CHECK(twice["extensions"] == once["extensions"]);
  CHECK(twice["textures"] == once["textures"]);
  CHECK(twice["images"].size() == once["images"].size());
  CHECK(twice["materials"][0]["extensions"][extension]["fabric"]["extensions"]["KHR_texture_transform"]
             ["scale"] == Json({3.0, 3.0}));
}

TEST_CASE("dress: a fabric that nothing wears any more leaves the file, even a damaged one") {
  Workshop workshop;
  const std::string other = workshop.folder / "other.exr";
  REQUIRE(write_fabric(other, test::net_fabric(V2d(3, 3))));
  REQUIRE(workshop.dress(everything));
  const std::string again = workshop.folder / "again.glb";
  const auto fabrics_of_again = [&] { return test::need(read_scene(again)).fabrics; };
  REQUIRE(dress(workshop.output, other, again, everything));
  REQUIRE(fabrics_of_again().size() == 1);
  CHECK(fabrics_of_again()[0].bytes.size() == fs::file_size(other));
  CHECK(fs::file_size(again) < fs::file_size(workshop.output) + fs::file_size(other));
  // The one of two stays that a variant wears.
  REQUIRE(dress(workshop.garment, workshop.fabric, workshop.output,
                {.all_cloth = true, .colourways = {{.name = "other", .fabric = other}}}));
  REQUIRE(dress(workshop.output, other, again, everything));
  const Scene scene = test::need(read_scene(again));
  for (const SceneMaterial& material : scene.materials)
    if (material.fabric) CHECK(material.fabric->fabric < static_cast<int>(scene.fabrics.size()));
}

TEST_CASE("dress: materials are found by name, all of that name, or by number") {
  Garment garment = square(3);
  garment.materials[1] = garment.materials[0];
  const Workshop workshop(garment);
  const Result<DressReport> by_name = workshop.dress({.materials = {"cloth 0"}});
  REQUIRE(by_name);
  CHECK(by_name->materials.size() == 2);
  const Result<DressReport> by_number = workshop.dress({.materials = {"#2"}});
  REQUIRE(by_number);
  CHECK(by_number->materials[0].name == "cloth 2");
  const Result<DressReport> missing = workshop.dress({.materials = {"sleeve"}});
  REQUIRE_FALSE(missing);
  CHECK(missing.error().code == Code::material_missing);
  CHECK(missing.error().message.find("#2 \"cloth 2\"") != std::string::npos);
  CHECK(workshop.dress({}).error().code == Code::material_missing);
}

TEST_CASE("dress: a material that is worn in a variant only is dressed") {
  Workshop workshop(square(2));
  workshop.edit([](Json& json) {
    json["extensionsUsed"] = {"KHR_materials_variants"};
    json["extensions"]["KHR_materials_variants"]["variants"] = {{{"name", "day"}}, {{"name", "night"}}};
    json["meshes"][0]["primitives"].erase(1);
    json["meshes"][0]["primitives"][0]["extensions"]["KHR_materials_variants"]["mappings"] = {
        {{"material", 0}, {"variants", {0}}}, {{"material", 1}, {"variants", {1}}}};
  });
  const Result<DressReport> report = workshop.dress({.materials = {"cloth 1"}});
  REQUIRE_MESSAGE(report.has_value(), to_line(report.error()));
  CHECK(report->materials[0].primitive_count == 1);
  CHECK(report->materials[0].repeats.x == doctest::Approx(200));
  const Json json = load_gltf(workshop.output)->json;
  CHECK(json["materials"][1]["extensions"].contains(extension));
  CHECK_FALSE(json["materials"][0].contains("extensions"));
  const Json& primitive = json["meshes"][0]["primitives"][0];
  CHECK(primitive["extensions"]["KHR_materials_variants"]["mappings"].size() == 2);
}

TEST_CASE("dress: triangles without a material get one when all are dressed") {
  Workshop workshop;
  workshop.edit([](Json& json) {
    json.erase("materials");
    json["meshes"][0]["primitives"][0].erase("material");
  });
  const DressReport report = test::need(workshop.dress(everything));
  CHECK(report.materials[0].name == "fabric");
}

TEST_CASE("dress: bad input is one error and no output") {
  Workshop workshop;
  const auto refused = [&](const DressOptions& options) {
    const Error error = test::error_of(workshop.dress(options));
    CHECK_FALSE(fs::exists(workshop.output));
    CHECK(to_line(error).find('\n') == std::string::npos);
    return error.code;
  };
  CHECK(refused({.all_cloth = true, .unwrap = Unwrapping::never, .tex_coord = 1}) == Code::garment_no_uvs);
  CHECK(refused({.all_cloth = true, .repeats = V2d(0, 1)}) == Code::option_out_of_range);
  CHECK(refused({.all_cloth = true, .tex_coord = 2}) == Code::option_out_of_range);
  const std::string garment = workshop.garment;
  workshop.garment = workshop.folder / "none.glb";
  CHECK(refused(everything) == Code::file_missing);
  workshop.garment = garment;
  workshop.edit([](Json& json) { json["meshes"][0]["primitives"][0]["attributes"].erase("TEXCOORD_0"); });
  CHECK(refused({.materials = {"cloth 0"}, .unwrap = Unwrapping::never}) == Code::garment_no_uvs);
  const std::string fabric = workshop.fabric;
  workshop.fabric = workshop.folder / "none.exr";
  CHECK(refused(everything) == Code::file_missing);
}

TEST_CASE("dress: a node whose transform overflows is refused, also if its mesh stays as it is") {
  Workshop workshop;
  workshop.edit([](Json& json) {
    json["meshes"].push_back(json["meshes"][0]);
    json["meshes"][1]["primitives"][0].erase("material");
    json["nodes"].push_back({{"mesh", 1}, {"scale", {1e308, 1e308, 1e308}}});
    json["nodes"].push_back({{"children", {1}}, {"scale", {1e308, 1e308, 1e308}}});
    json["scenes"][0]["nodes"].push_back(2);
  });
  CHECK(test::error_of(workshop.dress({.materials = {"cloth 0"}})).code == Code::mesh_not_finite);
}

TEST_CASE("dress: what strangers' garments look like is kept, or told to be lost") {
  const std::string data = test::shared_data("wild4/");
  if (data.empty()) return;
  struct Case {
    const char* file;
    std::vector<std::string> kept;
    const char* remark = "";
    int tex_coord = 0;
  };
  const std::vector<std::string> print{"tintTexture"};
  const std::vector<std::string> colours{"COLOR_0"};
  for (const Case& item :
       {Case{"maya-kd0.obj", print}, Case{"gap-in-vt.obj", print, "missing on 14 % of its area", 1},
        Case{"specgloss.glb", print}, Case{"vertex-colours.glb", colours},
        Case{"05-vertex-colours.obj", colours},
        Case{"missing-mtl.obj", {}, "mtllib: nowhere.mtl: no such file"},
        Case{"missing-picture.gltf", {}, "/images/0: textures/nowhere.png: no such file"},
        Case{"backslash.gltf", print, "\"textures/print.png\" is read"},
        Case{"stray-button.glb", {}, "\"mesh 0/0\" of material \"button\" lies 107 m from the rest"}}) {
    CAPTURE(item.file);
    Workshop workshop;
    workshop.garment = data + item.file;
    const DressReport report = test::need(workshop.dress(everything));
    CHECK(report.materials[0].kept_members == item.kept);
    CHECK((*item.remark == '\0' || std::ranges::any_of(report.warnings, [&](const std::string& line) {
      return line.find(item.remark) != std::string::npos;
    })));
    CHECK(report.bounds.size().length() < 1);
    const Scene scene = test::need(read_scene(workshop.output));
    const SceneMaterial& cloth = scene.materials[report.materials[0].index];
    CHECK(cloth.fabric->tex_coord == item.tex_coord);
    CHECK(cloth.garment_textures.tint.x == doctest::Approx(item.kept.empty() ? 1 : 1 / 0.3).epsilon(1e-3));
    CHECK((cloth.garment_textures.tint_texture.image >= 0) == (item.kept == print));
    CHECK(scene.primitives.back().colors.empty() == (item.kept != colours));
  }
}

TEST_CASE("dress --all: what strangers' garments wear, and why the rest does not") {
  const std::string data = test::shared_data("wild5/");
  if (data.empty()) return;
  struct Case {
    const char* file;
    std::vector<int> dressed;
    const char* remark;
    bool double_sided = true;
  };
  for (const Case& item :
       {Case{"soldier-visor.glb", {0}, "a \"visor\" is no cloth"},
        Case{"body-and-brows.glb", {}, "nothing is cloth: material #0 \"Skin\""},
        Case{"blend-texture-alpha-043.glb", {0}, "its alpha of 0.43 is not kept"},
        Case{"coincident-single-sided.glb", {0}, "is single-sided: other triangles lie on its back", false},
        Case{"hidden-node.glb", {0}, "nodes that KHR_node_visibility hides are left out"},
        Case{"makehuman-dm.obj", {0}, "true size (0.65 m in dm, 1.98 m in foot)"},
        Case{"backdrop-plane.glb", {0}, "it is a flat rectangle, much larger than the rest"},
        Case{"avif-only.glb", {0}, "baseColorTexture of \"Cloth\" is AVIF"},
        Case{"control/print-tube.glb", {0}, ""}}) {
    CAPTURE(item.file);
    Workshop workshop;
    workshop.garment = data + item.file;
    const Result<DressReport> report = workshop.dress(everything);
    const std::vector<std::string> said =
        report ? report->warnings : std::vector<std::string>{to_line(report.error())};
    CHECK((*item.remark == '\0' ? said.empty() : std::ranges::any_of(said, [&](const std::string& line) {
      return line.find(item.remark) != std::string::npos;
    })));
    REQUIRE(report.has_value() == !item.dressed.empty());
    if (!report) continue;
    std::vector<int> dressed;
    for (const DressedMaterial& material : report->materials) dressed.push_back(material.index);
    CHECK(dressed == item.dressed);
    const SceneMaterial cloth = test::need(read_scene(workshop.output)).materials[0];
    CHECK(cloth.double_sided == item.double_sided);
    CHECK(cloth.garment_textures.mask.image == -1);
  }
}

TEST_CASE("dress: a print that only others can read stays for them, or leaves with its extension") {
  for (const bool kept : {true, false}) {
    Workshop workshop;
    workshop.edit([](Json& json) {
      json["images"] = {{{"uri", "data:image/ktx2;base64,q0tUWCAyMLsNChoK"}, {"mimeType", "image/ktx2"}}};
      json["textures"] = Json::parse(R"([{"extensions": {"KHR_texture_basisu": {"source": 0}}}])");
      json["extensionsUsed"] = json["extensionsRequired"] = {"KHR_texture_basisu"};
      json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = {{"index", 0}};
    });
    const DressReport report =
        test::need(workshop.dress({.all_cloth = true, .color_options = {.keeps_base_color = kept}}));
    CHECK(report.warnings[0].find("KTX2, which is not read: gltf-transform") != std::string::npos);
    const Json json = test::need(load_gltf(workshop.output)).json;
    CHECK(json.contains("extensionsRequired") == kept);
    const Json& shown = json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["index"];
    CHECK(json["textures"][shown.get<std::size_t>()].contains("extensions") == kept);
  }
}

TEST_CASE("dress: single-sided sheets stay so that lie back to back, however they are cut into triangles") {
  for (const auto& [distance, back, single] :
       {std::tuple(0.0F, std::vector<unsigned>{0, 2, 1, 0, 3, 2}, true),
        {1e-4F, {0, 3, 1, 1, 3, 2}, true},
        {1e-3F, {0, 2, 1, 0, 3, 2}, false},
        {0.0F, {0, 1, 2, 0, 2, 3}, false}}) {
    Garment garment = square(2);
    for (V3f& position : garment.primitives[1].positions) position.z -= distance;
    garment.primitives[1].indices = back;
    Workshop workshop(garment);
    workshop.edit([](Json& json) {
      for (Json& material : json["materials"]) material.erase("doubleSided");
    });
    REQUIRE(workshop.dress(everything));
    for (const SceneMaterial& material : test::need(read_scene(workshop.output)).materials)
      CHECK(material.double_sided == !single);
  }
}

TEST_CASE("true size: a document without scenes is scaled as one with them") {
  const Workshop workshop;
  GltfDocument document = test::need(load_gltf(workshop.garment));
  document.json.erase("scenes");
  document.json.erase("scene");
  REQUIRE(scale_garment(document, 0.01));
  CHECK_FALSE(document.json.contains("scenes"));
  CHECK(bounds_of(test::need(read_scene(document))).size().y == doctest::Approx(0.01));
}

TEST_CASE("true size: scenes that share nodes are all scaled, and no node gets two parents") {
  const Workshop workshop;
  GltfDocument document = test::need(load_gltf(workshop.garment));
  const int shared = document.json["scenes"][0]["nodes"][0];
  const auto count = static_cast<int>(document.json["nodes"].size());
  document.json["nodes"].push_back({{"name", "alone"}});
  document.json["scenes"] = Json::parse("[{},{},{},{}]");
  document.json["scenes"][0]["nodes"] = {shared, count};
  document.json["scenes"][1]["nodes"] = {shared};
  document.json["scenes"][3]["nodes"] = {count, shared};
  REQUIRE(scale_garment(document, 0.01));
  std::map<int, int> parents;
  for (const Json& node : document.json["nodes"])
    for (const Json& child : array_member(node, "children")) ++parents[child.get<int>()];
  CHECK(parents == std::map<int, int>{{shared, 1}, {count, 1}});
  CHECK_FALSE(document.json["scenes"][2].contains("nodes"));
  for (const char* scene : {"0", "1", "3"})
    CHECK(bounds_of(test::need(read_scene(document, {}, {scene, ""}))).size().y == doctest::Approx(0.01));
}

TEST_CASE("true size: a scene that lists the child of a node is refused") {
  const Workshop workshop;
  GltfDocument document = test::need(load_gltf(workshop.garment));
  const int root = document.json["scenes"][0]["nodes"][0];
  document.json["nodes"].push_back({{"children", {root}}});
  const Error error = test::error_of(scale_garment(document, 0.01));
  CHECK(error.code == Code::gltf_malformed);
  CHECK(error.place == "/scenes/0/nodes/0");
}

TEST_CASE("true size: advice names the unit if only one makes a garment as long as garments are") {
  for (const auto& [longest, advice] : {std::pair(0.0, ""),
                                        {0.25, ""},
                                        {0.7, ""},
                                        {2.29, ""},
                                        {425.0, "--unit mm makes that 0.425 m"},
                                        {150.0, "--unit cm makes that 1.5 m"},
                                        {60.0, "(0.6 m in cm, 1.52 m in inch)"},
                                        {7.5, "--unit dm makes that 0.75 m"},
                                        {6.5, "(0.65 m in dm, 1.98 m in foot)"},
                                        {0.058, "--height METRES"},
                                        {9e9, "--height METRES"}}) {
    CAPTURE(longest);
    const std::string told = size_advice(V3d(longest / 2, longest, 0));
    CHECK(told.empty() == (*advice == '\0'));
    CHECK(told.find(advice) != std::string::npos);
  }
}
