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
  const Folder folder;
  INFO(text_of(check(folder, Square())));
  CHECK(check(folder, Square()).empty());
}

TEST_CASE("gltf check: what cannot be read is named where it stands") {
  const Folder folder;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  check_cases(
      folder,
      {
          {"missing member", [](Square& s) { s.at("/accessors/1").erase("count"); }, Code::gltf_malformed,
           "/accessors/1"},
          {"an object instead of a list", [](Square& s) { s.json["samplers"] = Json::object(); },
           Code::gltf_malformed, "/samplers"},
          {"an item of a list that is no object", [](Square& s) { s.json["samplers"] = {1}; },
           Code::gltf_malformed, "/samplers/0"},
          {"wrong number of elements",
           [](Square& s) {
             s.at("/nodes/0")["scale"] = {1, 1};
           },
           Code::gltf_malformed, "/nodes/0"},
          {"index of nothing", [](Square& s) { s.primitive()["material"] = 7; }, Code::gltf_accessor,
           "/meshes/0/primitives/0/material"},
          {"mesh of nothing", [](Square& s) { s.at("/nodes/0")["mesh"] = 1; }, Code::gltf_accessor,
           "/nodes/0/mesh"},
          {"mesh of nothing in another scene",
           [](Square& s) {
             s.json["nodes"].push_back({{"mesh", 9}});
             s.json["scenes"].push_back({{"nodes", {1}}});
           },
           Code::gltf_accessor, "/nodes/1/mesh"},
          {"accessor beyond its view", [](Square& s) { s.at("/accessors/3")["byteOffset"] = 4; },
           Code::gltf_accessor, "/accessors/3"},
          {"view that nothing uses beyond its buffer",
           [](Square& s) {
             s.json["bufferViews"].push_back({{"buffer", 0}, {"byteLength", 999}});
           },
           Code::gltf_accessor, "/bufferViews/5"},
          {"view beyond its buffer", [](Square& s) { s.at("/bufferViews/4")["byteLength"] = 16; },
           Code::gltf_accessor, "/bufferViews/4"},
          {"stride smaller than an element", [](Square& s) { s.at("/bufferViews/1")["byteStride"] = 8; },
           Code::gltf_accessor, "/accessors/1"},
          {"format of an attribute",
           [](Square& s) {
             s.primitive()["attributes"] = {{"POSITION", 0}, {"NORMAL", 3}};
           },
           Code::gltf_malformed, "/meshes/0/primitives/0/attributes/NORMAL"},
          {"counts that differ", [](Square& s) { s.at("/accessors/3")["count"] = 3; }, Code::gltf_malformed,
           "/meshes/0/primitives/0/attributes/TEXCOORD_0"},
          {"NaN", [=](Square& s) { s.put(164, nan); }, Code::mesh_not_finite,
           "/meshes/0/primitives/0/attributes/TEXCOORD_0"},
          {"index beyond the vertices", [](Square& s) { s.put<std::uint16_t>(202, 4); }, Code::gltf_accessor,
           "/meshes/0/primitives/0/indices"},
          {"index that restarts", [](Square& s) { s.put<std::uint16_t>(202, 65535); }, Code::gltf_accessor,
           "/meshes/0/primitives/0/indices"},
          {"sparse count",
           [](Square& s) {
             s.at("/accessors/3")["sparse"] = Json::parse(
                 R"({"count":5,"indices":{"bufferView":4,"componentType":5123},"values":{"bufferView":3}})");
           },
           Code::gltf_accessor, "/accessors/3/sparse/count"},
          {"a loop of nodes",
           [](Square& s) {
             s.json["nodes"] = Json::parse(R"([{"mesh":0,"children":[1]},{"children":[0]}])");
           },
           Code::gltf_malformed, "/nodes/0"},
          {"two parents",
           [](Square& s) {
             s.json["nodes"] = Json::parse(R"([{"mesh":0},{"children":[3]},{"children":[3]},{}])");
           },
           Code::gltf_malformed, "/nodes/3"},
          {"a scene's node with a parent",
           [](Square& s) { s.json["nodes"] = Json::parse(R"([{"mesh":0},{"children":[0]}])"); },
           Code::gltf_malformed, "/nodes/0"},
          {"missing picture", [](Square& s) { s.json["images"] = Json::parse(R"([{"uri":"none.png"}])"); },
           Code::image_unreadable, "/images/0"},
          {"material of a variant of nothing", [](Square& s) { s.wear_variants()[1]["material"] = 2; },
           Code::gltf_accessor,
           "/meshes/0/primitives/0/extensions/KHR_materials_variants/mappings/1/material"},
          {"variant of nothing", [](Square& s) { s.wear_variants()[1]["variants"] = {2}; },
           Code::gltf_accessor,
           "/meshes/0/primitives/0/extensions/KHR_materials_variants/mappings/1/variants/0"},
          {"required extension",
           [](Square& s) { s.json["extensionsUsed"] = s.json["extensionsRequired"] = {"ACME_bent_space"}; },
           Code::gltf_unsupported, "/extensionsRequired/0"},
          {"later version",
           [](Square& s) {
             s.at("/asset")["minVersion"] = "2.1";
             s.at("/asset")["version"] = "2.1";
           },
           Code::gltf_unsupported, "/asset/minVersion"},
      },
      false);
  Square square;
  square.wear_variants();
  CHECK(text_of(check(folder, square)) == "");
}

