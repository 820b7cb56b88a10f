#include "converter/export/export.h"

#include <Imath/ImathQuat.h>
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>

#include "converter/export/place_repeats.h"
#include "format/gltf/read_scene.h"
#include "tests/converter/workshop.h"
#include "tests/format/files.h"

using namespace selvedge;

namespace {

const V2f period(5, 4);  // mm
constexpr float radius = 0.5F;
constexpr float height = 1;  // mm, of the yarn's axis and of the surface

/// One straight yarn along x through the middle of the cell.
YarnData straight_yarn() {
  YarnData data;
  YarnCurve curve;
  curve.nodes = 4;
  curve.stations = 1;
  curve.repeat_offset = V2i(1, 0);
  curve.radius = radius;
  data.curves = {curve};
  for (int i = 0; i < curve.nodes; ++i)
    data.nodes.emplace_back(period.x * static_cast<float>(i) / 4, -period.y / 2, height);
  data.station_light.assign(light_values_per_station, 0.0F);
  return data;
}

/// So many parts a side of a cell from (u, v) to (u + 1, v + 1), where `at` lays them; without the cells of
/// which `left_out` says so.
template <class At, class LeftOut>
Cloth cloth_on(double width, int rows, int parts, const At& at, const LeftOut& left_out) {
  Cloth cloth;
  const auto corner = [&](int i, int j) {
    const V2d uv(static_cast<double>(i) / parts, static_cast<double>(j) / parts);
    const auto [position, normal] = at(uv);
    return Cloth::Corner{uv, position, normal};
  };
  const auto add = [&](Cloth::Corner a, Cloth::Corner b, Cloth::Corner c) {
    if ((b.position - a.position).cross(c.position - a.position).dot(a.normal) < 0) std::swap(b, c);
    cloth.add_triangle({a, b, c});
  };
  for (int j = 0; j < rows * parts; ++j) {
    for (int i = 0; i < static_cast<int>(std::lround(width * parts)); ++i) {
      if (left_out(V2i(i / parts, j / parts))) continue;
      add(corner(i, j), corner(i, j + 1), corner(i + 1, j));
      add(corner(i + 1, j), corner(i, j + 1), corner(i + 1, j + 1));
    }
  }
  cloth.assign_patches();
  return cloth;
}

const auto everywhere = [](const V2i&) { return false; };

/// In the plane z = 0, in true size; v grows downwards. `sense`: of u along x.
auto flat(double sense = 1) {
  return [sense](const V2d& uv) {
    return std::pair(V3d(sense * uv.x * period.x, -uv.y * period.y, 0) / 1000.0, V3d(0, 0, 1));
  };
}

const RepeatFrame frame{V2d(period), height};

LaidCloth laid_on(const Cloth& cloth, const Yarns& yarns, const RepeatMesh& mesh) {
  const auto cells = cells_of(cloth, yarn_uv_bounds(yarns), 1000);
  REQUIRE(cells);
  return place_repeats(cloth, *cells, yarns, frame, std::span(&mesh, 1), std::vector<int>(cells->size()));
}

double area_of(const TubeMesh& mesh) {
  double sum = 0;
  for (std::size_t i = 0; i + 2 < mesh.indices.size(); i += 3) {
    const V3d a(mesh.positions[mesh.indices[i]]);
    sum += (V3d(mesh.positions[mesh.indices[i + 1]]) - a)
               .cross(V3d(mesh.positions[mesh.indices[i + 2]]) - a)
               .length() /
           2;
  }
  return sum;
}

}  // namespace

