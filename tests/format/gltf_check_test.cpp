#include "format/gltf_check.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <functional>
#include <limits>

#include "format/atomic_file.h"
#include "format/fabric_exr.h"
#include "format/gltf_scene.h"
#include "tests/converter/fabrics.h"
#include "tests/format/gltf_fixtures.h"

using namespace selvedge;
using test::Folder;

namespace {

/// A square of two triangles with all attributes that a fabric wants, as JSON to be broken, and its bytes.
struct Square {
  Json json;
  std::string bytes;

  Square() {
    bytes = test::bytes_of<float>({0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0}) +
            test::bytes_of<float>({0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1}) +
            test::bytes_of<float>({1, 0, 0, 1, 1, 0, 0, 1, 1, 0, 0, 1, 1, 0, 0, 1}) +
            test::bytes_of<float>({0, 1, 1, 1, 1, 0, 0, 0}) +
            test::bytes_of<std::uint16_t>({0, 1, 2, 0, 2, 3});
    json = Json::parse(R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],
      "meshes":[{"primitives":[{"attributes":{"POSITION":0,"NORMAL":1,"TANGENT":2,"TEXCOORD_0":3},
                                "indices":4,"material":0}]}],
      "materials":[{"name":"cloth"}],
      "accessors":[{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3","min":[0,0,0],"max":[1,1,0]},
                   {"bufferView":1,"componentType":5126,"count":4,"type":"VEC3"},
                   {"bufferView":2,"componentType":5126,"count":4,"type":"VEC4"},
                   {"bufferView":3,"componentType":5126,"count":4,"type":"VEC2"},
                   {"bufferView":4,"componentType":5123,"count":6,"type":"SCALAR"}],
      "bufferViews":[{"buffer":0,"byteOffset":0,"byteLength":48,"target":34962},
                     {"buffer":0,"byteOffset":48,"byteLength":48,"target":34962},
                     {"buffer":0,"byteOffset":96,"byteLength":64,"target":34962},
                     {"buffer":0,"byteOffset":160,"byteLength":32,"target":34962},
                     {"buffer":0,"byteOffset":192,"byteLength":12,"target":34963}],
      "buffers":[{"byteLength":204}]})");
  }

  template <class T>
  void put(std::size_t at, T value) {
    std::memcpy(bytes.data() + at, &value, sizeof value);
  }

  /// Refers to a fabric file, with a complete fallback (whose texture is a PNG header).
  void dress() {
    const std::string png("\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\0\1\0\0\0\1\10\2\0\0\0\0\0\0\0", 33);
    json["bufferViews"].push_back({{"buffer", 0}, {"byteOffset", 204}, {"byteLength", png.size()}});
    bytes += png;
    json["buffers"][0]["byteLength"] = bytes.size();
    json["images"] = Json::array({{{"bufferView", 5}, {"mimeType", "image/png"}}});
    json["textures"] = Json::array({{{"source", 0}}});
    json["extensionsUsed"] = {"SELVEDGE_materials_fabric", "KHR_texture_transform"};
    json["extensions"]["SELVEDGE_materials_fabric"]["fabrics"] =
        Json::parse(R"([{"name":"net","mimeType":"image/x-exr","uri":"the%20net.exr"}])");
    json["materials"][0] = Json::parse(R"({"name":"cloth","alphaMode":"MASK",
      "pbrMetallicRoughness":{"metallicFactor":0,"baseColorTexture":{"index":0,
        "extensions":{"KHR_texture_transform":{"scale":[20,25]}}}},
      "extensions":{"SELVEDGE_materials_fabric":{"fabric":{"index":0,
        "extensions":{"KHR_texture_transform":{"scale":[20,25]}}}}},
      "extras":{"SELVEDGE_materials_fabric":{"index":0,"name":"net","uri":"the%20net.exr",
        "extensions":{"KHR_texture_transform":{"scale":[20,25]}}}}})");
  }

  Json& at(const char* pointer) { return json[Json::json_pointer(pointer)]; }
  Json& primitive() { return at("/meshes/0/primitives/0"); }
  Json& material() { return at("/materials/0"); }
  Json& root_fabrics() { return at("/extensions/SELVEDGE_materials_fabric/fabrics"); }
};

