#include "format/gltf/document.h"

#include <doctest/doctest.h>

#include <filesystem>

#include "format/base/atomic_file.h"
#include "format/gltf/edit.h"
#include "format/gltf/read_scene.h"
#include "tests/format/garments.h"
#include "tests/format/gltf_fixtures.h"
#include "tests/require.h"

using namespace selvedge;
using test::bytes_of;
using test::Folder;
using test::glb;
using test::square;
namespace fs = std::filesystem;

namespace {

constexpr SceneLimits anywhere{.document = {.external_files = ExternalFiles::anywhere}};

/// A triangle with `extra` put in front of the root's members.
std::string triangle(const std::string& extra = "",
                     const std::string& bytes = bytes_of<float>({0, 0, 0, 1, 0, 0, 0, 1, 0})) {
  return glb("{" + extra +
                 R"("asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],
    "meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],
    "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}],
    "bufferViews":[{"buffer":0,"byteLength":36}],"buffers":[{"byteLength":)" +
                 std::to_string(bytes.size()) + "}]}",
             bytes);
}

}  // namespace

TEST_CASE("gltf: a written garment is read back as it was, and is the same each time") {
  const Folder folder;
  REQUIRE(write_garment(folder / "a.glb", square()));
  REQUIRE(write_garment(folder / "b.glb", square()));
  CHECK(*read_file(folder / "a.glb") == *read_file(folder / "b.glb"));
  const Scene scene = test::need(read_scene(folder / "a.glb"));
  REQUIRE(scene.primitives.size() == 1);
  CHECK(scene.primitives[0].positions == square().primitives[0].positions);
  CHECK(scene.primitives[0].tex_coords[0] == std::vector<V2d>{V2d(0, 1), V2d(1, 1), V2d(1, 0), V2d(0, 0)});
  CHECK(scene.primitives[0].indices == square().primitives[0].indices);
  CHECK(scene.materials[0].name == "cloth 0");
  CHECK(scene.remarks.empty());
}

TEST_CASE("gltf: a document that is not to open other files refuses their URIs, and data URIs are its own") {
  const Folder folder;
  test::write_bytes(folder / "three.bin", "abc");
  const auto load = [&](const std::string& uri, ExternalFiles external_files) {
    const std::string text =
        R"({"asset":{"version":"2.0"},"buffers":[{"byteLength":3,"uri":")" + uri + R"("}]})";
    return load_gltf({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()},
                     folder / "memory.gltf", {.external_files = external_files});
  };
  const std::vector<std::vector<std::uint8_t>> abc{{'a', 'b', 'c'}};
  REQUIRE(load("three.bin", ExternalFiles::in_folder));
  CHECK(load("three.bin", ExternalFiles::in_folder)->buffers == abc);
  REQUIRE_FALSE(load("three.bin", ExternalFiles::none));
  CHECK(load("three.bin", ExternalFiles::none).error().code == Code::gltf_unsupported);
  REQUIRE(load("data:application/octet-stream;base64,YWJj", ExternalFiles::none));
  CHECK(load("data:application/octet-stream;base64,YWJj", ExternalFiles::none)->buffers == abc);
}