TEST_CASE("export: the mesh of a straight yarn is a tube as wide in the mean as the yarn, out of itself") {
  const Yarns yarns(straight_yarn(), period);
  for (const double triangles : {1.0, 60.0, max_triangles(yarns)}) {
    const RepeatMesh mesh = mesh_of_repeat(yarns, triangles, 64);
    REQUIRE(mesh.tubes.size() == 1);
    CHECK(static_cast<double>(mesh_triangle_count(mesh)) <= std::max(triangles, min_triangles(yarns)));
    // A convex section's mean width is its girth over pi.
    const double area = area_of(mesh.tubes[0].mesh);
    CHECK(area == doctest::Approx(2 * std::numbers::pi * radius * period.x).epsilon(1e-4));
    for (std::size_t i = 0; i + 2 < mesh.tubes[0].mesh.indices.size(); i += 3) {
      const auto corner = [&](std::size_t k) {
        return V3d(mesh.tubes[0].mesh.positions[mesh.tubes[0].mesh.indices[i + k]]);
      };
      const V3d out = (corner(0) + corner(1) + corner(2)) / 3.0 - V3d(0, -period.y / 2, height);
      CHECK((corner(1) - corner(0)).cross(corner(2) - corner(0)).dot(V3d(0, out.y, out.z)) > 0);
    }
  }
}

TEST_CASE("export: repeats are whole copies, mirrored ones, bent or cut, as the cloth lies") {
  const Yarns yarns(straight_yarn(), period);
  const RepeatMesh mesh = mesh_of_repeat(yarns, 64, 64);
  const double whole = area_of(mesh.tubes[0].mesh);
  const auto turning = [](double degrees) {
    return [angle = degrees * std::numbers::pi / 180](const V2d& uv) {
      const double r = period.x / 1000.0 / angle, a = uv.x * angle;
      return std::pair(V3d(r * std::sin(a), -uv.y * period.y / 1000.0, r * std::cos(a)),
                       V3d(std::sin(a), 0, std::cos(a)));
    };
  };
  struct Case {
    const char* name;
    Cloth cloth;
    std::size_t copies, mirrored;
    int cut;
    double gap, bent_area;  // radii; of whole repeats
    double off =
        1e-7;  // m, of the middle of a repeat from the cloth: a chord of the turn that its shape lacks
  };
  const Case cases[] = {
      {"flat", cloth_on(4, 3, 2, flat(), everywhere), 12, 0, 0, 1e-6, 0},
      {"mirrored", cloth_on(4, 3, 2, flat(-1), everywhere), 0, 12, 0, 1e-6, 0},
      {"stretched threefold",
       cloth_on(
           4, 3, 2, [](const V2d& uv) { return flat()(V2d(3 * uv.x, uv.y)); }, everywhere),
       12, 0, 0, 1e-6, 0},
      {"a hole", cloth_on(4, 3, 2, flat(), [](const V2i& at) { return at == V2i(1, 1); }), 11, 0, 0, 1e-6, 0},
      {"cut in half at the right", cloth_on(3.5, 3, 2, flat(), everywhere), 9, 0, 3, 1e-6, 1.5},
      {"smaller than a repeat", cloth_on(0.5, 1, 2, flat(), everywhere), 0, 0, 1, 0, 0.5},
      {"4 degrees a repeat", cloth_on(8, 2, 8, turning(4), everywhere), 16, 0, 0, 0.02, 0, 2e-6},
      {"9 degrees a repeat", cloth_on(8, 2, 8, turning(9), everywhere), 16, 0, 0, 0.05, 0, 1.1e-5},
  };
  for (const Case& c : cases) {
    CAPTURE(c.name);
    const LaidCloth laid = laid_on(c.cloth, yarns, mesh);
    const PlacedRepeats& placed = laid.repeats[0];
    std::array<std::size_t, 2> counts{};
    for (const auto& [shape, copies] : placed.copies) counts[shape.is_mirrored] += copies.size();
    CHECK(counts[0] == c.copies);
    CHECK(counts[1] == c.mirrored);
    CHECK(placed.cut_repeat_count == c.cut);
    CHECK(placed.bent_repeat_count == 0);
    CHECK(laid.max_gap_radii <= c.gap);
    CHECK(laid.max_overlap_radii <= c.gap);
    CHECK(area_of(placed.bent_meshes[0]) * 1e6 / whole == doctest::Approx(c.bent_area).epsilon(1e-3));
    for (const auto& [shape, copies] : placed.copies) {
      TubeMesh middles;  // of the cells, in the mesh
      middles.positions = {V3f(period.x / 2, -period.y / 2, height)};
      middles.normals = {V3f(0, 0, 1)};
      const V3d middle(shaped_mesh(middles, shape, frame).positions[0]);
      for (const RepeatCopy& copy : copies) {
        // The middle of the yarn lies on the cloth in the middle of its cell.
        const Imath::Quatd turn(copy.rotation.w, copy.rotation.x, copy.rotation.y, copy.rotation.z);
        const V3d place = middle * V3d(copy.scale) * turn.toMatrix44() + V3d(copy.translation);
        double nearest = 1;
        for (const Cloth::Triangle& t : c.cloth.triangles) {
          for (const Cloth::Corner& corner : t.corners) {
            const V2d within(corner.uv.x - std::floor(corner.uv.x), corner.uv.y - std::floor(corner.uv.y));
            if ((within - V2d(0.5, 0.5)).length() < 1e-9)
              nearest = std::min(nearest, (corner.position - place).length());
          }
        }
        CHECK(nearest <= c.off);
      }
    }
  }
}