std::string text_of(const Issues& issues) {
  std::string text;
  for (const Error& issue : issues) text += to_line(issue) + "\n";
  return text;
}

Issues check(const Folder& folder, const Square& square) {
  test::put(folder / "case.glb", test::glb(square.json.dump(), square.bytes));
  return check_gltf(folder / "case.glb");
}

/// One rule that is broken, and the only issue that it may lead to.
struct Case {
  const char* what;
  std::function<void(Square&)> spoil;
  Code code;
  const char* place;
};

void check_cases(const Folder& folder, const std::vector<Case>& cases, bool dressed) {
  for (const Case& one : cases) {
    CAPTURE(one.what);
    Square square;
    if (dressed) square.dress();
    one.spoil(square);
    const Issues issues = check(folder, square);
    INFO(text_of(issues));
    REQUIRE(issues.size() == 1);
    CHECK(issues[0].code == one.code);
    CHECK(issues[0].place == one.place);
    CHECK(issues[0].file == folder / "case.glb");
    CHECK_FALSE(issues[0].message.empty());
  }
}

}  // namespace

TEST_CASE("gltf check: a good file has no issues") {
  const Folder folder("gltf_check_test");
  INFO(text_of(check(folder, Square())));
  CHECK(check(folder, Square()).empty());
}

