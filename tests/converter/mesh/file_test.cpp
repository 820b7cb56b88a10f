#include "converter/mesh/file.h"

#include <doctest/doctest.h>

#include <sstream>

#include "converter/stitch/yarn_mesh.h"
#include "tests/converter/load_cell.h"
#include "tests/converter/mesh_texts.h"
#include "tests/format/files.h"
#include "tests/require.h"

using namespace selvedge;
using namespace selvedge::testing;

namespace {

std::string ply_header(const std::string& format, int vertices, const std::string& properties, int faces,
                       const std::string& list = "list uchar int vertex_indices") {
  std::ostringstream out;
  out << "ply\nformat " << format << " 1.0\nelement vertex " << vertices << "\n"
      << properties << "element face " << faces << "\nproperty " << list << "\nend_header\n";
  return out.str();
}

const std::string xyz = "property float x\nproperty float y\nproperty float z\n";
const std::string triangle_rows = "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";

template <class T>
void append(std::string& out, std::initializer_list<T> values) {
  for (const T value : values) out.append(reinterpret_cast<const char*>(&value), sizeof value);
}

}  // namespace

TEST_CASE("reads an OBJ of polygons and cuts them into fans") {
  const CellMesh mesh =
      read_text("fan.obj",
                "# comment\nmtllib none.mtl\nv 0 0 0\r\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\n"
                "usemtl red\nf 1 2 3 4\nf -5 -4 -1\n");
  CHECK(mesh.period == V2d(2, 2));
  REQUIRE(mesh.positions.size() == 5);
  CHECK(mesh.positions[4] == V3f(0, 0, 1));
  REQUIRE(mesh.triangles.size() == 3);
  CHECK(mesh.triangles[0] == V3i(0, 1, 2));
  CHECK(mesh.triangles[1] == V3i(0, 2, 3));
  CHECK(mesh.triangles[2] == V3i(0, 1, 4));
  CHECK(mesh.albedo[0] == V3f(0.5F));
}

TEST_CASE("normals that a file does not have are the faces' means, weighted by area") {
  // Two faces at vertex 0: twice the area in z, once in y.
  const CellMesh mesh =
      read_text("normals.obj", "v 0 0 0\nv 2 0 0\nv 0 1 0\nv 0 0 1\nv 1 0 0\nf 1 2 3\nf 1 4 5\n");
  CHECK((mesh.normals[0] - V3f(0, 1, 2).normalized()).length() < 1e-6F);
  CHECK(mesh.normals[2] == V3f(0, 0, 1));
  CHECK(mesh.normals[3] == V3f(0, 1, 0));
}

TEST_CASE("keeps a file's normals where each vertex has one and only one") {
  const std::string points = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nvn 0 0 2\nvn 0 1 0\n";
  const CellMesh kept = read_text("kept.obj", points + "f 1//1 2//2 3//1\nf 2//2 4//1 3//1\n");
  CHECK(kept.normals[0] == V3f(0, 0, 1));  // made unit
  CHECK(kept.normals[1] == V3f(0, 1, 0));
  const CellMesh split = read_text("split.obj", points + "f 1//1 2//2 3//1\nf 2//1 4//1 3//1\n");
  CHECK(split.normals[1] == V3f(0, 0, 1));
}

TEST_CASE("nothing is lost of a mesh that is no manifold") {
  // Three faces at one edge, one of them twice, and two cones that meet in a point.
  const CellMesh mesh = read_text("complex.obj",
                                  "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv 0 -1 0\nv 3 3 3\nv 3 4 3\n"
                                  "f 1 2 3\nf 1 2 4\nf 1 2 5\nf 1 2 5\nf 1 6 7\nf 2 1 3\n");
  CHECK(mesh.triangles.size() == 6);
  CHECK(mesh.positions.size() == 7);
}

TEST_CASE("triangles that use a vertex twice are left out") {
  const std::string rows = "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n3 0 1 1\n";
  CHECK(read_text("twice.ply", ply_header("ascii", 3, xyz, 2) + rows).triangles.size() == 1);
}

