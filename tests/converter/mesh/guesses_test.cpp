#include "converter/mesh/file.h"

#include <doctest/doctest.h>

#include "converter/stitch/library.h"
#include "converter/stitch/yarn_mesh.h"
#include "tests/converter/load_cell.h"
#include "tests/converter/mesh_texts.h"
#include "tests/require.h"

using namespace selvedge;
using namespace selvedge::testing;

TEST_CASE("a mesh without extent has no period to guess") {
  CHECK(to_line(refusal("line.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n", {}))
            .ends_with(
                "the mesh has no extent to guess its period from: give --period WxH in mm [MESH_INVALID]"));
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

TEST_CASE("our own meshes are read back without options") {
  const auto mesh = test::need(mesh_stitch(plain_weave(), {16}));
  const test::Folder folder;
  for (const std::string& path : {folder / "own.obj", folder / "own.ply"}) {
    REQUIRE(write_mesh(path, mesh));
    const auto again = test::need(read_mesh(path, {}));
    CHECK(again.period == mesh.period);
    CHECK(again.positions == mesh.positions);
  }
}

TEST_CASE("the file's x axis may be the one out of the cloth") {
  MeshImportOptions options{.period = V2d(2, 2), .up_axis = UpAxis::x};
  const CellMesh mesh = read_text("x.obj", "v 1 2 3\nv 1 3 3\nv 1 2 4\nf 1 2 3\n", options);
  CHECK(mesh.positions[0] == V3f(2, 3, 1));
  CHECK(mesh.normals[0] == V3f(0, 0, 1));
}