TEST_CASE("gltf check: each broken rule of glTF is named where it stands") {
  const Folder folder("gltf_check_test");
  const float nan = std::numeric_limits<float>::quiet_NaN();
  check_cases(
      folder,
      {
          {"missing member", [](Square& s) { s.at("/accessors/1").erase("count"); }, Code::gltf_malformed,
           "/accessors/1/count"},
          {"wrong type", [](Square& s) { s.material()["doubleSided"] = 1; }, Code::gltf_malformed,
           "/materials/0/doubleSided"},
          {"out of range", [](Square& s) { s.material()["alphaCutoff"] = -1; }, Code::gltf_malformed,
           "/materials/0/alphaCutoff"},
          {"empty array", [](Square& s) { s.at("/images") = Json::array(); }, Code::gltf_malformed,
           "/images"},
          {"wrong number of elements",
           [](Square& s) {
             s.at("/nodes/0")["scale"] = {1, 1};
           },
           Code::gltf_malformed, "/nodes/0/scale"},
          {"index of nothing", [](Square& s) { s.primitive()["material"] = 7; }, Code::gltf_accessor,
           "/meshes/0/primitives/0/material"},
          {"accessor beyond its view", [](Square& s) { s.at("/accessors/3")["byteOffset"] = 4; },
           Code::gltf_accessor, "/accessors/3"},
          {"view beyond its buffer", [](Square& s) { s.at("/bufferViews/4")["byteLength"] = 16; },
           Code::gltf_accessor, "/bufferViews/4"},
          {"misaligned view",
           [](Square& s) {
             s.at("/accessors/4")["count"] = 3;
             s.at("/bufferViews/4")["byteOffset"] = 193;
             s.at("/bufferViews/4")["byteLength"] = 8;
             s.put<std::uint16_t>(193, 0);
             s.put<std::uint16_t>(195, 1);
             s.put<std::uint16_t>(197, 2);
           },
           Code::gltf_malformed, "/accessors/4/byteOffset"},
          {"stride smaller than an element", [](Square& s) { s.at("/bufferViews/1")["byteStride"] = 8; },
           Code::gltf_accessor, "/accessors/1"},
          {"stride of indices",
           [](Square& s) {
             s.at("/bufferViews/4").erase("target");
             s.at("/bufferViews/4")["byteStride"] = 4;
             s.at("/accessors/4")["count"] = 3;
             s.put<std::uint16_t>(196, 1);
             s.put<std::uint16_t>(200, 2);
           },
           Code::gltf_malformed, "/meshes/0/primitives/0/indices"},
          {"one view for two kinds", [](Square& s) { s.at("/bufferViews/4")["target"] = 34962; },
           Code::gltf_malformed, "/meshes/0/primitives/0/indices"},
          {"format of an attribute",
           [](Square& s) {
             s.primitive()["attributes"] = {{"POSITION", 0}, {"NORMAL", 3}};
           },
           Code::gltf_malformed, "/meshes/0/primitives/0/attributes/NORMAL"},
          {"unknown attribute", [](Square& s) { s.primitive()["attributes"]["UV"] = 3; },
           Code::gltf_malformed, "/meshes/0/primitives/0/attributes/UV"},
          {"a set is left out", [](Square& s) { s.primitive()["attributes"]["TEXCOORD_2"] = 3; },
           Code::gltf_malformed, "/meshes/0/primitives/0/attributes"},
          {"counts that differ", [](Square& s) { s.at("/accessors/3")["count"] = 3; }, Code::gltf_malformed,
           "/meshes/0/primitives/0/attributes"},
          {"no bounds", [](Square& s) { s.at("/accessors/0").erase("min"); }, Code::gltf_malformed,
           "/meshes/0/primitives/0/attributes/POSITION"},
          {"wrong bounds",
           [](Square& s) {
             s.at("/accessors/0")["max"] = {1, 2, 0};
           },
           Code::gltf_accessor, "/accessors/0/max/1"},
          {"NaN", [=](Square& s) { s.put(164, nan); }, Code::mesh_not_finite,
           "/meshes/0/primitives/0/attributes/TEXCOORD_0"},
          {"index beyond the vertices", [](Square& s) { s.put<std::uint16_t>(202, 4); }, Code::gltf_accessor,
           "/meshes/0/primitives/0/indices"},
          {"index that restarts", [](Square& s) { s.put<std::uint16_t>(202, 65535); }, Code::gltf_accessor,
           "/meshes/0/primitives/0/indices"},
          {"normal of length 2", [](Square& s) { s.put(56, 2.0F); }, Code::gltf_accessor,
           "/meshes/0/primitives/0/attributes/NORMAL"},
          {"handedness 0", [](Square& s) { s.put(108, 0.0F); }, Code::gltf_accessor,
           "/meshes/0/primitives/0/attributes/TANGENT"},
          {"sparse count",
           [](Square& s) {
             s.at("/accessors/3")["sparse"] = Json::parse(
                 R"({"count":5,"indices":{"bufferView":4,"componentType":5123},"values":{"bufferView":3}})");
             s.at("/bufferViews/3").erase("target");
             s.primitive()["attributes"].erase("TEXCOORD_0");
             s.primitive().erase("indices");
             s.at("/bufferViews/4").erase("target");
             s.primitive()["mode"] = 5;
           },
           Code::gltf_accessor, "/accessors/3/sparse/count"},
          {"a loop of nodes",
           [](Square& s) {
             s.json["nodes"] = Json::parse(R"([{"mesh":0},{"children":[2]},{"children":[1]}])");
           },
           Code::gltf_malformed, "/nodes/1"},
          {"two parents",
           [](Square& s) {
             s.json["nodes"] = Json::parse(R"([{"mesh":0},{"children":[3]},{"children":[3]},{}])");
           },
           Code::gltf_malformed, "/nodes/2/children/0"},
          {"a scene's node with a parent",
           [](Square& s) { s.json["nodes"] = Json::parse(R"([{"mesh":0},{"children":[0]}])"); },
           Code::gltf_malformed, "/scenes/0/nodes/0"},
          {"quaternion of length 2",
           [](Square& s) {
             s.at("/nodes/0")["rotation"] = {0, 0, 1, 1};
           },
           Code::gltf_malformed, "/nodes/0/rotation"},
          {"sheared matrix",
           [](Square& s) { s.at("/nodes/0")["matrix"] = {1, 0, 0, 0, 1, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}; },
           Code::gltf_malformed, "/nodes/0/matrix"},
          {"missing picture", [](Square& s) { s.json["images"] = Json::parse(R"([{"uri":"none.png"}])"); },
           Code::image_unreadable, "/images/0"},
          {"texture without its UV set",
           [](Square& s) {
             s.dress();
             s.at("/materials/0/pbrMetallicRoughness/baseColorTexture")["texCoord"] = 1;
             s.material().erase("extensions");
             s.json.erase("extensions");
           },
           Code::gltf_malformed, "/meshes/0/primitives/0/material"},
          {"undeclared extension",
           [](Square& s) { s.material()["extensions"]["KHR_materials_sheen"] = Json::object(); },
           Code::gltf_malformed, "/materials/0/extensions/KHR_materials_sheen"},
          {"required but not used",
           [](Square& s) {
             s.json["extensionsUsed"] = {"KHR_texture_transform"};
             s.json["extensionsRequired"] = {"KHR_materials_sheen"};
           },
           Code::gltf_malformed, "/extensionsRequired"},
          {"type of a transform",
           [](Square& s) {
             s.json["extensionsUsed"] = {"KHR_texture_transform"};
             s.json["images"] = Json::parse(
                 R"([{"uri":"data:image/png;base64,iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJ"}])");
             s.json["textures"] = Json::parse(R"([{"source":0}])");
             s.material()["emissiveTexture"] =
                 Json::parse(R"({"index":0,"extensions":{"KHR_texture_transform":{"rotation":"1"}}})");
           },
           Code::gltf_malformed, "/materials/0/emissiveTexture/extensions/KHR_texture_transform/rotation"},
          {"later version",
           [](Square& s) {
             s.at("/asset")["minVersion"] = "2.1";
             s.at("/asset")["version"] = "2.1";
           },
           Code::gltf_unsupported, "/asset/minVersion"},
      },
      false);
}

