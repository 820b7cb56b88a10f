#include "format/gltf/obj.h"

#include <doctest/doctest.h>

#include <filesystem>

#include "format/gltf/access.h"
#include "format/gltf/read_scene.h"
#include "tests/format/files.h"
#include "tests/require.h"

using namespace selvedge;
using test::Folder;

namespace {

/// A quad of 2 x 1 and a triangle without texture coordinates, in two materials.
constexpr const char* quad_and_triangle =
    "mtllib a b.mtl\n"
    "v 0 0 0\nv 2 0 0\nv 2 1 0\nv 0 1 0\nv 0 0 1\n"
    "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"
    "usemtl red cloth\nf 1/1 2/2 3/3 -2/-1\n"
    "usemtl \\\nother\nf 1 4 5 # behind\n";

Scene scene_of(const GltfDocument& document) { return test::need(read_scene(document)); }

Error refusal(const std::string& text) { return test::error_of(load_obj(text, "in/g.obj", {})); }

}  // namespace

TEST_CASE("a garment of OBJ has a primitive for each material, v upside down and smooth normals") {
  const Folder folder;
  test::write_bytes(folder / "g.obj", quad_and_triangle);
  test::write_bytes(folder / "a b.mtl",
                    "newmtl red cloth\nKd 0.5 0.25 7\nmap_Kd -s 2 2 1 -clamp on C:\\art\\the red.png\n"
                    "map_Bump -bm 1 red_Normal.png\nmap_Ke none.png\n");
  test::write_bytes(folder / "the red.png", "png");
  test::write_bytes(folder / "red_Normal.png", "png");
  const GltfDocument document = test::need(load_gltf(folder / "g.obj"));
  const Json& materials = document.json["materials"];
  const Json& red = materials[string_of(materials[0]["name"]) == "red cloth" ? 0 : 1];
  CHECK(red["pbrMetallicRoughness"]["baseColorFactor"] == Json::array({0.5, 0.25, 1.0, 1}));
  const auto picture = [&](const Json& texture) {
    return string_of(document.json["images"][texture["index"].get<int>()]["uri"]);
  };
  CHECK(picture(red["pbrMetallicRoughness"]["baseColorTexture"]) == "the%20red.png");
  CHECK(picture(red["normalTexture"]) == "red_Normal.png");
  CHECK_FALSE(red.contains("emissiveTexture"));  // is not there
  CHECK_FALSE(red.contains("emissiveFactor"));
  const Scene scene = scene_of(document);
  REQUIRE(scene.primitives.size() == 2);
  const bool first = !scene.primitives[0].tex_coords[0].empty();
  const ScenePrimitive& quad = scene.primitives[first ? 0 : 1];
  const ScenePrimitive& triangle = scene.primitives[first ? 1 : 0];
  CHECK(quad.indices == std::vector<std::uint32_t>{0, 1, 2, 0, 2, 3});
  CHECK(quad.tex_coords[0] == std::vector<V2d>{{0, 1}, {1, 1}, {1, 0}, {0, 0}});
  CHECK(triangle.tex_coords[0].empty());
  // By area: the corner at the origin belongs to the quad, of area 2 to z, and the triangle, of area 1 / 2 to
  // -x or x.
  const V3f corner = quad.normals[0];
  CHECK(std::abs(corner.x / corner.z) == doctest::Approx(0.5 / 2).epsilon(1e-6));
  CHECK(quad.normals[1] == V3f(0, 0, 1));
}

TEST_CASE("a garment of OBJ keeps the normals and vertices that its corners name") {
  const std::string text =
      "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0.5\nvt 0 0\nvn 0 0 2\nvn 0 1 0\nf 1/1/1 2/1/2 3/2/1\nf 3/2/1 2/1/2 "
      "1/2/1\n";
  const Scene scene = scene_of(test::need(load_obj(text, "g.obj", {})));
  REQUIRE(scene.primitives.size() == 1);
  CHECK(scene.primitives[0].positions.size() == 4);  // (1, first uv) and (1, second uv) are two
  CHECK(scene.primitives[0].normals[0] == V3f(0, 0, 1));
  CHECK(scene.primitives[0].normals[1] == V3f(0, 1, 0));
  CHECK(scene.primitives[0].tex_coords[0][0] == V2d(0.5, 1));
}

TEST_CASE("a garment of OBJ glows by its picture, and names in Latin-1 can be saved") {
  const Folder folder;
  test::write_bytes(folder / "m.mtl", "newmtl caf\xE9\nKd 1 0 0\nmap_Ke glow.png\n");
  test::write_bytes(folder / "glow.png", "png");
  const std::string text = "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl caf\xE9\nf 1 2 3\n";
  const GltfDocument document = test::need(load_obj(text, folder / "g.obj", {}));
  const Json& material = document.json["materials"][0];
  CHECK(string_of(material["name"]) == "caf\\xE9");
  CHECK(material["pbrMetallicRoughness"]["baseColorFactor"] == Json::array({1.0, 0.0, 0.0, 1}));
  CHECK(material["emissiveFactor"] == Json::array({1, 1, 1}));
  CHECK(material.contains("emissiveTexture"));
  CHECK(save_gltf(document, folder / "g.gltf"));
}

TEST_CASE("damaged garments of OBJ are refused with the line, and files outside are not opened") {
  const std::string points = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
  CHECK(refusal(points).code == Code::gltf_malformed);
  CHECK(to_line(refusal(points + "f 1 2\n")) ==
        "in/g.obj: line 4: a face needs three corners [FILE_DAMAGED]");
  for (const char* face : {"f 1 2 4", "f 1 2 0", "f 1 2 -4", "f 1 2 x", "f 1/1 2/1 3/1", "f 1//1 2 3"})
    CHECK(refusal(points + face).place == "line 4");
  CHECK(refusal("v 0 nan 0\n").code == Code::mesh_not_finite);
  CHECK(refusal(points + "vt 1e99 0\n").code == Code::file_damaged);
  CHECK(refusal("mtllib ../secret.mtl\n" + points + "f 1 2 3\n").code == Code::gltf_reference);
  const Error large = test::error_of(load_obj(points + "f 1 2 3\n", "g.obj", {.memory = 200}));
  CHECK(large.code == Code::file_too_large);
  const Folder folder;
  test::write_bytes(folder / "m.mtl", "newmtl a\nmap_Kd ../../up.png\n");
  CHECK(test::error_of(load_obj("mtllib m.mtl\n" + points + "usemtl a\nf 1 2 3\n", folder / "g.obj", {}))
            .code == Code::gltf_reference);
}
