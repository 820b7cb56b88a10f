#include "format/gltf/mesh_document.h"

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <bit>

#include "format/gltf/access.h"
#include "format/gltf/read_scene.h"
#include "format/gltf/uri.h"
#include "format/picture/image.h"
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

/// A square of two triangles or one quad, 2 x 1, with texture coordinates at its vertices.
std::string square(const std::string& u = "s", const std::string& v = "t") {
  return "ply\nformat ascii 1.0\ncomment TextureFile the red.png\nelement vertex 4\nproperty float x\n"
         "property float y\nproperty float z\nproperty uchar red\nproperty float " +
         u + "\nproperty float " + v +
         "\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
         "0 0 0 255 0 0\n2 0 0 255 1 0\n2 1 0 255 1 1\n0 1 0 255 0 1\n4 0 1 2 3\n";
}

/// The same in binary, with texture coordinates at the corners of its faces, of which the second has none.
std::string binary(bool big) {
  std::string text = "ply\r\nformat binary_" + std::string(big ? "big" : "little") +
                     "_endian 1.0\r\nelement vertex 4\r\nproperty double x\r\nproperty double y\r\n"
                     "property double z\r\nproperty float nx\r\nproperty float ny\r\nproperty float nz\r\n"
                     "element face 2\r\nproperty list uchar uint vertex_index\r\n"
                     "property list uchar float texcoord\r\nproperty int texnumber\r\nend_header\r\n";
  const auto put = [&](auto value, std::size_t size) {
    for (std::size_t i = 0; i < size; ++i)
      text += static_cast<char>(value >> 8 * (big ? size - 1 - i : i) & 255U);
  };
  const auto real = [&](double value) { put(std::bit_cast<std::uint64_t>(value), 8); };
  const auto single = [&](float value) { put(std::bit_cast<std::uint32_t>(value), 4); };
  for (const auto& [x, y] : {std::pair(0.0, 0.0), {2.0, 0.0}, {2.0, 1.0}, {0.0, 1.0}}) {
    for (const double value : {x, y, 0.0}) real(value);
    for (const float value : {0.0F, 0.0F, 2.0F}) single(value);
  }
  for (const bool with : {true, false}) {
    put(3U, 1);
    for (const std::uint32_t corner : {0U, with ? 1U : 2U, with ? 2U : 3U}) put(corner, 4);
    put(with ? 6U : 0U, 1);
    if (with)
      for (const float value : {0.0F, 0.0F, 1.0F, 0.0F, 1.0F, 1.0F}) single(value);
    put(0U, 4);
  }
  return text;
}

Scene scene_of(const GltfDocument& document) { return test::need(read_scene(document)); }

Error refusal(const std::string& text, const char* path = "in/g.obj") {
  return test::error_of(load_mesh_document(text, path, {}));
}

Error ply_refusal(const std::string& text) { return refusal(text, "in/g.ply"); }

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
  const Scene scene = scene_of(test::need(load_mesh_document(text, "g.obj", {})));
  REQUIRE(scene.primitives.size() == 1);
  CHECK(scene.primitives[0].positions.size() == 4);  // (1, first uv) and (1, second uv) are two
  CHECK(scene.primitives[0].normals[0] == V3f(0, 0, 1));
  CHECK(scene.primitives[0].normals[1] == V3f(0, 1, 0));
  CHECK(scene.primitives[0].tex_coords[0][0] == V2d(0.5, 1));
}

