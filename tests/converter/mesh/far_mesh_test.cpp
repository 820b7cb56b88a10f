#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "converter/stitch/find_cell.h"
#include "tests/converter/load_cell.h"
#include "tests/converter/mesh_texts.h"
#include "tests/require.h"

using namespace selvedge;
using namespace selvedge::testing;

namespace {

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

}  // namespace

TEST_CASE("a mesh a million cells away is read as the one that is here") {
  const auto knit = test::need(load_cell("plain-knit", {.cubes_across = 16}));
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

TEST_CASE("a mesh near the origin stays where it is, digit by digit") {
  const CellMesh mesh = read_text("near.obj", "v -3 40.1 7\nv 1 40.1 7\nv 1 44 7.5\nf 1 2 3\n");
  CHECK(mesh.positions[0] == V3f(-3, 40.1F, 7));
  CHECK(mesh.positions[2] == V3f(1, 44, 7.5F));
}

TEST_CASE("a mesh comes near by whole periods from more than 64 times its size away") {
  const auto corner = [](double x, double z) {
    return read_text("corner.obj",
                     fmt::format("v {} 0 {}\nv {} 1 {}\nv {} 1 {}\nf 1 2 3\n", x, z, x + 1, z + 1, x, z + 1))
        .positions[0];
  };
  CHECK(corner(62.5, 0) == V3f(62.5F, 0, 0));
  CHECK(corner(63.5, 0) == V3f(1.5F, 0, 0));
  CHECK(corner(0, -63.5) == V3f(0, 0, -63.5F));
  CHECK(corner(0.5, -64.5) == V3f(0.5F, 0, 0));
}
