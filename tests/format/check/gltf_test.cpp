// Issues of whole files: how many there are, and what a small file may ask for.
#include "format/check/gltf.h"

#include <doctest/doctest.h>

#include <functional>

#include "format/gltf/read_scene.h"
#include "tests/format/gltf_square.h"

using namespace selvedge;
using namespace selvedge::test;

TEST_CASE("gltf check: bytes behind a GLB are advice") {
  const Folder folder;
  const Square square;
  write_bytes(folder / "case.glb", glb(square.json.dump(), square.bytes) + "more");
  CHECK(check_gltf(folder / "case.glb").at(0).code == Code::gltf_advice);
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

TEST_CASE("gltf check: what a small file asks for is refused, by the reader too") {
  const Folder folder;
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
      [](Square& s) { s.json["buffers"][0]["uri"] = "../../../../../../../../dev/zero"; },
      [](Square& s) {
        // A million vertices of nothing, again and again.
        s.json["accessors"].push_back(Json::parse(R"({"componentType":5126,"count":1000000,"type":"VEC3",
            "min":[0,0,0],"max":[0,0,0]})"));
        s.json["meshes"][0]["primitives"] = Json::array();
        for (int i = 0; i < 200; ++i)
          s.json["meshes"][0]["primitives"].push_back(Json::parse(R"({"attributes":{"POSITION":5}})"));
      },
      [](Square& s) {
        // Each joint has all joints before it as ancestors.
        constexpr int count = 3000;
        const auto first = static_cast<int>(s.json["nodes"].size());
        Json& joints = s.json["skins"][0]["joints"];
        for (int i = 0; i < count; ++i) {
          s.json["nodes"].push_back(i + 1 < count ? Json{{"children", {first + i + 1}}} : Json::object());
          joints.push_back(first + i);
        }
        s.json["nodes"][0]["skin"] = 0;
      },
      [](Square& s) {
        s.json["accessors"].push_back(Json::parse(R"({"componentType":5126,"count":1000000,"type":"VEC3",
            "min":[0,0,0],"max":[0,0,0]})"));
        s.json["meshes"][0] = {{"primitives", {{{"attributes", {{"POSITION", 5}}}}}}};
        for (int i = 0; i < 100; ++i) {
          s.json["meshes"][0]["primitives"][0]["targets"].push_back({{"POSITION", 5}});
          s.json["meshes"][0]["weights"].push_back(0.5);
        }
      },
      [](Square& s) {
        for (int i = 0; i < 5000; ++i) s.json["extras"][std::to_string(i)] = i;
      }};
  for (std::size_t i = 0; i < demands.size(); ++i) {
    CAPTURE(i);
    Square square;
    demands[i](square);
    CHECK(has_error(check(folder, square)));
    CHECK_FALSE(read_scene(folder / "case.glb").has_value());
  }
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
