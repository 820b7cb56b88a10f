#include "converter/dress/unwrap.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <numbers>

#include "converter/dress/flatten.h"
#include "format/check/gltf.h"
#include "format/gltf/edit.h"
#include "format/gltf/read_scene.h"
#include "format/picture/image.h"
#include "tests/converter/workshop.h"
#include "tests/format/garments.h"
#include "tests/format/gltf_fixtures.h"
#include "tests/require.h"
#include "tests/shared_data.h"

using namespace selvedge;
using test::Folder;
using test::Workshop;

namespace {

struct Surface {
  std::vector<V3d> positions;
  std::vector<std::uint32_t> triangles;
};

/// A grid of squares over [0, 1]^2, each of two triangles, bent by `place`.
template <class Place>
Surface grid(int columns, int rows, const Place& place) {
  Surface surface;
  for (int j = 0; j <= rows; ++j)
    for (int i = 0; i <= columns; ++i)
      surface.positions.push_back(place(static_cast<double>(i) / columns, static_cast<double>(j) / rows));
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      const auto a = static_cast<std::uint32_t>(j * (columns + 1) + i);
      const auto b = a + static_cast<std::uint32_t>(columns) + 1;
      surface.triangles.insert(surface.triangles.end(), {a, a + 1, b + 1, a, b + 1, b});
    }
  }
  return surface;
}

/// An open tube about the y axis, from y = 0 up. Its last column lies on the first in space.
Surface tube(double radius, double height) {
  return grid(48, 10, [&](double u, double v) {
    const double angle = -2 * std::numbers::pi * std::fmod(u, 1);
    return V3d(radius * std::cos(angle), height * v, radius * std::sin(angle));
  });
}

Surface sphere(double radius) {
  return grid(64, 32, [&](double u, double v) {
    const double around = -2 * std::numbers::pi * std::fmod(u, 1);
    const double up = std::numbers::pi * v;
    return radius * V3d(std::sin(up) * std::cos(around), -std::cos(up), std::sin(up) * std::sin(around));
  });
}

ClothPanel panel_of(const Surface& surface) {
  ClothPanel panel{surface.positions, {}};
  for (std::size_t t = 0; t < surface.triangles.size(); t += 3)
    panel.triangles.emplace_back(surface.triangles[t], surface.triangles[t + 1], surface.triangles[t + 2]);
  return panel;
}

Charts charts_of(const Surface& surface) {
  double top = 0;
  return cut_into_charts(surface.positions, surface.triangles, V3d(0, -1, 0), top);
}

/// Metres of surface per unit of the plane within one triangle: the singular values of dP/d(u, v).
struct Stretch {
  double max = 1;
  double min = 1;

  double times() const { return std::max(max, 1 / min); }
};

Stretch stretch_of(const std::array<V3d, 3>& corners, const std::array<V2d, 3>& plane) {
  const V2d a = plane[1] - plane[0];
  const V2d b = plane[2] - plane[0];
  const V3d p = corners[1] - corners[0];
  const V3d q = corners[2] - corners[0];
  const V3d along_u = (p * b.y - q * a.y) / (a % b);
  const V3d along_v = (q * a.x - p * b.x) / (a % b);
  const double middle = (along_u.length2() + along_v.length2()) / 2;
  const double spread = std::hypot((along_u.length2() - along_v.length2()) / 2, along_u.dot(along_v));
  return {std::sqrt(middle + spread), std::sqrt(std::max(0.0, middle - spread))};
}

Stretch worst_of(const ClothPanel& panel, const std::vector<V2d>& plane) {
  Stretch worst;
  for (const V3i& t : panel.triangles) {
    std::array<V3d, 3> corners;
    std::array<V2d, 3> flat;
    for (int k = 0; k < 3; ++k) {
      corners[k] = panel.positions[t[k]];
      flat[k] = plane[t[k]];
    }
    const Stretch s = stretch_of(corners, flat);
    worst.max = std::max(worst.max, s.max);
    worst.min = std::min(worst.min, s.min);
  }
  return worst;
}