TEST_CASE("a garment of OBJ is cut by map_d") {
  const Folder folder;
  const auto save = [&](const char* name, const Image& image) {
    REQUIRE(write_png(folder / name, image, Transfer::keep));
  };
  save("red.png", {1, 1, 3, {1, 0, 0}});
  save("grey.png", {2, 1, 1, {1, 0}});
  save("alpha.png", {2, 1, 4, {0, 0, 0, 1, 1, 1, 1, 0}});
  for (const auto& [maps, red, uri] : {std::tuple("map_Kd red.png\nmap_d grey.png", 0.0F, ""),
                                       {"map_d alpha.png", 1.0F, ""},
                                       {"map_Kd red.png\nmap_d -imfchan m alpha.png", 0.0F, ""},
                                       {"map_Kd red.png\nmap_d red.png", 0.0F, "red.png"}}) {
    CAPTURE(maps);
    test::write_bytes(folder / "m.mtl", std::string("newmtl m\n") + maps);
    const GltfDocument document = test::need(load_mesh_document(
        "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl m\nf 1 2 3\n", folder / "g.obj", {}));
    CHECK(document.json["materials"][0]["alphaMode"] == "MASK");
    REQUIRE(document.json["images"].size() == 1);
    if (string_of(member(document.json["images"][0], "uri")) == "red.png") {
      CHECK(std::string(uri) == "red.png");
      continue;
    }
    const Image image =
        test::need(decode_image(test::need(read_image_bytes(document, 0)), "", Transfer::keep));
    CHECK(image.pixels == std::vector<float>{1, red, red, 1, 1, red, red, 0});
  }
}

TEST_CASE("a garment of OBJ glows by its picture, and names in Latin-1 can be saved") {
  const Folder folder;
  test::write_bytes(folder / "m.mtl", "newmtl caf\xE9\nKd 1 0 0\nmap_Ke glow.png\n");
  test::write_bytes(folder / "glow.png", "png");
  const std::string text = "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl caf\xE9\nf 1 2 3\n";
  const GltfDocument document = test::need(load_mesh_document(text, folder / "g.obj", {}));
  const Json& material = document.json["materials"][0];
  CHECK(string_of(material["name"]) == "caf\\xE9");
  CHECK(material["pbrMetallicRoughness"]["baseColorFactor"] == Json::array({1.0, 0.0, 0.0, 1}));
  CHECK(material["emissiveFactor"] == Json::array({1, 1, 1}));
  CHECK(material.contains("emissiveTexture"));
  CHECK(save_gltf(document, folder / "g.gltf"));
}

TEST_CASE("colours of vertices are sRGB, of 1 or 255, and white is no colour") {
  const auto obj = [](const char* first) {
    return fmt::format("v 0 0 0 {}\nv 1 0 0 1 1 1\nv 0 1 0\nf 1 2 3\n", first);
  };
  const auto ply = [](const char* type, const char* first) {
    return fmt::format(
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
        "property {0} red\nproperty {0} green\nproperty {0} blue\nelement face 1\n"
        "property list uchar int vertex_indices\nend_header\n0 0 0 {1}\n1 0 0 {1}\n0 1 0 {1}\n3 0 1 2\n",
        type, first);
  };
  for (const auto& [text, path] : {std::pair(obj("1 0.5 0"), "g.obj"),
                                   {obj("255 127.5 0"), "g.obj"},
                                   {ply("uchar", "255 128 0"), "g.ply"},
                                   {ply("ushort", "65535 32768 0"), "g.ply"},
                                   {ply("float", "1 0.5 0"), "g.ply"},
                                   {ply("float", "255 127.5 0"), "g.ply"}}) {
    CAPTURE(text);
    const ScenePrimitive p = scene_of(test::need(load_mesh_document(text, path, {}))).primitives[0];
    REQUIRE(p.colors.size() == 3);
    CHECK(p.colors[0].x == 1);
    CHECK(p.colors[0].y == doctest::Approx(0.2140).epsilon(0.01));  // IEC 61966-2-1
    CHECK(p.colors[0].z == 0);
    if (path == std::string("g.obj")) CHECK(p.colors[2] == V4f(1, 1, 1, 1));
  }
  CHECK(scene_of(test::need(load_mesh_document(obj("1 1 1"), "g.obj", {}))).primitives[0].colors.empty());
}

