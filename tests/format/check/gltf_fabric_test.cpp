// The rules of SELVEDGE_materials_fabric; the rules of glTF itself: gltf_check_test.cpp.
#include <doctest/doctest.h>

#include <algorithm>

#include "format/base/atomic_file.h"
#include "format/check/gltf.h"
#include "format/fabric/file.h"
#include "format/gltf/read_scene.h"
#include "tests/converter/fabrics.h"
#include "tests/format/gltf_square.h"
#include "tests/require.h"

using namespace selvedge;
using namespace selvedge::test;

TEST_CASE("gltf check: a dressed file with a complete fallback has no issues") {
  const Folder folder;
  REQUIRE(write_fabric(folder / "the net.exr", net_fabric()));
  Square square;
  square.dress();
  CHECK(text_of(check(folder, square)) == "");
  // Extras that `dress` wrote in the past mean nothing.
  square.material()["extras"]["SELVEDGE_materials_fabric"] = {{"index", 7}, {"uri", "../none.exr"}};
  CHECK(text_of(check(folder, square)) == "");
}

TEST_CASE("gltf check: each broken rule of SELVEDGE_materials_fabric is named where it stands") {
  const Folder folder;
  REQUIRE(write_fabric(folder / "the net.exr", net_fabric()));
  const char* fabrics = "/extensions/SELVEDGE_materials_fabric/fabrics";
  const char* fabric = "/materials/0/extensions/SELVEDGE_materials_fabric/fabric";
  const std::string entry = std::string(fabrics) + "/0";
  const std::string mime = entry + "/mimeType";
  const std::string name = entry + "/name";
  const std::string uri = entry + "/uri";
  const std::string view = entry + "/bufferView";
  const std::string index = std::string(fabric) + "/index";
  const std::string set = std::string(fabric) + "/texCoord";
  const std::string base_color = "/materials/0/pbrMetallicRoughness/baseColorTexture";
  const std::string transform = std::string(fabric) + "/extensions/KHR_texture_transform";
  const std::string scale = transform + "/scale";
  const std::string rotation = transform + "/rotation";
  const std::string offset = transform + "/offset";
  // Of the fabric and its fallback.
  const auto place_all = [&](Square& s, const char* member, const Json& value) {
    for (const std::string& owner : {std::string(fabric), base_color}) {
      s.json[Json::json_pointer(owner)]["extensions"]["KHR_texture_transform"][member] = value;
    }
  };
  const auto embed = [](Square& s, int number) {
    s.root_fabrics()[0].erase("uri");
    s.root_fabrics()[0]["bufferView"] = number;
  };
  check_cases(
      folder,
      {
          {"not in extensionsUsed", [](Square& s) { s.json["extensionsUsed"] = {"KHR_texture_transform"}; },
           Code::gltf_extension, "/extensionsUsed"},
          {"in extensionsRequired",
           [](Square& s) { s.json["extensionsRequired"] = {"SELVEDGE_materials_fabric"}; },
           Code::gltf_extension, "/extensionsRequired"},
          {"item that is no object", [](Square& s) { s.root_fabrics().push_back(3); }, Code::gltf_extension,
           "/extensions/SELVEDGE_materials_fabric/fabrics/1"},
          {"both uri and bufferView", [](Square& s) { s.root_fabrics()[0]["bufferView"] = 0; },
           Code::gltf_extension, entry.c_str()},
          {"neither", [](Square& s) { s.root_fabrics()[0].erase("uri"); }, Code::gltf_extension,
           entry.c_str()},
          {"mimeType", [](Square& s) { s.root_fabrics()[0]["mimeType"] = "image/png"; }, Code::gltf_extension,
           mime.c_str()},
          {"name", [](Square& s) { s.root_fabrics()[0]["name"] = 3; }, Code::gltf_extension, name.c_str()},
          {"uri", [](Square& s) { s.root_fabrics()[0]["uri"] = 3; }, Code::gltf_extension, uri.c_str()},
          {"bufferView", [&](Square& s) { embed(s, 99); }, Code::gltf_accessor, view.c_str()},
          {"fabric that is no object",
           [](Square& s) { s.at("/materials/0/extensions/SELVEDGE_materials_fabric")["fabric"] = 0; },
           Code::gltf_extension, index.c_str()},
          {"fabric missing",
           [](Square& s) { s.at("/materials/0/extensions/SELVEDGE_materials_fabric").erase("fabric"); },
           Code::gltf_extension, index.c_str()},
          {"index", [&](Square& s) { s.json[Json::json_pointer(fabric)]["index"] = 1; }, Code::gltf_extension,
           index.c_str()},
          {"index missing", [&](Square& s) { s.json[Json::json_pointer(fabric)].erase("index"); },
           Code::gltf_extension, index.c_str()},
          {"texCoord", [&](Square& s) { s.json[Json::json_pointer(fabric)]["texCoord"] = -1; },
           Code::gltf_extension, set.c_str()},
          {"unlit",
           [](Square& s) {
             s.json["extensionsUsed"].push_back("KHR_materials_unlit");
             s.material()["extensions"]["KHR_materials_unlit"] = Json::object();
           },
           Code::gltf_extension, "/materials/0/extensions/KHR_materials_unlit"},
          {"missing file", [](Square& s) { s.root_fabrics()[0]["uri"] = "a%20net.exr"; },
           Code::gltf_reference, uri.c_str()},
          {"scale 0",
           [&](Square& s) {
             place_all(s, "scale", {20, 0});
           },
           Code::gltf_extension, scale.c_str()},
          {"scale that is 0 as a float",
           [&](Square& s) {
             place_all(s, "scale", {1e-300, 20});
           },
           Code::gltf_extension, scale.c_str()},
          {"scale beyond floats",
           [&](Square& s) {
             place_all(s, "scale", {20, -1e300});
           },
           Code::gltf_extension, scale.c_str()},
          {"rotation beyond floats", [&](Square& s) { place_all(s, "rotation", 1e300); },
           Code::gltf_extension, rotation.c_str()},
          {"offset beyond floats",
           [&](Square& s) {
             place_all(s, "offset", {0, 1e39});
           },
           Code::gltf_extension, offset.c_str()},
      },
      true);
  Square square;
  square.dress();
  square.at("/extensions/SELVEDGE_materials_fabric").erase("fabrics");
  const Issues issues = check(folder, square);
  REQUIRE(issues.size() == 2);  // and the reference into it
  CHECK(issues[1].place == fabrics);
  square.at("/extensions/SELVEDGE_materials_fabric")["fabrics"] = Json::array();
  CHECK(check(folder, square)[1].place == fabrics);
}

