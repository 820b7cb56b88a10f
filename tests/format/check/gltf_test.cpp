#include "format/check/gltf.h"

#include <doctest/doctest.h>

#include <ctime>
#include <functional>
#include <limits>

#include "format/gltf/read_scene.h"
#include "tests/format/gltf_square.h"

using namespace selvedge;
using namespace selvedge::test;

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

TEST_CASE(
    "gltf check: variants ask the same of a primitive as its own material, and their indices are checked") {
  const Folder folder("gltf_check_test");
  const std::string place = "/meshes/0/primitives/0/extensions/KHR_materials_variants";
  const std::string of_material = place + "/mappings/1/material";
  const std::string of_variants = place + "/mappings/1/variants";
  const std::string first = of_variants + "/0";
  const std::string mappings = place + "/mappings";
  const std::string root = "/extensions/KHR_materials_variants/variants";
  const std::string name = root + "/1/name";
  check_cases(folder,
              {
                  {"material of nothing", [](Square& s) { s.wear_variants()[1]["material"] = 2; },
                   Code::gltf_accessor, of_material.c_str()},
                  {"no material", [](Square& s) { s.wear_variants()[1].erase("material"); },
                   Code::gltf_malformed, of_material.c_str()},
                  {"variant of nothing", [](Square& s) { s.wear_variants()[1]["variants"] = {2}; },
                   Code::gltf_accessor, first.c_str()},
                  {"variant that is no index", [](Square& s) { s.wear_variants()[1]["variants"] = {-1}; },
                   Code::gltf_malformed, first.c_str()},
                  {"no variant", [](Square& s) { s.wear_variants()[1]["variants"] = Json::array(); },
                   Code::gltf_malformed, of_variants.c_str()},
                  {"variant that is mapped twice", [](Square& s) { s.wear_variants()[1]["variants"] = {0}; },
                   Code::gltf_malformed, first.c_str()},
                  {"no mappings",
                   [](Square& s) {
                     s.wear_variants();
                     s.primitive()["extensions"]["KHR_materials_variants"].erase("mappings");
                   },
                   Code::gltf_malformed, mappings.c_str()},
                  {"variant without a name",
                   [](Square& s) {
                     s.wear_variants();
                     s.at("/extensions/KHR_materials_variants/variants/1").erase("name");
                   },
                   Code::gltf_malformed, name.c_str()},
                  {"texture of a variant without its UV set",
                   [](Square& s) {
                     s.dress();
                     s.wear_variants();
                     s.at("/extensions").erase("SELVEDGE_materials_fabric");
                     for (const char* material : {"/materials/0", "/materials/1"})
                       s.at(material).erase("extensions");
                     s.at("/materials/1/pbrMetallicRoughness/baseColorTexture")["texCoord"] = 1;
                   },
                   Code::gltf_malformed, of_material.c_str()},
              },
              false);
  Square square;
  square.wear_variants();
  CHECK(text_of(check(folder, square)) == "");
}