TEST_CASE("materials of OBJ: what programs write otherwise is understood, and what is missing is told") {
  struct Case {
    const char* mtl;     ///< of material "a b", in the file "M.mtl"
    Json factor;         ///< of the base colour
    const char* uri;     ///< of its picture
    const char* remark;  ///< "": none
    const char* head = "mtllib M.mtl\nusemtl a b\n";
  };
  const Json none;
  for (const Case& c :
       {Case{"Kd 0 0 0\nmap_Kd print.png", none, "print.png", ""},
        Case{"map_kd print.png\nKd 0 0 0", none, "print.png", ""},
        Case{"Kd 0 0 0", {0.0, 0.0, 0.0, 1}, "", ""}, Case{"Kd 0.5", {0.5, 0.5, 0.5, 1}, "", ""},
        Case{"Kd 0 0 0\nmap_Kd none.png", none, "", "materials: none.png: no such file"},
        Case{"map_Kd PRINT.png", none, "print.png", "\"print.png\" is read"},
        Case{"map_Kd tex\\print.png", none, "print.png", "\"print.png\" is read"},
        Case{"map_Kd -clamp on C:\\art\\print.png", none, "print.png", ""},
        Case{"map_Kd -s 1 1 1 2 cloth.png", none, "2%20cloth.png", ""},
        Case{"map_Kd print.png\nmap_d mask.png", none, "print.png", "map_d: mask.png: no such file"},
        Case{"", none, "", "nowhere.mtl: no such file", "mtllib nowhere.mtl\nusemtl a b\n"},
        Case{"map_Kd print.png", none, "print.png", "\"M.mtl\" is read", "mtllib m.MTL\nusemtl a b\n"},
        Case{"map_Kd print.png", none, "print.png", "none.mtl: no such file",
             "mtllib none.mtl M.mtl\nusemtl a b\n"},
        Case{"map_Kd print.png", none, "", "no material file has \"y\", \"x\"",
             "mtllib M.mtl\nusemtl y\nf 1 2 3\nusemtl x\n"},
        Case{"map_Kd print.png", none, "", "no material file has \"a b\"", "usemtl a b\n"}}) {
    CAPTURE(std::string(c.mtl));
    CAPTURE(std::string(c.head));
    const Folder folder;
    test::write_bytes(folder / "M.mtl", std::string("newmtl a b\n") + c.mtl);
    test::write_bytes(folder / "print.png", "png");
    test::write_bytes(folder / "2 cloth.png", "png");
    const std::string text = std::string("v 0 0 0\nv 1 0 0\nv 0 1 0\n") + c.head + "f 1 2 3\n";
    const GltfDocument document = test::need(load_mesh_document(text, folder / "g.obj", {}));
    const Json& core = document.json["materials"][0]["pbrMetallicRoughness"];
    CHECK(member(core, "baseColorFactor") == c.factor);
    const Json& images = array_member(document.json, "images");
    CHECK((images.empty() ? "" : string_of(images[0]["uri"])) == c.uri);
    const auto told = [&](const std::string& line) { return line.find(c.remark) != std::string::npos; };
    if (*c.remark == '\0')
      CHECK(document.remarks.empty());
    else
      CHECK(std::ranges::any_of(document.remarks, told));
  }
}

TEST_CASE("a map of OBJ is scaled and moved as MTL says, v upwards") {
  const Folder folder;
  test::write_bytes(folder / "g.mtl", "newmtl a\nmap_Kd -s 2 4 -o 0.25 0.5 print.png\n");
  test::write_bytes(folder / "print.png", "png");
  const std::string text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0.1 0.2\nusemtl a\nf 1/1 2/1 3/1\n";
  // The material file of the garment's own name.
  const GltfDocument document = test::need(load_mesh_document(text, folder / "g.obj", {}));
  const Scene scene = scene_of(document);
  const V2d uv = scene.materials[0].base_color_texture.transform.apply(scene.primitives[0].tex_coords[0][0]);
  CHECK(uv.x == doctest::Approx(0.1 * 2 + 0.25));
  CHECK(uv.y == doctest::Approx(1 - (0.2 * 4 + 0.5)));
}

