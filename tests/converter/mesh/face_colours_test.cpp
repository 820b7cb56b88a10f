#include <doctest/doctest.h>

#include <string>

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

/// A square of two triangles with colours of its faces, as PLY.
std::string square_of(const std::string& type, const std::string& first, const std::string& second) {
  std::string out =
      "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
      "element face 2\nproperty list uchar int vertex_indices\n";
  for (const char* colour : {"red", "green", "blue"}) out += "property " + type + " " + colour + "\n";
  return out + "end_header\n0 0 0\n1 0 0\n1 1 0.5\n0 1 0\n3 0 1 2 " + first + "\n3 0 2 3 " + second + "\n";
}

}  // namespace

TEST_CASE("colours of faces are kept: PLY of bytes and floats, OBJ with its material file") {
  check_red_and_green(read_text("bytes.ply", square_of("uchar", "255 0 0", "0 255 0")));
  check_red_and_green(read_text("floats.ply", square_of("float", "1 0 0", "0 1 0")));
  const std::string materials = "newmtl red one\nKd 1 0 0\n# x\nnewmtl green\nNs 3\nKd 0 1 0\n";
  check_red_and_green(read_text("f.obj",
                                "mtllib colours.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"
                                "usemtl red one\nf 1 2 3\nusemtl green\nf 1 3 4\n",
                                two_by_two, materials));
  // Without its material file, and with one elsewhere, an OBJ file is grey.
  for (const char* name : {"none.mtl", "../colours.mtl"})
    CHECK(read_text("grey.obj",
                    std::string("mtllib ") + name + "\nv 0 0 0\nv 1 0 0\nv 1 1 0\nusemtl green\nf 1 2 3\n",
                    two_by_two, materials)
              .albedo[0] == V3f(0.5F));
}

TEST_CASE("a vertex whose faces have one colour stays one, and normals are means over the whole") {
  const CellMesh mesh = read_text("same.ply", square_of("uchar", "255 0 0", "255 0 0"));
  CHECK(mesh.positions.size() == 4);
  const CellMesh split = read_text("split.ply", square_of("uchar", "255 0 0", "0 0 255"));
  REQUIRE(split.positions.size() == 6);
  for (std::size_t v = 0; v < 6; ++v)
    for (std::size_t w = 0; w < 4; ++w)
      if (split.positions[v] == mesh.positions[w]) CHECK(split.normals[v] == mesh.normals[w]);
}