/// How often cloth is longer or shorter one way than this fraction of the area at most.
double stretch_below(const Surface& surface, const Charts& charts, double fraction) {
  std::vector<std::pair<double, double>> stretches;  // each with twice the area
  double total = 0;
  for (std::size_t t = 0; t < charts.indices.size(); t += 3) {
    std::array<V3d, 3> corners;
    std::array<V2d, 3> plane;
    for (std::size_t k = 0; k < 3; ++k) {
      corners[k] = surface.positions[charts.source_vertices[charts.indices[t + k]]];
      plane[k] = charts.uvs[charts.indices[t + k]];
    }
    const double area = (corners[1] - corners[0]).cross(corners[2] - corners[0]).length();
    stretches.emplace_back(stretch_of(corners, plane).times(), area);
    total += area;
  }
  std::ranges::sort(stretches);
  auto at = stretches.begin();
  for (double sum = at->second; sum < fraction * total && at + 1 != stretches.end(); sum += at->second) ++at;
  return at->first;
}

/// All triangles in the plane, m^2. Those that are turned over count as negative.
double flat_area(const Charts& charts) {
  double sum = 0;
  for (std::size_t t = 0; t < charts.indices.size(); t += 3) {
    const V2d& a = charts.uvs[charts.indices[t]];
    sum -= (charts.uvs[charts.indices[t + 1]] - a) % (charts.uvs[charts.indices[t + 2]] - a) / 2;
  }
  return sum;
}

Garment garment_of(const Surface& surface) {
  Garment garment = test::square();
  GarmentPrimitive& p = garment.primitives[0];
  p.positions.clear();
  for (const V3d& position : surface.positions) p.positions.emplace_back(position);
  p.normals.assign(p.positions.size(), V3f(0, 0, 1));
  p.tex_coords.assign(p.positions.size(), V2f(0, 0));
  p.indices = surface.triangles;
  return garment;
}

}  // namespace

TEST_CASE("charts: a tube lies flat in its true size, upright, in four strips") {
  const Surface surface = tube(0.1, 0.5);
  const Charts charts = charts_of(surface);
  CHECK(charts.count == 4);
  CHECK(stretch_below(surface, charts, 1) < 1 + 1e-6);  // its facets bend along straight lines
  const double around = 48 * 0.2 * std::sin(std::numbers::pi / 48);
  CHECK(flat_area(charts) == doctest::Approx(around * 0.5).epsilon(1e-6));
  CHECK(charts.indices.size() == surface.triangles.size());
  for (std::size_t i = 0; i < charts.indices.size(); ++i)
    CHECK(surface.positions[charts.source_vertices[charts.indices[i]]] ==
          surface.positions[surface.triangles[i]]);
  // A metre down is a metre along v.
  for (std::size_t t = 0; t < charts.indices.size(); t += 3) {
    const std::uint32_t a = charts.indices[t];
    const std::uint32_t c = charts.indices[t + 2];
    CHECK(charts.uvs[c].y - charts.uvs[a].y ==
          doctest::Approx(surface.positions[charts.source_vertices[a]].y -
                          surface.positions[charts.source_vertices[c]].y)
              .epsilon(1e-6));
  }
}

TEST_CASE("charts: a sphere is six pieces of which none is turned over") {
  const Surface surface = sphere(0.5);
  const Charts charts = charts_of(surface);
  CHECK(charts.count == 6);
  CHECK(stretch_below(surface, charts, 0.95) < 1.2);
  // Two flat maps of the same piece differ, but by a few hundredths in area.
  CHECK(flat_area(charts) == doctest::Approx(std::numbers::pi).epsilon(0.03));
}

TEST_CASE("charts: a sheet with creases is one, and what has no area is left out") {
  Surface sheet = grid(20, 20, [](double u, double v) { return V3d(u, v, 0.002 * std::sin(40 * v)); });
  const std::size_t corners = sheet.triangles.size();
  sheet.triangles.insert(sheet.triangles.end(), {0, 0, 1, 5, 5, 5});
  const Charts charts = charts_of(sheet);
  CHECK(charts.count == 1);
  CHECK(charts.indices.size() == corners);
  CHECK(stretch_below(sheet, charts, 1) < 1.001);
  CHECK(charts_of({{V3d(0, 0, 0), V3d(1, 0, 0)}, {0, 1, 1}}).count == 0);
  CHECK(charts_of({}).count == 0);
}