TEST_CASE("export: each stitch of a map is a copy of the tubes of the one that it shows") {
  YarnData data = straight_yarn();
  data.curves[0].nodes = 8;
  data.nodes.clear();
  for (int i = 0; i < 8; ++i)  // it rises in the first of two stitches
    data.nodes.emplace_back(period.x * static_cast<float>(i) / 8, -period.y / 2,
                            height + (i == 2 ? radius : 0));
  data.map = {.kinds = {2, 1}, .size = {3, 2}, .shown = {0, 1, 1, 1, 0, 1}, .lines = {0}};
  const Yarns yarns(data, period);
  const V2f cell = cell_size(yarns);
  CHECK(cell == V2f(period.x / 2, period.y));
  const RepeatMesh mesh = mesh_of_repeat(yarns, 200, 1024);
  REQUIRE(mesh.stitches == 2);
  REQUIRE(mesh.tubes.size() == 2);
  std::int64_t triangles = 0;  // of the cloth's repeat
  for (const int stitch : {0, 1}) {
    const TubeMesh& tube = mesh.tubes_of(stitch).front().mesh;
    triangles += static_cast<std::int64_t>(tube.indices.size() / 3) * (stitch == 0 ? 2 : 4);
    Imath::Box3f box;
    for (const V3f& p : tube.positions) box.extendBy(p);
    CHECK(std::abs(box.min.x) < 1e-5F);
    CHECK(box.max.x == doctest::Approx(cell.x));
    CHECK(box.center().y == doctest::Approx(-period.y / 2));
    CHECK((box.max.z > height + 1.5F * radius) == (stitch == 0));
    // Yarn that continues in the next stitch has its corners there.
    for (const V3f& p : tube.positions) {
      if (p.x > 1e-4F) continue;
      const auto& other = mesh.tubes_of(1 - stitch).front().mesh.positions;
      CHECK(std::ranges::any_of(other,
                                [&](const V3f& q) { return (q - p - V3f(cell.x, 0, 0)).length() < 0.02F; }));
    }
  }
  CHECK(triangles <= 6 * 200);
  CHECK(triangles > 6 * min_triangles(yarns));
  const Cloth cloth = cloth_on(6, 6, 2, flat(), everywhere);
  auto cells = cells_of(cloth, yarn_uv_bounds(yarns), 1000);
  REQUIRE(cells);
  for (ClothCell& one : *cells) one.stitch = data.map.shown_at(one.repeat_index);
  const LaidCloth laid = place_repeats(cloth, *cells, yarns, {V2d(cell), height}, std::span(&mesh, 1),
                                       std::vector<int>(cells->size()));
  CHECK(laid.max_gap_radii < 1e-6);
  REQUIRE(laid.repeats[0].copies.size() == 2);
  CHECK(laid.repeats[0].copies.at({.stitch = 0}).size() == 12);
  CHECK(laid.repeats[0].copies.at({.stitch = 1}).size() == 24);
}