TEST_CASE("gltf check: joints are within the smallest skin of the mesh, skins and animations within theirs") {
  const Folder folder("gltf_check_test");
  const auto bind = [](Square& s, const char* type, const Json& joints) {
    s.skin();
    s.json["accessors"].push_back({{"componentType", 5126}, {"count", 1}, {"type", type}});
    s.at("/skins/0") = {{"joints", joints}, {"inverseBindMatrices", 7}};
  };
  const auto animate = [](Square& s) -> Json& {
    s.bytes += bytes_of<float>({0, 1, 0, 0, 0, 1, 1, 1});
    s.json["bufferViews"].push_back({{"buffer", 0}, {"byteOffset", 204}, {"byteLength", 8}});
    s.json["bufferViews"].push_back({{"buffer", 0}, {"byteOffset", 212}, {"byteLength", 24}});
    s.json["buffers"][0]["byteLength"] = 236;
    s.json["accessors"].push_back(Json::parse(
        R"({"bufferView":5,"componentType":5126,"count":2,"type":"SCALAR","min":[0],"max":[1]})"));
    s.json["accessors"].push_back(
        Json::parse(R"({"bufferView":6,"componentType":5126,"count":2,"type":"VEC3"})"));
    s.json["animations"] = Json::parse(R"([{"samplers":[{"input":5,"output":6}],
        "channels":[{"sampler":0,"target":{"node":0,"path":"translation"}}]}])");
    return s.at("/animations/0");
  };
  check_cases(folder,
              {
                  {"joint beyond the skin",
                   [](Square& s) {
                     s.skin();
                     s.put<std::uint8_t>(204 + 7, 1);
                   },
                   Code::gltf_accessor, "/meshes/0/primitives/0/attributes/JOINTS_0"},
                  {"joint beyond the smaller of two skins",
                   [](Square& s) {
                     s.skin();
                     s.json["nodes"].push_back({{"mesh", 0}, {"skin", 1}});
                     s.at("/scenes/0/nodes").push_back(2);
                     s.json["skins"].push_back({{"joints", {1, 2}}});
                     s.put<std::uint8_t>(204, 1);
                   },
                   Code::gltf_accessor, "/meshes/0/primitives/0/attributes/JOINTS_0"},
                  {"joint that is no node",
                   [](Square& s) {
                     s.skin();
                     s.at("/skins/0")["joints"] = {7};
                   },
                   Code::gltf_accessor, "/skins/0/joints/0"},
                  {"skin of nothing",
                   [](Square& s) {
                     s.skin();
                     s.at("/nodes/0")["skin"] = 1;
                   },
                   Code::gltf_accessor, "/nodes/0/skin"},
                  {"bind matrices that are no matrices", [=](Square& s) { bind(s, "VEC4", {1}); },
                   Code::gltf_malformed, "/skins/0/inverseBindMatrices"},
                  {"fewer bind matrices than joints",
                   [=](Square& s) {
                     bind(s, "MAT4", {1, 0});
                   },
                   Code::gltf_malformed, "/skins/0/inverseBindMatrices"},
                  {"sampler of nothing", [=](Square& s) { animate(s)["channels"][0]["sampler"] = 1; },
                   Code::gltf_accessor, "/animations/0/channels/0/sampler"},
                  {"accessor of nothing", [=](Square& s) { animate(s)["samplers"][0]["output"] = 9; },
                   Code::gltf_accessor, "/animations/0/samplers/0/output"},
                  {"node of nothing", [=](Square& s) { animate(s)["channels"][0]["target"]["node"] = 4; },
                   Code::gltf_accessor, "/animations/0/channels/0/target/node"},
                  {"times that are vectors",
                   [=](Square& s) {
                     animate(s)["samplers"][0]["input"] = 6;
                     s.at("/accessors/6")["min"] = {0, 0, 0};
                     s.at("/accessors/6")["max"] = {1, 1, 1};
                   },
                   Code::gltf_malformed, "/animations/0/samplers/0/input"},
                  {"a rotation of three numbers",
                   [=](Square& s) { animate(s)["channels"][0]["target"]["path"] = "rotation"; },
                   Code::gltf_malformed, "/animations/0/channels/0/sampler"},
                  {"fewer values than times",
                   [=](Square& s) {
                     animate(s);
                     s.at("/accessors/6")["count"] = 1;
                   },
                   Code::gltf_malformed, "/animations/0/channels/0/sampler"},
              },
              false);
  Square square;
  animate(square);
  CHECK(text_of(check(folder, square)) == "");
  Square skinned;
  skinned.skin();
  CHECK(text_of(check(folder, skinned)) == "");
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
  const std::string whole = glb(square.json.dump(), square.bytes);
  const auto first = [&](std::string bytes) {
    put(folder / "case.glb", bytes);
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
  CHECK(issues.back().code == Code::gltf_accessor);
  CHECK(issues.back().message.find("; 149 more errors are not listed") != std::string::npos);
}

TEST_CASE("gltf check: what a small file asks for is not allocated, and takes no time") {
  const Folder folder("gltf_check_test");
  const std::clock_t start = std::clock();  // of this process: the machine may do other things, too
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
  CHECK(static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC < 20);  // seconds each at the worst
}

TEST_CASE("gltf check: deep nesting and long data URIs that are none are named") {
  const Folder folder("gltf_check_test");
  put(folder / "deep.gltf", R"({"asset":{"version":"2.0"},"extras":)" + std::string(1000000, '['));
  CHECK(check_gltf(folder / "deep.gltf")[0].code == Code::gltf_malformed);
  for (const char* uri : {"data:application/octet-stream;base64,A",
                          "data:application/octet-stream;base64,A*==", "data:application/octet-stream",
                          "none.bin", "http://example.com/a.bin"}) {
    CAPTURE(uri);
    put(folder / "uri.gltf",
        R"({"asset":{"version":"2.0"},"buffers":[{"byteLength":1,"uri":")" + std::string(uri) + "\"}]}");
    const Issues issues = check_gltf(folder / "uri.gltf");
    REQUIRE(issues.size() == 1);
    CHECK(issues[0].place == "/buffers/0");
  }
}

TEST_CASE("gltf check: a member that stands twice is named, in a .gltf and in a GLB, and not read") {
  const Folder folder("gltf_check_test");
  const Square square;
  const auto repeated = [&](std::string json) {
    const std::string name = R"("target":34962)";
    return json.insert(json.rfind(name), R"("target":34962,)");
  };
  put(folder / "case.glb", glb(repeated(square.json.dump()), square.bytes));
  Square beside;
  beside.at("/buffers/0")["uri"] = "case.bin";
  put(folder / "case.bin", beside.bytes);
  put(folder / "case.gltf", repeated(beside.json.dump()));
  for (const char* name : {"case.glb", "case.gltf"}) {
    const Issues issues = check_gltf(folder / name);
    INFO(text_of(issues));
    REQUIRE(issues.size() == 1);
    CHECK(issues[0].code == Code::gltf_malformed);
    CHECK(issues[0].place == "/bufferViews/3/target");
    CHECK_FALSE(read_scene(folder / name).has_value());
  }
}