TEST_CASE("charts: triangles that share no vertices, face any way or lie on each other hang together") {
  const Scene scene = test::need(read_scene(SELVEDGE_SOURCE_DIR "/samples/sweater.glb"));
  const ScenePrimitive& trim = scene.primitives[1];
  const std::size_t corners = trim.indices.size();
  const Surface whole{{trim.positions.begin(), trim.positions.end()}, trim.indices};
  const int count = charts_of(whole).count;
  struct Case {
    const char* what;
    double noise = 0;        // m
    std::size_t turned = 0;  // every nth triangle
    std::size_t sides = 1;
    std::size_t step = 1;  // triangles in this order, modulo their number
  };
  for (const Case& c : {Case{.what = "separate"},
                        {.what = "a little apart", .noise = 2e-6},
                        {.what = "some turned over", .turned = 7},
                        {.what = "shuffled, some turned over", .turned = 7, .step = 4999},
                        {.what = "with a back each", .sides = 2},
                        {.what = "with a back each, shuffled", .sides = 2, .step = 4999}}) {
    CAPTURE(c.what);
    Surface soup;
    for (std::size_t n = 0; n < c.sides * corners / 3; ++n) {
      const std::size_t t = n / c.sides * c.step % (corners / 3);
      const bool turned = n % c.sides == 1 || (c.turned > 0 && t % c.turned == 0);
      for (std::size_t k = 0; k < 3; ++k) {
        const V3d& p = whole.positions[whole.triangles[3 * t + (turned ? 2 - k : k)]];
        soup.triangles.push_back(static_cast<std::uint32_t>(soup.positions.size()));
        const auto angle = 1e5 * static_cast<double>(n);
        soup.positions.push_back(p + c.noise * V3d(std::sin(angle), std::cos(angle), std::sin(2 * angle)));
      }
    }
    const Charts charts = charts_of(soup);
    CHECK(charts.count == static_cast<int>(c.sides) * count);
    REQUIRE(charts.indices.size() == soup.triangles.size());
    for (std::size_t i = 0; i < charts.indices.size(); ++i)
      REQUIRE(charts.source_vertices[charts.indices[i]] == soup.triangles[i]);
  }
}

TEST_CASE("charts: no triangle is lost where a surface is no two-manifold") {
  const V3d left(-1, 0, 0);
  const V3d right(1, 0, 0);
  const V3d bottom(0, -1, 0);
  const V3d top(0, 1, 0);
  const V3d front(0, 0, 1);
  const V3d back(0, 0, -1);
  struct Case {
    const char* what;
    Surface surface;
    int count;
  };
  for (const Case& c :
       {Case{"three at an edge", {{bottom, top, left, right, front}, {0, 1, 2, 1, 0, 3, 0, 1, 4}}, 2},
        {"five at an edge",
         {{bottom, top, left, right, front, back}, {0, 1, 2, 1, 0, 3, 0, 1, 4, 1, 0, 5, 0, 1, 3}},
         3},
        {"cones that meet in a point",
         {{V3d(0, 0, 0), left, front, right, back, top, bottom + left, bottom + right},
          {0, 1, 2, 0, 2, 3, 0, 3, 4, 0, 4, 1, 0, 5, 6, 0, 6, 7, 0, 7, 5}},
         2},
        {"a corner on the next", {{left, right, top, top + V3d(1e-4, 0, 0), back}, {0, 1, 2, 2, 3, 4}}, 2}}) {
    CAPTURE(c.what);
    const Charts charts = charts_of(c.surface);
    CHECK(charts.count == c.count);
    REQUIRE(charts.indices.size() == c.surface.triangles.size());
    for (std::size_t i = 0; i < charts.indices.size(); ++i)
      CHECK(charts.source_vertices[charts.indices[i]] == c.surface.triangles[i]);
  }
}