TEST_CASE("export: the file has the copies, and the triangles of the cloth are gone") {
  test::Workshop workshop;
  Fabric fabric = test::lambert_fabric(V2d(period), 4, V3f(0.5F, 0.4F, 0.3F));
  const auto write = [&] { REQUIRE(write_fabric(workshop.fabric, fabric)); };
  const std::string exported = workshop.folder / "yarn.glb";
  const auto refused = [&](const ExportOptions& options) {
    return test::error_of(export_yarn(workshop.output, exported, options)).code;
  };
  DressOptions dressing{.all_cloth = true};
  dressing.repeats = V2d(4, 3);
  write();
  REQUIRE(workshop.dress(dressing));
  CHECK(refused({}) == Code::fabric_unsupported);  // without yarn
  CHECK(test::error_of(export_yarn(workshop.garment, exported, {})).code == Code::material_missing);
  fabric.levels.front().set_yarns(std::make_shared<const Yarns>(straight_yarn(), period));
  write();
  REQUIRE(workshop.dress(dressing));
  CHECK(refused({.triangle_budget = 100}) == Code::file_too_large);
  const auto report = export_yarn(workshop.output, exported, {});
  REQUIRE(report);
  REQUIRE(report->yarns.size() == 1);
  CHECK(report->yarns[0].copy_count == 12);
  const Scene scene = test::need(read_scene(exported));
  CHECK(scene.instances.size() == 12);
  REQUIRE(scene.primitives.size() == 1);
  CHECK(static_cast<std::int64_t>(scene.primitives[0].indices.size() / 3) ==
        report->yarns[0].triangles_per_copy[0]);
  CHECK(scene.fabrics.empty());
  CHECK(scene.images.size() == 1);  // of the yarn
  REQUIRE(scene.materials.size() == 1);
  CHECK_FALSE(scene.materials[0].fabric);
  const auto region = export_yarn(workshop.output, exported, {.region = Imath::Box2d(V2d(0, 0), V2d(2, 1))});
  REQUIRE(region);
  REQUIRE(region->yarns.size() == 1);
  CHECK(region->yarns[0].triangles_per_copy.size() == 2);
  CHECK(region->yarns[0].copy_count == 10);
  CHECK(region->yarns[0].bent_count == 2);
  const std::string layer = workshop.folder / "yarn.usda";
  REQUIRE(export_yarn(workshop.output, layer, {.region = Imath::Box2d(V2d(0, 0), V2d(2, 1))}));
  const std::string text = test::bytes_of(layer);
  const auto has = [&](const char* part) { return text.find(part) != std::string::npos; };
  CHECK(has("protoIndices = [0, 0, 0, 0, 0, 0, 0, 0, 0, 0]\n"));
  CHECK(has("int[] curveVertexCounts = [5, 5]\n"));  // two straight yarns
  // A million metres away places are as exact as at the origin, of copies, bent yarn and curves.
  const auto places = [&](const V3d& origin) {
    const Scene written = test::need(read_scene(exported));
    std::vector<V3d> all;
    for (const SceneInstance& instance : written.instances)
      for (const V3f& p : written.primitives[instance.primitive].positions)
        all.push_back(V3d(p) * instance.world - origin);
    return all;
  };
  const std::vector<V3d> near = places(V3d(0, 0, 0));
  workshop.edit([](Json& json) { json["nodes"][0]["translation"] = {1e6, -1e6, 1e6}; });
  REQUIRE(workshop.dress(dressing));
  REQUIRE(export_yarn(workshop.output, exported, {.region = Imath::Box2d(V2d(0, 0), V2d(2, 1))}));
  const std::vector<V3d> far = places(V3d(1e6, -1e6, 1e6));
  REQUIRE(far.size() == near.size());
  for (std::size_t i = 0; i < far.size(); ++i) CHECK((far[i] - near[i]).length() < 1e-5);
  REQUIRE(export_yarn(workshop.output, layer, {.region = Imath::Box2d(V2d(0, 0), V2d(2, 1))}));
  CHECK(test::bytes_of(layer).find("1000000.5, -999999.5, 1000000") != std::string::npos);
  workshop.edit([](Json& json) { json["nodes"][0].erase("translation"); });
  // Half a repeat, cut by the border: as far as the cloth goes.
  dressing.repeats = V2d(0.5, 1);
  REQUIRE(workshop.dress(dressing));
  REQUIRE(export_yarn(workshop.output, layer, {.region = Imath::Box2d(V2d(0, 0), V2d(1, 1))}));
  CHECK(test::bytes_of(layer).find("int[] curveVertexCounts = [3]\n") != std::string::npos);
}