TEST_CASE("gltf check: quantized formats are good where KHR_mesh_quantization is listed, and only there") {
  const Folder folder("gltf_check_test");
  Square square;
  square.primitive()["attributes"].erase("TEXCOORD_0");
  square.at("/accessors/3")["componentType"] = 5122;
  square.at("/accessors/3")["type"] = "VEC3";
  square.at("/accessors/3")["count"] = 4;
  square.at("/accessors/3")["min"] = {0, 0, 0};
  square.at("/accessors/3")["max"] = {1, 1, 0};
  square.at("/bufferViews/3")["byteStride"] = 8;
  for (std::size_t v = 0; v < 4; ++v) {
    square.put<std::int16_t>(160 + 8 * v, v == 1 || v == 2 ? 1 : 0);
    square.put<std::int16_t>(162 + 8 * v, v >= 2 ? 1 : 0);
    square.put<std::int16_t>(164 + 8 * v, 0);
  }
  square.primitive()["attributes"]["POSITION"] = 3;
  const Issues without = check(folder, square);
  REQUIRE(without.size() == 1);
  CHECK(without[0].place == "/meshes/0/primitives/0/attributes/POSITION");
  square.json["extensionsUsed"] = {"KHR_mesh_quantization"};
  CHECK(text_of(check(folder, square)) == "");
}

TEST_CASE("gltf check: chunks and lengths of a GLB") {
  const Folder folder("gltf_check_test");
  const Square square;
  const std::string whole = test::glb(square.json.dump(), square.bytes);
  const auto first = [&](std::string bytes) {
    test::put(folder / "case.glb", bytes);
    const Issues issues = check_gltf(folder / "case.glb");
    REQUIRE_FALSE(issues.empty());
    return issues[0];
  };
  CHECK(first(whole.substr(0, 10)).code == Code::file_damaged);
  CHECK(first(whole.substr(0, whole.size() - 1)).code == Code::file_damaged);
  CHECK(first(whole + "more").code == Code::gltf_advice);
  CHECK(first(whole.substr(0, 4) + '\1' + whole.substr(5)).code == Code::gltf_unsupported);
  std::string changed = whole;
  changed[16] = 'X';  // of "JSON"
  CHECK(first(changed).place == "byte 12");
  changed = whole;
  changed[12] = static_cast<char>(changed[12] + 1);  // the JSON chunk's length
  CHECK(first(changed).code == Code::gltf_malformed);
}