TEST_CASE("dress: copies of vertices at seams do not repeat their faults") {
  Workshop workshop(garment_of(tube(0.1, 0.5)));
  GltfDocument document = test::need(load_gltf(workshop.garment));
  Json& primitive = document.json["meshes"][0]["primitives"][0];
  const std::size_t count = tube(0.1, 0.5).positions.size();
  const auto add = [&](const char* semantic, std::vector<float> one) {
    std::vector<float> values;
    for (std::size_t i = 0; i < count; ++i) values.insert(values.end(), one.begin(), one.end());
    primitive["attributes"][semantic] =
        append_float_accessor(document, values, static_cast<int>(one.size()), false);
    return primitive["attributes"][semantic].get<int>();
  };
  add("NORMAL", {0, 0, 2});
  add("TANGENT", {0, 0, 0, 0.5F});
  add("WEIGHTS_0", {0.25F, 0.5F, 0.5F, 0});
  const std::vector<std::uint8_t> joints(4 * count, 1);
  const int view = append_view(document, joints, 34962);
  primitive["attributes"]["JOINTS_0"] =
      append(document.json["accessors"],
             {{"bufferView", view}, {"componentType", 5121}, {"count", count}, {"type", "VEC4"}});
  document.json["materials"][0]["normalTexture"] = {{"index", 0}};
  document.json["textures"] = {{{"source", 0}}};
  document.json["images"] = {
      {{"mimeType", "image/png"},
       {"bufferView",
        append_view(document, test::need(encode_png(Image{1, 1, 3, {0.5F, 0.5F, 1}}, Transfer::keep)))}}};
  REQUIRE(save_gltf(document, workshop.garment));
  REQUIRE(workshop.dress({.all_cloth = true, .unwrap = Unwrapping::always}));
  const GltfDocument dressed = test::need(load_gltf(workshop.output));
  GltfReader reader(dressed);
  const Json& attributes = dressed.json["meshes"][0]["primitives"][0]["attributes"];
  const auto read = [&](const char* semantic) {
    return reader.attribute<Imath::V4d>(attributes, semantic, 0, "");
  };
  for (const V3d& n : reader.attribute<V3d>(attributes, "NORMAL", 0, "")) CHECK(n == V3d(0, 0, 1));
  REQUIRE(read("TANGENT").size() > count);
  for (const Imath::V4d& t : read("TANGENT")) {
    CHECK(std::abs(t.w) == 1);
    CHECK(V3d(t.x, t.y, t.z).length() == doctest::Approx(1));
    CHECK(std::abs(t.z) < 1e-6);
  }
  for (const Imath::V4d& j : read("JOINTS_0")) CHECK(j == Imath::V4d(1, 0, 0, 0));
  for (const Imath::V4d& w : read("WEIGHTS_0")) CHECK(w == Imath::V4d(1, 0, 0, 0));
}

TEST_CASE("dress: a garment without texture coordinates gets them in metres, whatever its unit") {
  for (const double unit : {1.0, 0.01}) {
    Workshop workshop(garment_of(tube(0.1 / unit, 0.5 / unit)));
    workshop.edit([&](Json& json) {
      json["nodes"][0]["scale"] = {unit, unit, unit};
      json["meshes"][0]["primitives"][0]["attributes"].erase("TEXCOORD_0");
    });
    CHECK(test::error_of(workshop.dress({.materials = {"#0"}, .unwrap = Unwrapping::never})).code ==
          Code::garment_no_uvs);
    CHECK(test::need(workshop.dress({.materials = {"#0"}})).warnings.size() == 1);
    const DressReport report =
        test::need(workshop.dress({.materials = {"#0"}, .unwrap = Unwrapping::always}));
    CHECK(report.unwrap_reports.at(0).chart_count == 4);
    CHECK(report.materials[0].uv_size.stretch_p95 == doctest::Approx(1).epsilon(1e-4));
    CHECK_FALSE(report.unwrap_reports.at(0).had_uvs);
    CHECK(report.materials[0].repeats.x == doctest::Approx(200).epsilon(1e-4));
    CHECK(report.materials[0].repeats.y == doctest::Approx(250).epsilon(1e-4));
    CHECK(report.warnings.empty());
    Scene scene;
    for (const Error& issue : check_gltf(workshop.output, {}, &scene)) FAIL_CHECK(to_line(issue));
  }
}

