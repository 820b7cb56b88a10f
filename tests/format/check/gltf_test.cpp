// Issues of whole files: how many there are, and what a small file may ask for.
#include "format/check/gltf.h"

#include <doctest/doctest.h>

#include <cstdint>
#include <functional>
#include <span>
#include <string>

#include "format/check/fabric.h"
#include "format/fabric/file.h"
#include "format/gltf/read_scene.h"
#include "tests/format/fabrics.h"
#include "tests/format/files.h"
#include "tests/format/gltf_square.h"
#include "tests/require.h"

using namespace selvedge;
using namespace selvedge::test;

namespace {

std::span<const std::uint8_t> as_bytes(const std::string& bytes) {
  return {reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()};
}

/// The same verdict: both read it, or both name the same first error.
void check_alike(const std::string& bytes) {
  const auto read = read_fabric(as_bytes(bytes), "a.exr");
  const CheckedFabric checked = check_fabric(as_bytes(bytes), "a.exr");
  REQUIRE(read.has_value() == checked.fabric.has_value());
  REQUIRE(has_error(checked.issues) == !read.has_value());
  if (!read) REQUIRE(to_line(checked.issues.front()) == to_line(read.error()));
}

}  // namespace

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

TEST_CASE("a damaged or truncated fabric is judged alike by reader and checker") {
  const Folder folder;
  REQUIRE(write_fabric(folder / "a.exr", test::random_fabric(2, 1, {1, 2}, 1, 3)));
  const std::string bytes = test::bytes_of(folder / "a.exr");
  for (std::size_t at = 0; at < bytes.size(); at += 1 + bytes.size() / 200) {
    CAPTURE(at);
    check_alike(bytes.substr(0, at));
    std::string damaged = bytes;
    damaged[at] = static_cast<char>(damaged[at] ^ 1 << at % 8);
    check_alike(damaged);
  }
}

TEST_CASE("of a broken file all errors are listed") {
  const Folder folder;
  Fabric fabric = test::random_fabric(8, 8, {2, 2}, 1, 3);
  REQUIRE(write_fabric(folder / "a.exr", fabric));
  std::string bytes = test::bytes_of(folder / "a.exr");
  const std::size_t at = bytes.find("\"radianceScale\"");
  CHECK(at == std::string::npos);  // it is 1
  for (const char* member : {"\"thickness\"", "\"referenceHeight\""}) {
    const std::size_t where = bytes.find(member);
    REQUIRE(where != std::string::npos);
    bytes[where + 1] = 'x';
  }
  const CheckedFabric checked = check_fabric(as_bytes(bytes), "a.exr");
  REQUIRE(checked.issues.size() == 2);
  CHECK(checked.issues[0].place == "/referenceHeight");
  CHECK(checked.issues[1].place == "/thickness");
}