TEST_CASE("gltf check: joints are within the smallest skin of the mesh, skins within theirs") {
  const Folder folder;
  const auto bind = [](Square& s, const char* type, const Json& joints) {
    s.skin();
    s.json["accessors"].push_back({{"componentType", 5126}, {"count", 1}, {"type", type}});
    s.at("/skins/0") = {{"joints", joints}, {"inverseBindMatrices", 7}};
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
                   Code::gltf_accessor, "/nodes/7"},
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
              },
              false);
  Square skinned;
  skinned.skin();
  CHECK(text_of(check(folder, skinned)) == "");
}

TEST_CASE("gltf check: chunks and lengths of a GLB") {
  const Folder folder;
  const Square square;
  const std::string whole = glb(square.json.dump(), square.bytes);
  const auto first = [&](std::string bytes) {
    write_bytes(folder / "case.glb", bytes);
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
  const Folder folder;
  Square square;
  for (int i = 0; i < 250; ++i) square.json["nodes"].push_back({{"mesh", 9}});
  const Issues issues = check(folder, square);
  REQUIRE(issues.size() == 100 + 1);
  CHECK(issues.back().code == Code::gltf_accessor);
  CHECK(issues.back().message.ends_with("149 more errors are not listed"));
}

TEST_CASE("gltf check: what a small file asks for is not allocated, and takes no time") {
  const Folder folder;
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

TEST_CASE("gltf check: deep nesting and long broken data URIs are named") {
  const Folder folder;
  write_bytes(folder / "deep.gltf", R"({"asset":{"version":"2.0"},"extras":)" + std::string(1000000, '['));
  CHECK(check_gltf(folder / "deep.gltf")[0].code == Code::gltf_malformed);
  for (const char* uri : {"data:application/octet-stream;base64,A",
                          "data:application/octet-stream;base64,A*==", "data:application/octet-stream",
                          "none.bin", "http://example.com/a.bin"}) {
    CAPTURE(uri);
    write_bytes(folder / "uri.gltf", R"({"asset":{"version":"2.0"},"buffers":[{"byteLength":1,"uri":")" +
                                         std::string(uri) + "\"}]}");
    const Issues issues = check_gltf(folder / "uri.gltf");
    REQUIRE(issues.size() == 1);
    CHECK(issues[0].place == "/buffers/0");
  }
}

TEST_CASE("gltf check: a member that stands twice is named, in a .gltf and in a GLB, and not read") {
  const Folder folder;
  const Square square;
  const auto repeated = [&](std::string json) {
    const std::string name = R"("target":34962)";
    return json.insert(json.rfind(name), R"("target":34962,)");
  };
  write_bytes(folder / "case.glb", glb(repeated(square.json.dump()), square.bytes));
  Square beside;
  beside.at("/buffers/0")["uri"] = "case.bin";
  write_bytes(folder / "case.bin", beside.bytes);
  write_bytes(folder / "case.gltf", repeated(beside.json.dump()));
  for (const char* name : {"case.glb", "case.gltf"}) {
    const Issues issues = check_gltf(folder / name);
    INFO(text_of(issues));
    REQUIRE(issues.size() == 1);
    CHECK(issues[0].code == Code::gltf_malformed);
    CHECK(issues[0].place == "/bufferViews/3/target");
    CHECK_FALSE(read_scene(folder / name).has_value());
  }
}