TEST_CASE("damaged garments of OBJ are refused with the line, and files outside are not opened") {
  const std::string points = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
  CHECK(refusal(points).code == Code::gltf_malformed);
  CHECK(to_line(refusal(points + "f 1 2\n")) ==
        "in/g.obj: line 4: a face needs three corners [FILE_DAMAGED]");
  for (const char* face : {"f 1/1 2/1 3/1", "f 1//1 2 3"}) CHECK(refusal(points + face).place == "line 4");
  CHECK(refusal(points + "vt 1e99 0\n").code == Code::file_damaged);
  CHECK(refusal("mtllib ../secret.mtl\n" + points + "f 1 2 3\n").code == Code::gltf_reference);
  const Error large = test::error_of(load_mesh_document(points + "f 1 2 3\n", "g.obj", {.memory = 200}));
  CHECK(large.code == Code::file_too_large);
  const Folder folder;
  test::write_bytes(folder / "m.mtl", "newmtl a\nmap_Kd ../../up.png\n");
  CHECK(test::error_of(
            load_mesh_document("mtllib m.mtl\n" + points + "usemtl a\nf 1 2 3\n", folder / "g.obj", {}))
            .code == Code::gltf_reference);
}

TEST_CASE("a garment of PLY has the texture coordinates of its vertices, upside down, and its picture") {
  const Folder folder;
  test::write_bytes(folder / "the red.png", "png");
  for (const auto& [u, v] : {std::pair("s", "t"), {"u", "v"}, {"texture_u", "texture_v"}}) {
    test::write_bytes(folder / "g.ply", square(u, v));
    const GltfDocument document = test::need(load_gltf(folder / "g.ply"));
    CHECK(document.json["images"][0]["uri"] == "the%20red.png");
    const Scene scene = test::need(read_scene(document));
    REQUIRE(scene.primitives.size() == 1);
    const ScenePrimitive& p = scene.primitives[0];
    CHECK(p.indices == std::vector<std::uint32_t>{0, 1, 2, 0, 2, 3});
    CHECK(p.positions[2] == V3f(2, 1, 0));
    CHECK(p.tex_coords[0] == std::vector<V2d>{{0, 1}, {1, 1}, {1, 0}, {0, 0}});
    CHECK(p.normals[0] == V3f(0, 0, 1));
    CHECK(scene.materials[p.material].name == "cloth");
    CHECK(scene.materials[p.material].double_sided);
  }
}

TEST_CASE("a garment of binary PLY has the texture coordinates of its faces, and those without apart") {
  for (const bool big : {false, true}) {
    const GltfDocument document = test::need(load_mesh_document(binary(big), "g.ply", {}));
    const Scene scene = test::need(read_scene(document));
    REQUIRE(scene.primitives.size() == 2);
    const bool first = !scene.primitives[0].tex_coords[0].empty();
    const ScenePrimitive& with = scene.primitives[first ? 0 : 1];
    const ScenePrimitive& without = scene.primitives[first ? 1 : 0];
    CHECK(with.tex_coords[0] == std::vector<V2d>{{0, 1}, {1, 1}, {1, 0}});
    CHECK(with.positions == std::vector<V3f>{{0, 0, 0}, {2, 0, 0}, {2, 1, 0}});
    CHECK(with.normals == std::vector<V3f>(3, V3f(0, 0, 1)));
    CHECK(without.tex_coords[0].empty());
    CHECK(without.positions == std::vector<V3f>{{0, 0, 0}, {2, 1, 0}, {0, 1, 0}});
  }
}

TEST_CASE("PLY garments without faces, with pictures outside or too large are refused in one line") {
  const std::string good = square();
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string text = good;
    text.replace(text.find(from), from.size(), to);
    return text;
  };
  CHECK(ply_refusal(with("4 0 1 2 3", "2 0 1")).code == Code::gltf_malformed);
  CHECK(ply_refusal(with("255 1 1", "255 nan 1")).code == Code::file_damaged);
  CHECK(ply_refusal(with("element face 1", "element hair 1")).code == Code::gltf_malformed);
  CHECK(ply_refusal(with("TextureFile the red.png", "TextureFile ../../a.png")).code == Code::gltf_reference);
  GltfLimits little{.memory = good.size() + 500};
  CHECK(test::error_of(load_mesh_document(good, "g.ply", little)).code == Code::file_too_large);
}
