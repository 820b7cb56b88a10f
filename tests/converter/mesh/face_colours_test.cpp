#include <doctest/doctest.h>

#include <cstdint>
#include <tuple>

#include "tests/converter/mesh_texts.h"

using namespace selvedge;
using namespace selvedge::testing;

namespace {

/// Two triangles with a common side, red and green.
void check_red_and_green(const CellMesh& mesh) {
  REQUIRE(mesh.triangles.size() == 2);
  CHECK(mesh.positions.size() == 6);  // two of the four corners are of two colours
  for (std::size_t t = 0; t < 2; ++t) {
    for (int k = 0; k < 3; ++k) {
      const V3f& albedo = mesh.albedo[mesh.triangles[t][k]];
      CHECK(albedo == (t == 0 ? V3f(1, 0, 0) : V3f(0, 1, 0)));
    }
  }
}

std::string stl_with_colours(const std::string& title, const std::vector<std::uint16_t>& colours) {
  std::string bytes = title;
  bytes.resize(80, ' ');
  const auto append = [&](const auto& value) {
    bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
  };
  append(static_cast<std::uint32_t>(colours.size()));
  for (std::size_t t = 0; t < colours.size(); ++t) {
    const float x = t == 0 ? 0 : 1;
    for (const float value : {0.F, 0.F, 1.F, x, 0.F, 0.F, 1.F, x, 0.F, 0.F, 1.F, 0.F}) append(value);
    append(colours[t]);
  }
  return bytes;
}

}  // namespace

TEST_CASE("colours of faces are kept: OFF, PLY, OBJ with its material file, binary STL of both kinds") {
  check_red_and_green(
      read_text("f.off", "OFF\n4 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2 255 0 0\n3 0 2 3 0 255 0\n"));
  check_red_and_green(read_text(
      "g.off", "OFF\n4 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2 1.0 0.0 0.0\n3 0 2 3 0.0 1.0 0.0\n"));
  check_red_and_green(read_text(
      "f.ply",
      "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
      "element face 2\nproperty list uchar int vertex_indices\nproperty uchar red\nproperty uchar green\n"
      "property uchar blue\nend_header\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2 255 0 0\n3 0 2 3 0 255 0\n"));
  const std::string materials = "newmtl red one\nKd 1 0 0\n# x\nnewmtl green\nNs 3\nKd 0 1 0\n";
  check_red_and_green(read_text("f.obj",
                                "mtllib colours.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"
                                "usemtl red one\nf 1 2 3\nusemtl green\nf 1 3 4\n",
                                two_by_two, materials));
  // Without its material file, and with one elsewhere, an OBJ file is grey.
  for (const char* name : {"none.mtl", "../colours.mtl"}) {
    CHECK(read_text("grey.obj",
                    std::string("mtllib ") + name + "\nv 0 0 0\nv 1 0 0\nv 1 1 0\nusemtl green\nf 1 2 3\n",
                    two_by_two, materials)
              .albedo[0] == V3f(0.5F));
  }
  for (const auto& [title, red, none] :
       {std::tuple("plain", std::uint16_t{0x8000 | 31 << 10}, std::uint16_t{0}),
        std::tuple("COLOR=abcd", std::uint16_t{31}, std::uint16_t{0x8000})}) {
    const std::string named = title;  // Clang 14 captures no bindings.
    CAPTURE(named);
    const CellMesh mesh = read_text("f.stl", stl_with_colours(title, {red, none}));
    CHECK(mesh.albedo[mesh.triangles[0].x] == V3f(1, 0, 0));
    CHECK(mesh.albedo[mesh.triangles[1].x] == V3f(0.5F));
  }
}

TEST_CASE("OFF vertices keep their colours, behind normals too, and comments say nothing") {
  const CellMesh bytes = read_text("v.off",
                                   "# x\nCNOFF # y\n3 1 0\n0 0 0 0 0 1 255 0 0 # red\n1 0 0 0 0 1 0 255 0\n\n"
                                   "0 1 0 0 0 1 0 0 255 255\n3 0 1 2\n");
  CHECK(bytes.albedo == std::vector<V3f>{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}});
  const CellMesh floats =
      read_text("w.off", "COFF\n3 1 0\n0 0 0 0.25 0.5 1\n1 0 0 1.0 0 0\n0 1 0 0.0 0 1\n3 0 1 2\n");
  CHECK(floats.albedo[0] == V3f(0.25F, 0.5F, 1));
}

TEST_CASE("a vertex whose faces have one colour stays one, and normals stay those of the whole") {
  const CellMesh mesh =
      read_text("same.off", "OFF\n4 2 0\n0 0 0\n1 0 0\n1 1 0.5\n0 1 0\n3 0 1 2 255 0 0\n3 0 2 3 255 0 0\n");
  CHECK(mesh.positions.size() == 4);
  const CellMesh split =
      read_text("split.off", "OFF\n4 2 0\n0 0 0\n1 0 0\n1 1 0.5\n0 1 0\n3 0 1 2 255 0 0\n3 0 2 3 0 0 255\n");
  REQUIRE(split.positions.size() == 6);
  for (std::size_t v = 0; v < 6; ++v) {
    for (std::size_t w = 0; w < 4; ++w) {
      if (split.positions[v] == mesh.positions[w]) CHECK(split.normals[v] == mesh.normals[w]);
    }
  }
}
