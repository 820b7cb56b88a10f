#include "converter/mesh/file.h"

#include <doctest/doctest.h>

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <sstream>
#include <string>
#include <vector>

#include "converter/mesh/cell_mesh.h"
#include "converter/stitch/find_cell.h"
#include "converter/stitch/library.h"
#include "converter/stitch/yarn_mesh.h"
#include "tests/converter/load_cell.h"
#include "tests/format/files.h"
#include "tests/require.h"

using namespace selvedge;

namespace {

const MeshImportOptions two_by_two{.period = V2d(2, 2), .up_axis = UpAxis::z};

/// `materials`: what colours.mtl beside it holds.
CellMesh read_text(const std::string& name, const std::string& content,
                   const MeshImportOptions& options = two_by_two, const std::string& materials = "") {
  const test::Folder folder;
  test::write_bytes(folder / "colours.mtl", materials);
  test::write_bytes(folder / name, content);
  return test::need(read_mesh(folder / name, options));
}

Error refusal(const std::string& name, const std::string& content,
              const MeshImportOptions& options = two_by_two) {
  const test::Folder folder;
  test::write_bytes(folder / name, content);
  const auto mesh = read_mesh(folder / name, options);
  CAPTURE(content);
  REQUIRE_FALSE(mesh);
  CHECK(mesh.error().file == folder / name);
  CHECK(to_line(mesh.error()).find('\n') == std::string::npos);
  return mesh.error();
}

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

/// A coarse knit as a text of one of the formats, moved by `away`; all digits are written.
std::string text_of(const std::string& format, const CellMesh& mesh, const V3d& away) {
  const auto at = [&](int v) {
    const V3d p = V3d(mesh.positions[v]) + away;
    return fmt::format("{} {} {}", p.x, p.y, p.z);
  };
  const auto vertices = static_cast<int>(mesh.positions.size());
  const std::size_t faces = mesh.triangles.size();
  std::string out;
  if (format == "ply")
    out = fmt::format(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty double x\nproperty double y\nproperty double z\n"
        "element face {}\nproperty list uchar int vertex_indices\nend_header\n",
        vertices, faces);
  for (int v = 0; v < vertices; ++v) out += (format == "obj" ? "v " : "") + at(v) + "\n";
  for (const V3i& t : mesh.triangles)
    out += format == "obj" ? fmt::format("f {} {} {}\n", t.x + 1, t.y + 1, t.z + 1)
                           : fmt::format("3 {} {} {}\n", t.x, t.y, t.z);
  return out;
}

CellMesh triangle() {
  CellMesh mesh;
  mesh.period = {2, 3};
  mesh.positions = {V3f(0, 0, -1), V3f(1, 0, 0), V3f(0, 2, 5)};
  mesh.normals.assign(3, V3f(0, 0, 1));
  mesh.albedo.assign(3, V3f(0.5F));
  mesh.triangles.emplace_back(0, 1, 2);
  return mesh;
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
  const CellMesh along_x =
      read_text("x.obj", "v 1 2 3\nv 1 3 3\nv 1 2 4\nf 1 2 3\n", {.period = V2d(2, 2), .up_axis = UpAxis::x});
  CHECK(along_x.positions[0] == V3f(2, 3, 1));
  CHECK(along_x.normals[0] == V3f(0, 0, 1));
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

TEST_CASE("a stitch written and read again, without options, is the same mesh") {
  const auto mesh = test::need(mesh_stitch(plain_weave()));
  const test::Folder folder;
  for (const std::string name : {"again.obj", "again.PLY"}) {
    REQUIRE(write_mesh(folder / name, mesh));
    const auto again = test::need(read_mesh(folder / name, {}));
    CHECK(again.period == mesh.period);
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

TEST_CASE("a mesh a million cells away is read as the one that is here") {
  const auto knit = test::need(load_cell("plain-knit"));
  const MeshImportOptions options{.period = knit.period, .up_axis = UpAxis::z};
  const V3d away(1e6 * knit.period.x, -1e6 * knit.period.y, 3e6);
  for (const std::string format : {"obj", "ply"}) {
    CAPTURE(format);
    const CellMesh here = read_text("here." + format, text_of(format, knit, V3d(0)), options);
    const CellMesh there = read_text("there." + format, text_of(format, knit, away), options);
    CHECK(there.triangles.size() == here.triangles.size());
    REQUIRE(there.positions.size() == here.positions.size());
    // Up to whole periods and the height: once found from the first vertex, it is the same for all.
    V3d shift = V3d(there.positions[0]) - V3d(here.positions[0]);
    shift.x = std::round(shift.x / knit.period.x) * knit.period.x;
    shift.y = std::round(shift.y / knit.period.y) * knit.period.y;
    CHECK(std::abs(shift.x) + std::abs(shift.y) <= 2 * (knit.period.x + knit.period.y));
    double most = 0;
    for (std::size_t v = 0; v < here.positions.size(); ++v)
      most = std::max(most, (V3d(there.positions[v]) - V3d(here.positions[v]) - shift).length());
    // Half a last place of coordinates below 8 mm on either side, in three axes, and once in the shift.
    CHECK(most <= 4 * std::sqrt(3.0) * 0x1p-22);
  }
}

TEST_CASE("a mesh comes near by whole periods from more than 64 times its size away") {
  const auto corner = [](double x, double z) {
    return read_text("corner.obj",
                     fmt::format("v {} 0 {}\nv {} 1 {}\nv {} 1 {}\nf 1 2 3\n", x, z, x + 1, z + 1, x, z + 1))
        .positions[0];
  };
  CHECK(corner(40.1, 7) == V3f(40.1F, 0, 7));  // digit by digit
  CHECK(corner(62.5, 0) == V3f(62.5F, 0, 0));
  CHECK(corner(63.5, 0) == V3f(1.5F, 0, 0));
  CHECK(corner(0, -63.5) == V3f(0, 0, -63.5F));
  CHECK(corner(0.5, -64.5) == V3f(0.5F, 0, 0));
}

TEST_CASE("period, unit and axis are guessed where they are not given, and where they come from is said") {
  const auto chosen = [](const std::string& name, const std::string& text, const MeshImportOptions& options) {
    const test::Folder folder;
    test::write_bytes(folder / name, text);
    MeshChoices choices;
    const auto mesh = test::need(read_mesh(folder / name, options, &choices));
    CHECK(mesh.period == choices.period);
    return choices;
  };
  // 6 x 4 x 1, flat along z, y and x; then in metres.
  const std::string flat_z = "v 0 0 0\nv 6 0 0\nv 0 4 1\nv 6 4 1\nf 1 2 3\nf 3 2 4\n";
  const std::string flat_y = "v 0 0 0\nv 6 0 0\nv 0 1 4\nv 6 1 4\nf 1 2 3\nf 3 2 4\n";
  const std::string flat_x = "v 0 0 0\nv 0 6 0\nv 1 0 4\nv 1 6 4\nf 1 2 3\nf 3 2 4\n";
  const std::string metres = "v 0 0 0\nv .006 0 0\nv 0 .004 .001\nv .006 .004 .001\nf 1 2 3\nf 3 2 4\n";
  for (const auto& [text, axis] :
       {std::pair(flat_z, UpAxis::z), std::pair(flat_y, UpAxis::y), std::pair(flat_x, UpAxis::x)}) {
    const MeshChoices choices = chosen("flat.obj", text, {});
    CHECK(choices.up_axis == axis);
    CHECK(choices.period == V2d(6, 4));
    CHECK(choices.scale_to_mm == 1);
    CHECK(choices.period_source == "guessed: the extent of the mesh");
    CHECK(choices.scale_source == "guessed: millimetres");
    CHECK(choices.up_axis_source.starts_with("guessed: "));
  }
  CHECK(refusal("line.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n", {})
            .message.ends_with("has no extent to guess its period from: give --period WxH in mm"));
  const MeshChoices small = chosen("small.obj", metres, {});
  CHECK(small.scale_to_mm == 1000);
  CHECK(small.period.x == doctest::Approx(6));
  const MeshChoices given =
      chosen("given.obj", flat_y, {.period = V2d(3, 2), .scale_to_mm = 0.5, .up_axis = UpAxis::z});
  CHECK(given.period == V2d(3, 2));
  CHECK(given.scale_to_mm == 0.5);
  CHECK(given.up_axis == UpAxis::z);
  for (const std::string& from : {given.period_source, given.scale_source, given.up_axis_source})
    CHECK(from == "given");
  const MeshChoices ours = chosen("ours.obj", "# period 5 x 3.8 mm\n" + metres, {});
  CHECK(ours.period == V2d(5, 3.8));
  CHECK(ours.scale_to_mm == 1);
  CHECK(ours.period_source == "a comment in the file");
}

TEST_CASE("a triangle is a valid mesh, and each broken rule is refused where it is broken") {
  CHECK(validate(triangle(), "m"));
  constexpr float nan = std::numeric_limits<float>::quiet_NaN();
  constexpr float infinite = std::numeric_limits<float>::infinity();
  struct Case {
    Code code;
    const char* place;
    std::function<void(CellMesh&)> change;
  };
  for (const auto& [code, place, change] : std::vector<Case>{
           {Code::mesh_empty, "", [](CellMesh& m) { m.triangles.clear(); }},
           {Code::mesh_not_finite, "vertex 1", [](CellMesh& m) { m.positions[1].y = nan; }},
           {Code::mesh_not_finite, "vertex 1", [](CellMesh& m) { m.positions[1].y = infinite; }},
           {Code::mesh_invalid, "period x", [](CellMesh& m) { m.period.x = 0; }},
           {Code::mesh_invalid, "period y", [](CellMesh& m) { m.period.y = double{nan}; }}}) {
    CellMesh mesh = triangle();
    change(mesh);
    const Error error = test::error_of(validate(mesh, "m"));
    CHECK(error.file == "m");
    CHECK(error.code == code);
    CHECK(error.place == place);
  }
}
