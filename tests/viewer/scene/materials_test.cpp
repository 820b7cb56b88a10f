#include "viewer/scene/materials.h"

#include <doctest/doctest.h>

#include "tests/require.h"
#include "tests/viewer/shapes.h"

namespace selvedge {
namespace {

SceneImage pixel(float grey) {
  Image image{1, 1, 3, {grey, grey, grey}};
  const auto png = test::need(encode_png(image, Transfer::keep));
  return {"pixel", "image/png", png};
}

TEST_CASE("a core material's textures know their coordinates, colours are linear and data are as stored") {
  Scene scene;
  SceneMaterial material;
  material.base_color_texture.image = 0;
  material.metallic_roughness_texture.image = 0;
  material.normal_texture.image = 0;
  material.normal_texture.transform.scale = V2d(3, 3);
  material.normal_scale = 0.5F;
  material.occlusion_texture.image = 0;
  material.occlusion_texture.tex_coord = 1;
  material.occlusion_texture.wrap_u = Wrap::clamp;
  material.emissive_texture.image = 0;
  material.emissive = V3f(1, 2, 3);
  material.unlit = true;
  scene.images = {pixel(0.5F)};
  ScenePrimitive square = test::square(2);
  square.tex_coords[1] = {V2d(0.5, 0.25), V2d(0, 0), V2d(1, 0), V2d(1, 1)};
  test::add(scene, square, material);
  const auto surfaces = test::need(build_surfaces(scene, V3d(0, 0, 0)));
  std::vector<std::string> remarks;
  const auto materials = materials_of(scene, surfaces, remarks);
  CHECK(remarks.empty());
  REQUIRE(materials.pbr.size() == 1);
  const PbrMaterial& pbr = materials.pbr[0];
  CHECK(pbr.base_color_texture.mapping == 0);
  CHECK(pbr.metallic_roughness_texture.mapping == 0);
  CHECK(pbr.normal_texture.mapping == 1);
  CHECK(pbr.occlusion_texture.mapping == 2);
  CHECK(pbr.occlusion_texture.wrap_u == Wrap::clamp);
  CHECK(pbr.emissive_texture.mapping == 0);
  CHECK(pbr.normal_scale == 0.5F);
  CHECK(pbr.emissive == V3f(1, 2, 3));
  CHECK(pbr.unlit);
  // One file, two pictures: sRGB for colours, as stored for data.
  CHECK(materials.pictures.size() == 2);
  CHECK(pbr.base_color_texture.image == pbr.emissive_texture.image);
  CHECK(pbr.normal_texture.image == pbr.occlusion_texture.image);
  CHECK(materials.pictures[pbr.normal_texture.image].transfer == Transfer::keep);
  CHECK(materials.pictures[pbr.base_color_texture.image].transfer == Transfer::srgb);
  CHECK(materials.pictures[0].bytes == materials.pictures[1].bytes);
  CHECK(materials.pictures[0].size == V2i(1, 1));
  const Surface& surface = surfaces.front();
  REQUIRE(surface.extra_uvs.size() == 2);
  CHECK(surface.vertices[2].uv == V2f(2, 2));
  CHECK(surface.extra_uvs[0][2] == V2f(6, 6));
  CHECK(surface.extra_uvs[1][0] == V2f(0.5F, 0.25F));
  CHECK(surface.vertices[0].tangent == V4f(1, 0, 0, 1));  // made for the normal texture
}

TEST_CASE("beside a fabric only occlusion and emission count") {
  Scene scene;
  SceneMaterial material = test::material(0);
  material.base_color_texture.image = 0;
  material.normal_texture.image = 0;
  material.occlusion_texture.image = 0;
  material.emissive = V3f(1, 1, 1);
  scene.images = {pixel(1)};
  test::add(scene, test::square(1), material);
  const auto surfaces = test::need(build_surfaces(scene, V3d(0, 0, 0)));
  std::vector<std::string> remarks;
  const auto materials = materials_of(scene, surfaces, remarks);
  const PbrMaterial& pbr = materials.pbr[0];
  CHECK(pbr.base_color_texture.image == -1);
  CHECK(pbr.normal_texture.image == -1);
  CHECK(pbr.occlusion_texture.image == 0);
  CHECK(pbr.emissive == V3f(1, 1, 1));
}

TEST_CASE("the default material is glTF's: white metal, rough") {
  Scene scene;
  test::add(scene, test::square(1), SceneMaterial{});
  scene.primitives[0].material = -1;
  const auto surfaces = test::need(build_surfaces(scene, V3d(0, 0, 0)));
  std::vector<std::string> remarks;
  const auto materials = materials_of(scene, surfaces, remarks);
  CHECK(materials.pbr[0].metallic == 1);
  CHECK(materials.pbr[0].roughness == 1);
  CHECK(materials.surfaces[0].culls_back);
}

}  // namespace
}  // namespace selvedge