TEST_CASE("gltf check: every issue of a file is listed, up to a number, and the rest is counted") {
  const Folder folder("gltf_check_test");
  Square square;
  for (int i = 0; i < 250; ++i) square.json["nodes"].push_back({{"mesh", 9}});
  for (int i = 0; i < 30; ++i) square.json["samplers"].push_back({{"wrapS", 1}});
  const Issues issues = check(folder, square);
  REQUIRE(issues.size() == 100 + 30 + 1);
  CHECK(issues.back().code == Code::gltf_malformed);
  CHECK(issues.back().message == "150 more errors are not listed");
}

TEST_CASE("gltf check: what a small file asks for is not allocated, and takes no time") {
  const Folder folder("gltf_check_test");
  const auto start = std::chrono::steady_clock::now();
  const std::vector<std::function<void(Square&)>> demands{
      [](Square& s) {
        s.at("/accessors/1").erase("bufferView");
        s.at("/accessors/1")["count"] = 1e12;
      },
      [](Square& s) {
        s.at("/accessors/0").erase("bufferView");
        s.at("/accessors/0")["count"] = 1e9;
      },
      [](Square& s) {
        s.at("/accessors/3")["sparse"] = Json::parse(
            R"({"count":1e11,"indices":{"bufferView":3,"componentType":5125},"values":{"bufferView":3}})");
      },
      [](Square& s) { s.at("/buffers/0")["byteLength"] = 1e12; },
      [](Square& s) {
        for (int i = 0; i < 20000; ++i) s.at("/meshes/0/primitives").push_back(Json(s.primitive()));
      },
      [](Square& s) { s.json["buffers"][0]["uri"] = "../../../../../../../../dev/zero"; },
      [](Square& s) {
        // A million vertices of nothing, again and again.
        s.json["accessors"].push_back(Json::parse(R"({"componentType":5126,"count":1000000,"type":"VEC3",
            "min":[0,0,0],"max":[0,0,0]})"));
        s.json["meshes"][0]["primitives"] = Json::array();
        for (int i = 0; i < 200; ++i) {
          s.json["meshes"][0]["primitives"].push_back(Json::parse(R"({"attributes":{"POSITION":5}})"));
        }
      },
      [](Square& s) {
        for (int i = 0; i < 5000; ++i) s.json["extras"][std::to_string(i)] = i;
      }};
  for (std::size_t i = 0; i < demands.size(); ++i) {
    CAPTURE(i);
    Square square;
    demands[i](square);
    const Issues issues = check(folder, square);
    CHECK((has_error(issues) || i == 4));
    const auto scene = read_scene(folder / "case.glb");
    CHECK((!scene.has_value() || i == 4));
  }
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
  CHECK(seconds.count() < 20);  // seconds each at the worst, on a machine that does other things, too
}

TEST_CASE("gltf check: deep nesting and long data URIs that are none are named") {
  const Folder folder("gltf_check_test");
  test::put(folder / "deep.gltf", R"({"asset":{"version":"2.0"},"extras":)" + std::string(1000000, '['));
  CHECK(check_gltf(folder / "deep.gltf")[0].code == Code::gltf_malformed);
  for (const char* uri : {"data:application/octet-stream;base64,A",
                          "data:application/octet-stream;base64,A*==", "data:application/octet-stream",
                          "none.bin", "http://example.com/a.bin"}) {
    CAPTURE(uri);
    test::put(folder / "uri.gltf", R"({"asset":{"version":"2.0"},"buffers":[{"byteLength":1,"uri":")" +
                                       std::string(uri) + "\"}]}");
    const Issues issues = check_gltf(folder / "uri.gltf");
    REQUIRE(issues.size() == 1);
    CHECK(issues[0].place == "/buffers/0");
  }
}

TEST_CASE("gltf check: a dressed file with a complete fallback has no issues") {
  const Folder folder("gltf_check_test");
  REQUIRE(write_fabric(folder / "the net.exr", test::net_fabric()));
  Square square;
  square.dress();
  CHECK(text_of(check(folder, square)) == "");
}