TEST_CASE("dress: coordinates that are stretched beyond use give way, beside the set of a print") {
  // A square metre in two strips across, the upper one 0.2 m high: its part of the picture is a fifth as high
  // as it should be, or a half.
  for (const auto& [part, fraction, new_charts] :
       {std::tuple(0.2F, 0.2F, true), {0.5F, 0.2F, false}, {0.2F, 0.05F, false}}) {
    CAPTURE(part);
    CAPTURE(fraction);
    const float seam = 1 - fraction;
    const float end = seam + part * fraction;
    Garment garment = garment_of(
        {{V3d(0, 0, 0), V3d(1, 0, 0), V3d(1, seam, 0), V3d(0, seam, 0), V3d(1, 1, 0), V3d(0, 1, 0)},
         {0, 1, 2, 0, 2, 3, 3, 2, 4, 3, 4, 5}});
    garment.primitives[0].tex_coords = {V2f(0, 1),        V2f(1, 1),       V2f(1, 1 - seam),
                                        V2f(0, 1 - seam), V2f(1, 1 - end), V2f(0, 1 - end)};
    Workshop workshop(garment);
    const Image red{1, 1, 3, {1, 0, 0}};
    GltfDocument document = test::need(load_gltf(workshop.garment));
    const int view = append_view(document, test::need(encode_png(red, Transfer::keep)));
    document.json["images"] = {{{"mimeType", "image/png"}, {"bufferView", view}}};
    document.json["textures"] = {{{"source", 0}}};
    document.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = {{"index", 0}};
    REQUIRE(save_gltf(document, workshop.garment));
    const DressReport report = test::need(workshop.dress({.all_cloth = true}));
    CHECK(report.unwrap_reports.size() == (new_charts ? 1 : 0));
    const Scene scene = test::need(read_scene(workshop.output));
    CHECK(scene.materials[0].fabric->tex_coord == (new_charts ? 1 : 0));
    CHECK(scene.materials[0].garment_textures.tint_texture.tex_coord == 0);
    CHECK(scene.materials[0].double_sided);
    for (const Error& issue : check_gltf(workshop.output, {})) FAIL_CHECK(to_line(issue));
    CHECK(
        test::need(workshop.dress({.all_cloth = true, .unwrap = Unwrapping::never})).unwrap_reports.empty());
    const DressReport moved = test::need(workshop.dress({.all_cloth = true, .unwrap = Unwrapping::always}));
    CHECK(moved.warnings[0].ends_with("show in other places now"));
  }
}

TEST_CASE("dress: the back of a single-sided garment shows, with a remark, unless it is to stay hidden") {
  Workshop workshop;
  workshop.edit([](Json& json) { json["materials"][0].erase("doubleSided"); });
  CHECK(test::need(workshop.dress({.all_cloth = true})).warnings.size() == 1);
  CHECK(test::need(read_scene(workshop.output)).materials[0].double_sided);
  CHECK(test::need(workshop.dress({.all_cloth = true, .single_sided = true})).warnings.empty());
  CHECK_FALSE(test::need(read_scene(workshop.output)).materials[0].double_sided);
}

TEST_CASE("dress: unwrapping replaces coordinates, counts as memory, and needs an area") {
  const Workshop workshop(garment_of(tube(0.1, 0.5)));
  const DressReport report = test::need(workshop.dress({.all_cloth = true, .unwrap = Unwrapping::always}));
  CHECK(report.unwrap_reports.at(0).had_uvs);
  CHECK(report.warnings.empty());
  // The charts on a set of their own: the first stays.
  const DressReport second =
      test::need(workshop.dress({.all_cloth = true, .unwrap = Unwrapping::always, .tex_coord = 1}));
  CHECK_FALSE(second.unwrap_reports.at(0).had_uvs);
  CHECK(test::need(read_scene(workshop.output)).primitives[0].tex_coords[0].front() == V2d(0, 0));
  DressOptions options{.all_cloth = true, .unwrap = Unwrapping::always};
  options.limits.document.memory = 3 << 20;  // for 960 triangles
  CHECK(test::error_of(workshop.dress(options)).code == Code::file_too_large);
  const Workshop flat(garment_of({{V3d(0, 0, 0), V3d(1, 0, 0), V3d(2, 0, 0)}, {0, 1, 2}}));
  CHECK(test::error_of(flat.dress({.all_cloth = true, .unwrap = Unwrapping::always})).code ==
        Code::garment_empty);
}

