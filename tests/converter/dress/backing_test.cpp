
#include <doctest/doctest.h>

#include <cmath>

#include "format/check/gltf.h"
#include "format/gltf/read_scene.h"
#include "tests/converter/workshop.h"

using namespace selvedge;
using test::Workshop;

namespace {

/// A cube of one metre about the origin; its faces have vertices of their own.
Garment cube() {
  Garment garment = test::square();
  GarmentPrimitive& p = garment.primitives[0];
  const GarmentPrimitive face = p;
  p.positions.clear();
  p.normals.clear();
  p.tex_coords.clear();
  p.indices.clear();
  for (int axis = 0; axis < 3; ++axis) {
    for (const float side : {-1.0F, 1.0F}) {
      const auto first = static_cast<std::uint32_t>(p.positions.size());
      for (const V3f& corner : face.positions) {
        V3f at;
        at[axis] = side / 2;
        at[(axis + 1) % 3] = (corner.x - 0.5F) * side;
        at[(axis + 2) % 3] = corner.y - 0.5F;
        p.positions.push_back(at);
        V3f normal(0, 0, 0);
        normal[axis] = side;
        p.normals.push_back(normal);
      }
      p.tex_coords.insert(p.tex_coords.end(), face.tex_coords.begin(), face.tex_coords.end());
      for (const std::uint32_t i : face.indices) p.indices.push_back(first + i);
    }
  }
  return garment;
}

}  // namespace

TEST_CASE("dress: the backing of a cube is a closed cube that is a quarter of a repeat further in") {
  for (const double scale : {1.0, 0.01}) {
    Workshop workshop(cube());
    workshop.edit([&](Json& json) { json["nodes"][0]["scale"] = {scale, scale, scale}; });
    DressOptions options{
        .all_cloth = true, .colourways = {{"red", V3f(0.2F, 0, 0)}}, .backing = V3f(0.25F, 0.5F, 1)};
    const DressReport report = test::need(workshop.dress(options));
    CHECK(report.backed_primitive_count == 1);
    Scene scene;
    for (const Error& issue : check_gltf(workshop.output, {}, &scene)) FAIL_CHECK(to_line(issue));
    REQUIRE(scene.primitives.size() == 2);
    const ScenePrimitive& behind = scene.primitives[1];
    const SceneMaterial& material = scene.materials[behind.material];
    CHECK(material.name == "cloth 0 backing");
    CHECK(material.base_color == V4f(0.25F, 0.5F, 1, 1));
    CHECK(material.metallic == 0);
    CHECK_FALSE(material.double_sided);
    CHECK_FALSE(material.fabric);
    // The shorter side of a repeat is 4 mm; the corners move along the diagonal.
    const double inward = 0.001 / std::sqrt(3.0) / scale;
    for (const V3f& position : behind.positions)
      for (int c = 0; c < 3; ++c) CHECK(std::abs(position[c]) == doctest::Approx(0.5 - inward).epsilon(1e-5));
    CHECK(behind.normals.size() == behind.positions.size());
    CHECK(behind.indices == scene.primitives[0].indices);
    // No variant changes it.
    const Scene red = test::need(read_scene(workshop.output, {}, {.scene = "", .variant = "red"}));
    CHECK(red.materials[red.primitives[0].material].name == "cloth 0 red");
    CHECK(red.primitives[1].material == behind.material);
    // Dressed once more, it stays what it is.
    workshop.garment = workshop.output;
    workshop.output = workshop.folder / "again.glb";
    CHECK(test::need(workshop.dress({.all_cloth = true})).materials.size() == 2);
  }
}

TEST_CASE("dress: two layers back to back are backed each on its own side") {
  Garment garment = test::square();
  GarmentPrimitive& p = garment.primitives[0];
  const GarmentPrimitive front = p;
  p.positions.insert(p.positions.end(), front.positions.begin(), front.positions.end());
  p.normals.insert(p.normals.end(), 4, V3f(0, 0, -1));
  p.tex_coords.insert(p.tex_coords.end(), front.tex_coords.begin(), front.tex_coords.end());
  p.indices.insert(p.indices.end(), {4, 6, 5, 4, 7, 6});
  const Workshop workshop(garment);
  test::need(workshop.dress({.all_cloth = true, .backing = V3f(0, 0, 0)}));
  const Scene scene = test::need(read_scene(workshop.output));
  for (int i = 0; i < 8; ++i)
    CHECK(scene.primitives[1].positions[i].z == doctest::Approx(i < 4 ? -0.001 : 0.001));
}

TEST_CASE("dress: a place that wears two dressed materials has one backing") {
  Workshop workshop(test::square(2));
  workshop.edit([](Json& json) {
    json["extensionsUsed"] = {"KHR_materials_variants"};
    json["extensions"]["KHR_materials_variants"]["variants"] = {{{"name", "night"}}};
    json["meshes"][0]["primitives"].erase(1);
    json["meshes"][0]["primitives"][0]["extensions"]["KHR_materials_variants"]["mappings"] = {
        {{"material", 1}, {"variants", {0}}}};
  });
  const DressReport report = test::need(workshop.dress({.all_cloth = true, .backing = V3f(0, 0, 0)}));
  CHECK(report.materials.size() == 2);
  CHECK(report.backed_primitive_count == 1);
}

TEST_CASE("dress: dressing again puts the new backing in the place of the old") {
  Workshop workshop(cube());
  test::need(workshop.dress({.all_cloth = true, .backing = V3f(0, 0, 0)}));
  const auto primitives = [&] {
    return test::need(load_gltf(workshop.output)).json["meshes"][0]["primitives"];
  };
  const std::size_t backed = primitives().size();
  workshop.garment = workshop.output;
  workshop.output = workshop.folder / "again.glb";
  CHECK(test::need(workshop.dress({.all_cloth = true, .backing = V3f(1, 0, 0)})).backed_primitive_count == 1);
  CHECK(primitives().size() == backed);
}