TEST_CASE("passes over what else a PLY file has: other elements, lists, properties, comments") {
  const std::string content =
      "ply\r\nformat ascii 1.0\r\ncomment x\r\nobj_info y\r\nelement camera 1\r\nproperty double fov\r\n"
      "element vertex 3\r\nproperty float quality\r\nproperty float z\r\nproperty float y\r\nproperty float "
      "x\r\n"
      "property list int float weights\r\nelement empty 7\r\nelement face 1\r\nproperty uchar flags\r\n"
      "property list ushort short vertex_index\r\nproperty list uchar float texcoord\r\nend_header\r\n"
      "60.5\r\n9 3 2 1 0\r\n9 0 0 0 2 0.5 0.5\r\n9 0 1 0 0\r\n7 3 2 1 0 6 0 0 0 0 0 0\r\n";
  const CellMesh mesh = read_text("rich.ply", content);
  REQUIRE(mesh.positions.size() == 3);
  CHECK(mesh.positions[0] == V3f(1, 2, 3));
  REQUIRE(mesh.triangles.size() == 1);
  CHECK(mesh.triangles[0] == V3i(2, 1, 0));
}

TEST_CASE("broken PLY headers are refused with their line") {
  const std::string body = "end_header\n" + triangle_rows;
  const auto place = [&](const std::string& header) { return refusal("head.ply", header + body).place; };
  CHECK(place("pls\n") == "line 1");
  CHECK(place("ply\nformat text 1.0\n") == "line 2");
  CHECK(place("ply\nformat ascii 1.0\nproperty float x\n") == "line 3");
  CHECK(place("ply\nformat ascii 1.0\nelement vertex x\n") == "line 3");
  CHECK(place("ply\nformat ascii 1.0\nelement vertex 3\nproperty real x\n") == "line 4");
  CHECK(place("ply\nformat ascii 1.0\nelement vertex 3\nproperty list float int x\n") == "line 4");
  CHECK(place("ply\nformat ascii 1.0\nelemM-ent vertex 3\n") == "line 3");
  CHECK(refusal("head.ply", "ply\nelement vertex 3\n" + xyz + body).code == Code::file_damaged);
  const std::string flat = "property float x\nproperty float y\n";
  CHECK(refusal("flat.ply", ply_header("ascii", 1, flat, 0) + "0 0\n").place == "element vertex");
}

TEST_CASE("8-bit colours go through the sRGB curve, floats are linear") {
  const std::string bytes = xyz + "property uchar red\nproperty uchar green\nproperty uchar blue\n";
  const CellMesh coded = read_text(
      "bytes.ply", ply_header("ascii", 3, bytes, 1) + "0 0 0 255 188 0\n1 0 0 9 9 9\n0 1 0 9 9 9\n3 0 1 2\n");
  // IEC 61966-2-1: 188 / 255 -> 0.50289, 9 / 255 -> 9 / 255 / 12.92.
  CHECK(coded.albedo[0].x == 1.0F);
  CHECK(coded.albedo[0].y == doctest::Approx(0.50289).epsilon(1e-4));
  CHECK(coded.albedo[0].z == 0.0F);
  CHECK(coded.albedo[1].x == doctest::Approx(9.0 / 255 / 12.92).epsilon(1e-5));
  const CellMesh linear =
      read_text("floats.obj", "v 0 0 0 0.25 0.5 2\nv 1 0 0 0 0 0\nv 0 1 0 0 0 0\nf 1 2 3\n");
  CHECK(linear.albedo[0] == V3f(0.25F, 0.5F, 1));
}

TEST_CASE("scale and up axis turn the file's frame into the cell's") {
  MeshImportOptions options = two_by_two;
  options.scale_to_mm = 1000;
  options.up_axis = UpAxis::y;
  options.albedo = {0.1F, 0.2F, 0.3F};
  // In the file: x to the right, y out of the cloth, so that z points down in it.
  const CellMesh mesh = read_text("up.obj", "v 0.001 0.002 0.003\nv 0 0 1\nv 1 0 0\nf 1 2 3\n", options);
  CHECK((mesh.positions[0] - V3f(1, -3, 2)).length() < 1e-6F);
  CHECK(mesh.albedo[2] == V3f(0.1F, 0.2F, 0.3F));
}