TEST_CASE("gltf check: each broken rule of SELVEDGE_materials_fabric is named where it stands") {
  const Folder folder("gltf_check_test");
  REQUIRE(write_fabric(folder / "the net.exr", test::net_fabric()));
  const char* fabrics = "/extensions/SELVEDGE_materials_fabric/fabrics";
  const char* fabric = "/materials/0/extensions/SELVEDGE_materials_fabric/fabric";
  const std::string entry = std::string(fabrics) + "/0";
  const std::string mime = entry + "/mimeType";
  const std::string name = entry + "/name";
  const std::string uri = entry + "/uri";
  const std::string view = entry + "/bufferView";
  const std::string index = std::string(fabric) + "/index";
  const std::string set = std::string(fabric) + "/texCoord";
  const auto embed = [](Square& s, int number) {
    s.root_fabrics()[0].erase("uri");
    s.root_fabrics()[0]["bufferView"] = number;
    s.at("/materials/0/extras/SELVEDGE_materials_fabric").erase("uri");
  };
  check_cases(
      folder,
      {
          {"not in extensionsUsed", [](Square& s) { s.json["extensionsUsed"] = {"KHR_texture_transform"}; },
           Code::gltf_extension, "/materials/0/extensions/SELVEDGE_materials_fabric"},
          {"in extensionsRequired",
           [](Square& s) { s.json["extensionsRequired"] = {"SELVEDGE_materials_fabric"}; },
           Code::gltf_extension, "/extensionsRequired"},
          {"item that is no object", [](Square& s) { s.root_fabrics().push_back(3); }, Code::gltf_extension,
           "/extensions/SELVEDGE_materials_fabric/fabrics/1"},
          {"both uri and bufferView", [](Square& s) { s.root_fabrics()[0]["bufferView"] = 0; },
           Code::gltf_extension, entry.c_str()},
          {"neither",
           [](Square& s) {
             s.root_fabrics()[0].erase("uri");
             s.at("/materials/0/extras/SELVEDGE_materials_fabric").erase("uri");
           },
           Code::gltf_extension, entry.c_str()},
          {"mimeType", [](Square& s) { s.root_fabrics()[0]["mimeType"] = "image/png"; }, Code::gltf_extension,
           mime.c_str()},
          {"name",
           [](Square& s) {
             s.root_fabrics()[0]["name"] = 3;
             s.at("/materials/0/extras/SELVEDGE_materials_fabric")["name"] = 3;
           },
           Code::gltf_extension, name.c_str()},
          {"uri",
           [](Square& s) {
             s.root_fabrics()[0]["uri"] = 3;
             s.at("/materials/0/extras/SELVEDGE_materials_fabric")["uri"] = 3;
           },
           Code::gltf_extension, uri.c_str()},
          {"bufferView", [&](Square& s) { embed(s, 99); }, Code::gltf_extension, view.c_str()},
          {"fabric that is no object",
           [](Square& s) { s.at("/materials/0/extensions/SELVEDGE_materials_fabric")["fabric"] = 0; },
           Code::gltf_extension, fabric},
          {"fabric missing",
           [](Square& s) { s.at("/materials/0/extensions/SELVEDGE_materials_fabric").erase("fabric"); },
           Code::gltf_extension, fabric},
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
          {"missing file",
           [](Square& s) {
             s.root_fabrics()[0]["uri"] = "a%20net.exr";
             s.at("/materials/0/extras/SELVEDGE_materials_fabric")["uri"] = "a%20net.exr";
           },
           Code::gltf_reference, uri.c_str()},
          {"no UVs",
           [](Square& s) {
             s.at("/materials/0/pbrMetallicRoughness").erase("baseColorTexture");
             s.at("/materials/0/pbrMetallicRoughness")["baseColorTexture"] = Json::parse(
                 R"({"index":0,"texCoord":0,"extensions":{"KHR_texture_transform":{"scale":[20,25],"texCoord":0}}})");
             s.at("/meshes/0/primitives")
                 .push_back(Json::parse(
                     R"({"attributes":{"POSITION":0,"NORMAL":1,"TEXCOORD_0":3},"material":0,"mode":5})"));
             s.json["extensionsUsed"].push_back("KHR_materials_variants");
             s.at("/meshes/0/primitives/0")["extensions"]["KHR_materials_variants"]["mappings"] =
                 Json::parse(R"([{"material":1,"variants":[0]}])");
             s.json["extensions"]["KHR_materials_variants"]["variants"] = Json::parse(R"([{"name":"a"}])");
             s.json["materials"].push_back(s.material());
             s.at("/materials/1/pbrMetallicRoughness").erase("baseColorTexture");
             s.at("/materials/1/extensions/SELVEDGE_materials_fabric/fabric")["texCoord"] = 1;
             s.at("/materials/1/extras/SELVEDGE_materials_fabric")["texCoord"] = 1;
             s.at("/materials/1/pbrMetallicRoughness")["metallicFactor"] = 0;
             s.at("/materials/1/pbrMetallicRoughness")["baseColorTexture"] = Json::parse(
                 R"({"index":0,"texCoord":1,"extensions":{"KHR_texture_transform":{"scale":[20,25]}}})");
           },
           Code::garment_no_uvs, "/meshes/0/primitives/0/attributes"},
      },
      true);
  Square square;
  square.dress();
  square.at("/extensions/SELVEDGE_materials_fabric").erase("fabrics");
  const Issues issues = check(folder, square);
  REQUIRE(issues.size() == 2);  // and the reference into it
  CHECK(issues[0].place == fabrics);
  square.at("/extensions/SELVEDGE_materials_fabric")["fabrics"] = Json::array();
  CHECK(check(folder, square)[0].place == fabrics);
}