TEST_CASE(
    "gltf check: a fabric without its UV set is an error, on a primitive's own material and in a variant") {
  const Folder folder;
  REQUIRE(write_fabric(folder / "the net.exr", net_fabric()));
  for (const bool variant : {false, true}) {
    CAPTURE(variant);
    Square square;
    square.dress();
    if (variant) square.wear_variants();
    Json& material = square.at(variant ? "/materials/1" : "/materials/0");
    material["pbrMetallicRoughness"].erase("baseColorTexture");
    material["extensions"]["SELVEDGE_materials_fabric"]["fabric"]["texCoord"] = 1;
    const Issues issues = check(folder, square);
    INFO(text_of(issues));
    REQUIRE(issues.size() == 2);
    CHECK(issues[0].code == Code::garment_no_uvs);
    CHECK(issues[0].place == "/meshes/0/primitives/0/attributes");
    CHECK(issues[1].code == Code::gltf_fallback);  // no base colour
  }
}

TEST_CASE("gltf check: what a consumer would see wrongly is a warning") {
  const Folder folder;
  REQUIRE(write_fabric(folder / "the net.exr", net_fabric()));
  REQUIRE(write_fabric(folder / "cloth.exr", lambert_fabric(V2d(5, 4), 4, V3f(0.5F))));
  const auto wrap = [](Square& s, const char* axis, int mode) {
    s.json["samplers"] = Json::array({{{axis, mode}}});
    s.at("/textures/0")["sampler"] = 0;
  };
  const auto whole = [](Square& s) { s.root_fabrics()[0]["uri"] = "cloth.exr"; };
  check_cases(
      folder,
      {
          {"no base colour",
           [](Square& s) { s.at("/materials/0/pbrMetallicRoughness").erase("baseColorTexture"); },
           Code::gltf_fallback, "/materials/0/pbrMetallicRoughness"},
          {"metal", [](Square& s) { s.at("/materials/0/pbrMetallicRoughness").erase("metallicFactor"); },
           Code::gltf_fallback, "/materials/0/pbrMetallicRoughness/metallicFactor"},
          {"cutoff", [](Square& s) { s.material()["alphaCutoff"] = 0.25; }, Code::gltf_fallback,
           "/materials/0/alphaCutoff"},
          {"OPAQUE with holes", [](Square& s) { s.material().erase("alphaMode"); }, Code::gltf_alpha,
           "/materials/0/alphaMode"},
          {"BLEND with holes", [](Square& s) { s.material()["alphaMode"] = "BLEND"; }, Code::gltf_fallback,
           "/materials/0/alphaMode"},
          {"BLEND without holes",
           [&](Square& s) {
             whole(s);
             s.material()["alphaMode"] = "BLEND";
           },
           Code::gltf_alpha, "/materials/0/alphaMode"},
          {"another scale",
           [](Square& s) {
             s.at(
                 "/materials/0/pbrMetallicRoughness/baseColorTexture/extensions/KHR_texture_transform/scale/"
                 "0") = 21;
           },
           Code::gltf_transform, "/materials/0/pbrMetallicRoughness/baseColorTexture"},
          {"another UV set of a texture that is not the base colour",
           [](Square& s) {
             s.at("/materials/0/pbrMetallicRoughness")["metallicRoughnessTexture"] = {{"index", 0}};
           },
           Code::gltf_transform, "/materials/0/pbrMetallicRoughness/metallicRoughnessTexture"},
          {"another transform of the sheen",
           [](Square& s) {
             s.json["extensionsUsed"].push_back("KHR_materials_sheen");
             s.material()["extensions"]["KHR_materials_sheen"]["sheenColorTexture"] = {{"index", 0}};
           },
           Code::gltf_transform, "/materials/0/extensions/KHR_materials_sheen/sheenColorTexture"},
          {"clamped fallback", [&](Square& s) { wrap(s, "wrapS", 33071); }, Code::gltf_fallback,
           "/materials/0/pbrMetallicRoughness/baseColorTexture"},
          {"mirrored fallback", [&](Square& s) { wrap(s, "wrapT", 33648); }, Code::gltf_fallback,
           "/materials/0/pbrMetallicRoughness/baseColorTexture"},
          {"single-sided", [](Square& s) { s.material().erase("doubleSided"); }, Code::gltf_advice,
           "/materials/0/doubleSided"},
          {"single-sided variant",
           [](Square& s) {
             s.wear_variants();
             s.at("/materials/1")["doubleSided"] = false;
           },
           Code::gltf_advice, "/materials/1/doubleSided"},
          {"no normals",
           [](Square& s) {
             s.primitive()["attributes"].erase("NORMAL");
             s.primitive()["attributes"].erase("TANGENT");
           },
           Code::gltf_advice, "/meshes/0/primitives/0/attributes"},
          {"on nothing", [](Square& s) { s.primitive().erase("material"); }, Code::gltf_advice,
           "/materials/0"},
      },
      true);
}