TEST_CASE("gltf: hidden nodes are left out, and an empty default scene is another one") {
  const Folder folder;
  REQUIRE(write_file(folder / "a.glb", triangle()));
  struct Case {
    const char* nodes;
    const char* scenes;
    std::size_t triangles;
    const char* remark;
  };
  const char* const hidden = "nodes that KHR_node_visibility hides are left out";
  const char* const other = "scene 0, the default one, shows no mesh: scene 1 \"worn\" is read";
  const char* const one = R"([{"nodes": [0]}])";
  for (
      const Case& c :
      {Case{R"([{"mesh": 0}])", one, 1, ""},
       {R"([{"mesh": 0, "children": [1]}, {"mesh": 0, "extensions": {"KHR_node_visibility": {"visible": false}}}])",
        one, 1, hidden},
       {R"([{"children": [1], "extensions": {"KHR_node_visibility": {"visible": false}}}, {"mesh": 0, "extensions":
            {"KHR_node_visibility": {"visible": true}}}])",
        one, 0, hidden},
       {R"([{"mesh": 0, "extensions": {"KHR_node_visibility": {}}}])", one, 1, ""},
       {R"([{"mesh": 0}])", R"([{}, {"name": "worn", "nodes": [0]}])", 1, other},
       {R"([{}, {"children": [2]}, {"mesh": 0}])", R"([{"nodes": [0]}, {"name": "worn", "nodes": [1]}])", 1,
        other}}) {
    CAPTURE(c.nodes);
    GltfDocument document = test::need(load_gltf(folder / "a.glb"));
    document.json["nodes"] = Json::parse(c.nodes);
    document.json["scenes"] = Json::parse(c.scenes);
    const Scene scene = test::need(read_scene(document));
    CHECK(scene.instances.size() == c.triangles);
    CHECK(scene.remarks ==
          (*c.remark == '\0' ? std::vector<std::string>() : std::vector<std::string>{c.remark}));
    IssueSink issues("a.glb");
    CHECK(read_whole_document(document, {}, issues).instances.size() == c.triangles);
    CHECK_FALSE(issues.has_error());
  }
}

TEST_CASE("gltf: node transforms multiply from the leaf to the root") {
  const Folder folder;
  std::string file = triangle();
  REQUIRE(write_file(folder / "a.glb", file));
  GltfDocument document = test::need(load_gltf(folder / "a.glb"));
  // A quarter turn about z after doubling, then one step along x: (1, 0, 0) -> (0, 2, 0) -> (3, 2, 0).
  document.json["nodes"] = Json::parse(R"([{"translation":[3,0,0],"children":[1]},
      {"mesh":0,"rotation":[0,0,0.70710678118654752,0.70710678118654752],"scale":[2,2,2]}])");
  const Scene scene = test::need(read_scene(document));
  REQUIRE(scene.instances.size() == 1);
  const V3d point = V3d(1, 0, 0) * scene.instances[0].world;
  CHECK((point - V3d(3, 2, 0)).length() < 1e-12);
}

TEST_CASE("gltf: strips and fans become triangles with their winding") {
  const Folder folder;
  REQUIRE(write_garment(folder / "a.glb", square()));
  GltfDocument document = test::need(load_gltf(folder / "a.glb"));
  Json& primitive = document.json["meshes"][0]["primitives"][0];
  primitive["indices"] = append_index_accessor(document, std::vector<std::uint32_t>{0, 1, 3, 2});
  document.json["meshes"][0]["primitives"][0]["mode"] = 5;
  Result<Scene> scene = read_scene(document);
  REQUIRE(scene);
  CHECK(scene->primitives[0].indices == std::vector<std::uint32_t>{0, 1, 3, 1, 2, 3});
  document.json["meshes"][0]["primitives"][0]["mode"] = 6;
  scene = read_scene(document);
  REQUIRE(scene);
  CHECK(scene->primitives[0].indices == std::vector<std::uint32_t>{1, 3, 0, 3, 2, 0});
}

TEST_CASE("gltf: a primitive without normals gets flat ones") {
  const Folder folder;
  REQUIRE(write_file(folder / "a.glb", triangle()));
  const Scene scene = test::need(read_scene(folder / "a.glb"));
  CHECK(scene.primitives[0].normals == std::vector<V3f>(3, V3f(0, 0, 1)));
}