TEST_CASE("gltf check: what a consumer would see wrongly is a warning") {
  const Folder folder("gltf_check_test");
  REQUIRE(write_fabric(folder / "the net.exr", test::net_fabric()));
  REQUIRE(write_fabric(folder / "cloth.exr", test::lambert_fabric(V2d(5, 4), 4, V3f(0.5F))));
  const auto whole = [](Square& s) {
    s.root_fabrics()[0]["uri"] = "cloth.exr";
    s.at("/materials/0/extras/SELVEDGE_materials_fabric")["uri"] = "cloth.exr";
  };
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
          {"no mirror", [](Square& s) { s.material().erase("extras"); }, Code::gltf_mirror,
           "/materials/0/extras/SELVEDGE_materials_fabric"},
          {"another index in the mirror",
           [](Square& s) { s.at("/materials/0/extras/SELVEDGE_materials_fabric")["index"] = 2; },
           Code::gltf_mirror, "/materials/0/extras/SELVEDGE_materials_fabric/index"},
          {"another uri in the mirror",
           [](Square& s) { s.at("/materials/0/extras/SELVEDGE_materials_fabric")["uri"] = "x"; },
           Code::gltf_mirror, "/materials/0/extras/SELVEDGE_materials_fabric/uri"},
          {"no normals",
           [](Square& s) {
             s.primitive()["attributes"].erase("NORMAL");
             s.primitive()["attributes"].erase("TANGENT");
           },
           Code::gltf_advice, "/meshes/0/primitives/0/attributes"},
          {"no tangents",
           [](Square& s) {
             s.material()["normalTexture"] = s.at("/materials/0/pbrMetallicRoughness/baseColorTexture");
             s.primitive()["attributes"].erase("TANGENT");
           },
           Code::gltf_advice, "/meshes/0/primitives/0/attributes"},
          {"on nothing", [](Square& s) { s.primitive().erase("material"); }, Code::gltf_advice,
           "/materials/0"},
      },
      true);
}

TEST_CASE("gltf check: issues of a fabric say which fabric, embedded or beside") {
  const Folder folder("gltf_check_test");
  REQUIRE(write_fabric(folder / "net.exr", test::net_fabric()));
  std::string fabric = *read_file(folder / "net.exr");
  Square square;
  square.dress();
  fabric[fabric.size() - 40] = static_cast<char>(fabric[fabric.size() - 40] ^ 1);
  test::put(folder / "the net.exr", fabric);
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
  square.at("/materials/0/extras/SELVEDGE_materials_fabric").erase("uri");
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