TEST_CASE("dress: garments of the field are unwrapped with little stretch, skins and morph targets too") {
  const std::string data = test::shared_data("garments/khronos/");
  if (data.empty()) return;
  for (const char* file :
       {"Corset/glTF/Corset.gltf", "RiggedFigure/glTF/RiggedFigure.gltf", "Fox/glTF/Fox.gltf",
        "SheenCloth/glTF/SheenCloth.gltf", "AnimatedMorphCube/glTF/AnimatedMorphCube.gltf"}) {
    CAPTURE(file);
    if (!std::filesystem::exists(data + file)) continue;
    Workshop workshop;
    workshop.garment = data + file;
    const DressReport report =
        test::need(workshop.dress({.materials = {"#0"}, .unwrap = Unwrapping::always}));
    const UvSize& size = report.materials[0].uv_size;
    CHECK(size.stretch_p95 < 1.5);
    CHECK(size.fraction_without_uvs == 0);
    CHECK(size.metres_per_uv.x == doctest::Approx(1).epsilon(0.1));
    CHECK(size.metres_per_uv.y == doctest::Approx(1).epsilon(0.1));
    // The surface is where it was.
    const Imath::Box3d before = bounds_of(test::need(read_scene(workshop.garment)));
    const Imath::Box3d after = bounds_of(test::need(read_scene(workshop.output)));
    CHECK((before.min - after.min).length() + (before.max - after.max).length() <
          1e-6 * before.size().length());
    for (const Error& issue : check_gltf(workshop.output, {})) {
      // The data has no textures of the Corset.
      if (issue.code != Code::gltf_advice && issue.code != Code::image_unreadable) FAIL_CHECK(to_line(issue));
    }
  }
}

TEST_CASE("dress: a primitive without an area does not keep the others from being unwrapped") {
  Garment garment = garment_of(tube(0.1, 0.5));
  GarmentPrimitive line = garment.primitives[0];
  for (V3f& position : line.positions) position.x = position.z = 0;
  garment.primitives.push_back(line);
  Workshop workshop(garment);
  workshop.edit([](Json& json) {
    for (Json& primitive : json["meshes"][0]["primitives"]) primitive["attributes"].erase("TEXCOORD_0");
  });
  const DressReport report = test::need(workshop.dress({.materials = {"#0"}, .unwrap = Unwrapping::always}));
  CHECK(report.unwrap_reports.at(0).chart_count == 4);
  for (const Error& issue : check_gltf(workshop.output, {}))
    if (issue.code != Code::gltf_advice) FAIL_CHECK(to_line(issue));
}

TEST_CASE("dress: a material without an area is left alone where all are dressed, and named where it is") {
  Garment garment = test::square(2);
  for (V3f& position : garment.primitives[1].positions) position.y = 0;
  const Workshop workshop(garment);
  const DressReport report = test::need(workshop.dress({.all_cloth = true, .unwrap = Unwrapping::always}));
  CHECK(report.materials.size() == 1);
  CHECK(std::ranges::count(report.warnings,
                           "material #1 was left alone: no triangle has an area to lay flat") == 1);
  const Error error = test::error_of(workshop.dress({.materials = {"#1"}, .unwrap = Unwrapping::always}));
  CHECK(error.code == Code::garment_empty);
  CHECK(error.place == "/materials/1");
}

TEST_CASE("charts: one with very many holes is projected, as its equations would fill up") {
  // A sixth of a tube, whose facets at the edges are seen from in front at nearly 30 degrees.
  constexpr std::uint32_t side = 43;
  Surface net;
  for (std::uint32_t j = 0; j <= side; ++j) {
    for (std::uint32_t i = 0; i <= side; ++i) {
      const double angle = (static_cast<double>(i) / side - 0.5) * std::numbers::pi / 3;
      net.positions.emplace_back(std::sin(angle), static_cast<double>(j) / side, std::cos(angle));
    }
  }
  for (std::uint32_t j = 0; j < side; ++j) {
    for (std::uint32_t i = 0; i < side; ++i) {
      if (i % 4 == 1 && j % 4 == 1) continue;  // 121 of them, symmetric
      const std::uint32_t a = j * (side + 1) + i;
      const std::uint32_t b = a + side + 1;
      net.triangles.insert(net.triangles.end(), {a, a + 1, b + 1, a, b + 1, b});
    }
  }
  const Charts charts = charts_of(net);
  CHECK(charts.count == 1);
  CHECK(stretch_below(net, charts, 1) ==
        doctest::Approx(1 / std::cos((0.5 - 0.5 / side) * std::numbers::pi / 3)));
}