TEST_CASE("gltf check: issues of a fabric say which fabric, embedded or beside") {
  const Folder folder;
  REQUIRE(write_fabric(folder / "net.exr", net_fabric()));
  std::string fabric = *read_file(folder / "net.exr");
  Square square;
  square.dress();
  fabric[fabric.size() - 40] = static_cast<char>(fabric[fabric.size() - 40] ^ 1);
  write_bytes(folder / "the net.exr", fabric);
  Issues issues = check(folder, square);
  REQUIRE_FALSE(issues.empty());
  CHECK(issues[0].file == folder / "the net.exr");

  square.bytes.resize((square.bytes.size() + 3) / 4 * 4);
  square.json["bufferViews"].push_back(
      {{"buffer", 0}, {"byteOffset", square.bytes.size()}, {"byteLength", fabric.size()}});
  square.bytes += fabric;
  square.json["buffers"][0]["byteLength"] = square.bytes.size();
  square.root_fabrics()[0].erase("uri");
  square.root_fabrics()[0]["bufferView"] = 6;
  issues = check(folder, square);
  REQUIRE_FALSE(issues.empty());
  for (const Error& issue : issues) {
    CHECK(issue.file == folder / "case.glb");
    CHECK(issue.place.starts_with("/extensions/SELVEDGE_materials_fabric/fabrics/0"));
  }
  square.at("/bufferViews/6")["byteStride"] = 4;
  issues = check(folder, square);
  const bool named = std::any_of(issues.begin(), issues.end(), [](const Error& issue) {
    return issue.code == Code::gltf_extension && issue.place.ends_with("/fabrics/0/bufferView");
  });
  CHECK(named);
}

TEST_CASE(
    "gltf check: what stands beside the fabric may lie otherwise, and textures may repeat in so many words") {
  const Folder folder;
  REQUIRE(write_fabric(folder / "the net.exr", net_fabric()));
  Square square;
  square.dress();
  square.json["samplers"] = Json::parse(R"([{"wrapS":10497,"wrapT":10497},{"wrapS":33071,"wrapT":33648}])");
  square.at("/textures/0")["sampler"] = 0;
  square.json["textures"].push_back({{"source", 0}, {"sampler", 1}});
  square.material()["occlusionTexture"] = {{"index", 1}};
  square.material()["emissiveTexture"] = {{"index", 1}};
  CHECK(text_of(check(folder, square)) == "");
}

TEST_CASE("gltf check: what is an error of the transform is not read either") {
  const Folder folder;
  const char* place =
      "/materials/0/extensions/SELVEDGE_materials_fabric/fabric/extensions/KHR_texture_transform";
  Square square;
  square.dress();
  check(folder, square);
  CHECK(read_scene(folder / "case.glb").has_value());
  square.at(place)["scale"] = {0, 25};
  check(folder, square);
  const Error error = test::error_of(read_scene(folder / "case.glb"));
  CHECK(error.code == Code::gltf_extension);
  CHECK(error.place == std::string(place) + "/scale");
}