TEST_CASE("files that cannot be read are refused where they are wrong") {
  CHECK(test::error_of(read_mesh("no/such/mesh.obj", two_by_two)).code == Code::file_missing);
  CHECK(refusal("p.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", {.period = V2d(0, 1)}).code ==
        Code::mesh_invalid);
  const std::string points = "v 0 0 0 1 1 1\nv 1 0 0\nv 0 1 0\nvn 0 0 1\n";
  const std::string noise = "\x89PNG\r\n\x1a\n" + std::string(200, '\x7f');
  std::string nan = ply_header("binary_little_endian", 3, xyz, 1);
  append<float>(nan, {0, 0, 0, 1, std::nanf(""), 0, 0, 1, 0});
  append<std::uint8_t>(nan, {3});
  append<std::int32_t>(nan, {0, 1, 2});
  struct Case {
    const char* name;
    std::string text;
    Code code;
    const char* place;
  };
  for (const Case& one : std::vector<Case>{
           {"e.obj", "", Code::mesh_empty, ""},
           {"e.obj", "v 0 0 0\n", Code::mesh_empty, ""},
           {"e.ply", ply_header("ascii", 1, xyz, 0) + "0 0 0\n", Code::mesh_empty, ""},
           {"mesh.3ds", "x", Code::mesh_invalid, ""},
           {"noise.ply", noise, Code::file_damaged, "line 1"},
           {"noise.obj", noise, Code::mesh_empty, ""},
           {"word.obj", "v 0 0 0\nf a b c\n", Code::file_damaged, "line 2"},
           {"slash.obj", "v 0 0 0\nf /1 /1 /1\n", Code::file_damaged, "line 2"},
           {"cut.obj", points + "f 1 2", Code::file_damaged, "line 5"},
           {"cut.obj", "v 0 0 0\nv 1 0", Code::file_damaged, "line 2"},
           {"nan.obj", "v 0 0 0\nv 1 nan 0\n", Code::mesh_not_finite, "line 2"},
           {"nan.obj", "v 0 0 0\nv 1 inf 0\n", Code::mesh_not_finite, "line 2"},
           {"nan.obj", "v 0 0 0\nv 1 1e60 0\n", Code::mesh_not_finite, "line 2"},
           {"nan.ply", nan, Code::mesh_not_finite, "vertex 1"},
           {"range.obj", points + "f 1 2 4", Code::file_damaged, "line 5"},
           {"range.obj", points + "f 1 2 -9", Code::file_damaged, "line 5"},
           {"range.obj", points + "f 99999//1 2//1 0//1", Code::file_damaged, "line 5"},
           {"range.obj", points + "f 1 2 99999999999", Code::file_damaged, "line 5"},
           {"range.ply", ply_header("ascii", 3, xyz, 1) + "0 0 0\n1 0 0\n0 1 0\n3 0 1 7\n",
            Code::file_damaged, "face 0"},
           // Counts of more than the file holds are refused at once.
           {"huge.ply", ply_header("binary_little_endian", 2000000000, xyz, 0), Code::file_damaged,
            "vertex 0"},
           {"huge.ply", ply_header("ascii", 2000000000, xyz, 9), Code::file_damaged, "vertex 0"}}) {
    CAPTURE(one.text);
    const Error error = refusal(one.name, one.text);
    CHECK(error.code == one.code);
    CHECK(error.place == one.place);
  }
}

TEST_CASE("a stitch written and read again is the same mesh") {
  const auto mesh = test::need(mesh_stitch(plain_weave(), {16}));
  const test::Folder folder;
  for (const std::string name : {"again.obj", "again.PLY"}) {
    REQUIRE(write_mesh(folder / name, mesh));
    const auto again = test::need(read_mesh(folder / name, {.period = mesh.period}));
    CHECK(again.positions == mesh.positions);  // shortest decimals and raw floats lose nothing
    CHECK(again.triangles == mesh.triangles);
    CHECK(again.albedo == mesh.albedo);
    for (std::size_t v = 0; v < mesh.normals.size(); ++v)
      CHECK((again.normals[v] - mesh.normals[v]).length() < 1e-6F);
  }
}

TEST_CASE("OBJ comments, continued lines, byte order marks and every kind of line end are read") {
  const std::string plain = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n";
  const std::string marked =
      "\xef\xbb\xbfv 0 0 0 # corner\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 \\\n3 4 # quad\n";
  const std::string old = "v 0 0 0\rv 1 0 0\rv 1 1 0\rv 0 1 0\rf 1 2 3 4\r";
  const test::Folder folder;
  MeshImportOptions options{.period = V2d(1, 1)};
  for (const std::string& text : {plain, marked, old}) {
    test::write_bytes(folder / "a.obj", text);
    const auto mesh = read_mesh(folder / "a.obj", options);
    REQUIRE_MESSAGE(mesh, (mesh ? "" : to_line(mesh.error())));
    CHECK(mesh->positions.size() == 4);
    CHECK(mesh->triangles.size() == 2);
  }
}