TEST_CASE("gltf: saving keeps every member, in the same order, and drops only unused bytes") {
  const Folder folder;
  const std::string odd =
      R"("extras":{"z":[1,2.5,{"a":null}]},"extensionsUsed":["X_unknown"],)"
      R"("extensions":{"X_unknown":{"view":{"buffer":0,"byteOffset":36,"byteLength":4}}},)";
  const std::string bytes = bytes_of<float>({0, 0, 0, 1, 0, 0, 0, 1, 0}) + "datarest";
  REQUIRE(write_file(folder / "a.glb", triangle(odd, bytes)));
  const GltfDocument before = test::need(load_gltf(folder / "a.glb"));
  REQUIRE(save_gltf(before, folder / "b.glb"));
  const GltfDocument after = test::need(load_gltf(folder / "b.glb"));
  CHECK(after.buffers[0].size() == 40);
  Json expected = before.json;
  expected["buffers"][0]["byteLength"] = 40;
  expected["bufferViews"][0]["byteOffset"] = 0;
  CHECK(after.json == expected);
  const Json& view = after.json["extensions"]["X_unknown"]["view"];
  const auto offset = view["byteOffset"].get<std::size_t>();
  CHECK(std::string(after.buffers[0].begin() + static_cast<std::ptrdiff_t>(offset), after.buffers[0].end()) ==
        "data");
}

TEST_CASE("gltf: a .gltf is written with one buffer beside it, and never over the input's") {
  const Folder folder;
  REQUIRE(write_garment(folder / "a.glb", square()));
  REQUIRE(save_gltf(*load_gltf(folder / "a.glb"), folder / "b.gltf"));
  CHECK(fs::exists(folder / "b.bin"));
  // c.gltf lies upon b.bin; writing it again as b.gltf elsewhere must leave b.bin alone.
  REQUIRE(write_file(folder / "c.gltf", *read_file(folder / "b.gltf")));
  fs::remove(folder / "b.gltf");
  REQUIRE(save_gltf(*load_gltf(folder / "c.gltf"), folder / "b.gltf"));
  CHECK(fs::exists(folder / "b-1.bin"));
  CHECK(read_scene(folder / "b.gltf").has_value());
  CHECK(read_scene(folder / "c.gltf").has_value());
}

TEST_CASE("gltf: pictures are found from another folder, or go into the GLB byte for byte") {
  const Folder folder;
  fs::create_directories(folder.path() / "in put");
  fs::create_directories(folder.path() / "out");
  REQUIRE(write_file(folder / "in put/pic ture.png", std::string("\x89PNG picture")));
  REQUIRE(write_file(folder / "in put/a.gltf",
                     R"({"asset":{"version":"2.0"},"images":[{"uri":"pic%20ture.png"},{"uri":"none.png"}],)"
                     R"("textures":[{"source":0},{"source":1}],"materials":[)"
                     R"({"pbrMetallicRoughness":{"baseColorTexture":{"index":0}}},)"
                     R"({"pbrMetallicRoughness":{"baseColorTexture":{"index":1}}}]})"));
  for (const char* name : {"out/b.gltf", "out/b.glb"}) {
    REQUIRE(save_gltf(*load_gltf(folder / "in put/a.gltf"), folder / name));
    const Scene scene = test::need(read_scene(folder / name, anywhere));
    REQUIRE(scene.images.size() == 1);
    CHECK(std::string(scene.images[0].bytes.begin(), scene.images[0].bytes.end()) == "\x89PNG picture");
    CHECK(scene.materials[1].base_color_texture.image == -1);
    CHECK(scene.remarks.size() == 1);
  }
  CHECK(test::error_of(read_scene(folder / "out/b.gltf")).code == Code::gltf_reference);
  CHECK(load_gltf(folder / "out/b.gltf", anywhere.document)->json["images"][1]["uri"] == "none.png");
}

TEST_CASE("gltf: the texture transform turns as Khronos' test model does") {
  // TextureTransformTest: the arrow's tip is at (0.7778, 0.7778) of the picture; the green marker for
  // rotation 22.5 degrees lies at (0.4210, 1.0163) of the quad, the one for scale 1.5 at (0.5185, 0.5185).
  UvTransform turned{.rotation = 0.39269908169872414};
  CHECK((turned.apply(V2d(0.42095177560159874, 1.0162674857624154)) - V2d(0.7778174593, 0.7778174593))
            .length() < 1e-9);
  UvTransform scaled{.scale = V2d(1.5, 1.5)};
  CHECK(
      (scaled.apply(V2d(0.5185449728701348, 0.5185449728701348)) - V2d(0.7778174593, 0.7778174593)).length() <
      1e-9);
}