TEST_CASE("new vertices take every attribute and morph target along") {
  const Folder folder;
  REQUIRE(write_garment(folder / "square.glb", test::square()));
  GltfDocument document = test::need(load_gltf(folder / "square.glb"));
  Json& primitive = document.json["meshes"][0]["primitives"][0];
  std::vector<float> moves;
  for (int i = 0; i < 12; ++i) moves.push_back(static_cast<float>(i));
  const std::vector<std::uint8_t> ids{0, 1, 2, 3};  // as a SCALAR of bytes, padded to 4 in the file
  const int view = append_attribute_view(document, {4, 1, 5121, false}, ids);
  primitive["attributes"]["_ID"] =
      append(document.json["accessors"],
             {{"bufferView", view}, {"componentType", 5121}, {"count", 4}, {"type", "SCALAR"}});
  const Json target{{"POSITION", append_float_accessor(document, moves, 3, true)}};
  primitive["targets"] = std::vector<Json>(1000, target);
  const std::size_t accessors = document.json["accessors"].size();
  const std::size_t attributes = primitive["attributes"].size();

  GltfReader reader(document);
  gather_vertices(document, reader, primitive, {0, 1, 2, 3, 1, 2}, "/meshes/0/primitives/0");
  // An accessor that a thousand morph targets name is copied once.
  CHECK(document.json["accessors"].size() == accessors + attributes + 1);
  for (const auto& [semantic, accessor] : primitive["attributes"].items()) {
    const std::string named = semantic;  // Clang 14 captures no bindings.
    CAPTURE(named);
    CHECK(document.json["accessors"][accessor.get<std::size_t>()]["count"] == 6);
  }
  const auto moved = reader.numbers(index_of(primitive["targets"][999]["POSITION"]), "");
  CHECK(moved[12] == 3);  // the copy of vertex 1
  CHECK(moved[15] == 6);  // and of vertex 2
  CHECK(reader.numbers(index_of(primitive["attributes"]["_ID"]), "")[4] == 1);
}

TEST_CASE("half a tube is unrolled without stretch") {
  // A tube of flat facets can be unrolled exactly: what is left is the solver's rounding.
  const ClothPanel panel = panel_of(grid(24, 16, [](double a, double b) {
    return V3d(-0.1 * std::cos(std::numbers::pi * a), 0.4 * b, 0.1 * std::sin(std::numbers::pi * a));
  }));
  const std::vector<V2d> plane = flatten(panel);
  const Stretch worst = worst_of(panel, plane);
  CHECK(worst.max < 1 + 1e-6);
  CHECK(worst.min > 1 - 1e-6);
}

TEST_CASE("a cap of a sphere is stretched no more than its curvature asks for") {
  // Radius 1, 0.5 x 0.5: the way along an edge and through the middle differ by about r^2 / 8 = 3 %.
  const ClothPanel panel = panel_of(grid(20, 20, [](double a, double b) {
    const double x = 0.5 * a - 0.25;
    const double y = 0.5 * b - 0.25;
    return V3d(x, y, std::sqrt(1 - x * x - y * y));
  }));
  const std::vector<V2d> plane = flatten(panel);
  const Stretch worst = worst_of(panel, plane);
  CHECK(worst.max < 1.04);
  CHECK(worst.min > 0.96);
  CHECK(worst.max - worst.min > 0.005);  // Gauss: it cannot be none
}

TEST_CASE("the flat panel keeps the outside up") {
  const ClothPanel panel = panel_of(grid(4, 4, [](double a, double b) { return V3d(a, b, 0.1 * a * b); }));
  const std::vector<V2d> plane = flatten(panel);
  for (const V3i& t : panel.triangles) {
    const V2d& a = plane[t[0]];
    CHECK((plane[t[1]] - a) % (plane[t[2]] - a) > 0);
  }
}
