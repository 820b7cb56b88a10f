#include "viewer/scene/surfaces.h"

#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "tests/require.h"
#include "tests/viewer/shapes.h"
#include "viewer/scene/change_fabrics.h"
#include "viewer/scene/materials.h"

namespace selvedge {
namespace {

Surface build_one(const Scene& scene) {
  const std::vector<Surface> surfaces = test::need(build_surfaces(scene, V3d(0, 0, 0)));
  REQUIRE(surfaces.size() == 1);
  return surfaces.front();
}

void check_tangents(const Surface& surface, const V3f& expected, float handedness) {
  REQUIRE_FALSE(surface.vertices.empty());
  for (const SurfaceVertex& v : surface.vertices) {
    CHECK((V3f(v.tangent.x, v.tangent.y, v.tangent.z) - expected).length() < 1e-6F);
    CHECK(v.tangent.w == handedness);
  }
}

TEST_CASE("the tangent runs along growing u, turned and mirrored by the texture transform") {
  struct Case {
    double rotation;
    V2d scale;
    V3f tangent;
    float handedness;
  };
  // uv' = (-v, u) up to the sense of the rotation, so u' grows along -v or +v: along +y or -y of the square.
  constexpr double quarter = std::numbers::pi / 2;
  UvTransform turned;
  turned.rotation = quarter;
  const float along_y = turned.apply_linear(V2d(0, 1)).x > 0 ? -1 : 1;
  for (const Case& example : {Case{0, {1, 1}, {1, 0, 0}, 1}, Case{quarter, {1, 1}, {0, along_y, 0}, 1},
                              Case{0, {-2, 1}, {-1, 0, 0}, -1}}) {
    Scene scene;
    SceneMaterial material = test::material(0);
    material.fabric->transform.rotation = example.rotation;
    material.fabric->transform.scale = example.scale;
    test::add(scene, test::square(3), material);
    check_tangents(build_one(scene), example.tangent, example.handedness);
  }
}

TEST_CASE("normal x tangent times the handedness is the direction of falling v") {
  for (const V2d& scale : {V2d(1, 1), V2d(-1, 1), V2d(1, -1), V2d(-1, -1)}) {
    Scene scene;
    SceneMaterial material = test::material(0);
    material.fabric->transform.scale = scale;
    test::add(scene, test::square(1), material);
    const SurfaceVertex v = build_one(scene).vertices.front();
    const V3f up = v.normal.cross(V3f(v.tangent.x, v.tangent.y, v.tangent.z)) * v.tangent.w;
    // In the square v falls along +y, unless its scale is negative.
    CHECK(up.y == doctest::Approx(scale.y));
  }
}

TEST_CASE("an instance's transform moves points, tangents and normals") {
  Scene scene;
  M44d world;
  world.setScale(V3d(2, 1, 0.5));
  world *= M44d().rotate(V3d(0, 0, std::numbers::pi / 2));
  world *= M44d().translate(V3d(10, 0, 0));
  test::add(scene, test::square(1), test::material(0), world);
  const Surface surface = build_one(scene);
  check_tangents(surface, V3f(0, 1, 0), 1);
  CHECK((surface.vertices[0].normal - V3f(0, 0, 1)).length() < 1e-6F);
  // Corner (-1, 1) -> (-2, 1) -> (-1, -2) -> (9, -2).
  CHECK((surface.vertices[0].position - V3f(9, -2, 0)).length() < 1e-5F);
}

TEST_CASE("a mirroring instance keeps triangles counter-clockwise around the normal") {
  Scene scene;
  M44d world;
  world.setScale(V3d(-1, 1, 1));
  test::add(scene, test::square(1), test::material(0), world);
  const Surface s = build_one(scene);
  const V3f a = s.vertices[s.indices[0]].position;
  const V3f side = (s.vertices[s.indices[1]].position - a).cross(s.vertices[s.indices[2]].position - a);
  CHECK(side.dot(s.vertices[0].normal) > 0);
  check_tangents(s, V3f(-1, 0, 0), -1);
}

TEST_CASE("a vertex between mirrored and upright triangles is doubled") {
  Scene scene;
  ScenePrimitive p;
  // Two triangles with a common edge x = 0; u = |x|.
  p.positions = {V3f(0, 0, 0), V3f(1, 0, 0), V3f(0, 1, 0), V3f(-1, 0, 0)};
  p.normals.assign(4, V3f(0, 0, 1));
  p.tex_coords[0] = {V2d(0, 1), V2d(1, 1), V2d(0, 0), V2d(1, 1)};
  p.indices = {0, 1, 2, 0, 2, 3};
  test::add(scene, p, test::material(0));
  const Surface s = build_one(scene);
  CHECK(s.vertices.size() == 6);
  for (std::size_t i = 0; i < 6; ++i) {
    const SurfaceVertex& v = s.vertices[s.indices[i]];
    const float side = i < 3 ? 1.0F : -1.0F;
    CHECK(v.tangent.x == doctest::Approx(side));
    CHECK(v.tangent.w == side);
  }
}

TEST_CASE("whole repeats are taken off before the coordinates become float") {
  Scene scene;
  ScenePrimitive p = test::square(1);
  // A texel of a 32-texel fabric is 0.03 wide; float near 1e8 has steps of 8.
  for (V2d& uv : p.tex_coords[0]) uv += V2d(1e8 + 0.25, -3e8 + 0.5);
  test::add(scene, p, test::material(0));
  const Surface s = build_one(scene);
  CHECK(s.vertices[0].uv == V2f(0.25F, 0.5F));
  CHECK(s.vertices[2].uv == V2f(1.25F, 1.5F));
}

TEST_CASE("charts are brought near zero one by one") {
  Scene scene;
  ScenePrimitive p = test::square(1);
  const ScenePrimitive other = test::square(1, 2);
  p.positions.insert(p.positions.end(), other.positions.begin(), other.positions.end());
  p.normals.insert(p.normals.end(), other.normals.begin(), other.normals.end());
  for (const V2d& uv : other.tex_coords[0]) p.tex_coords[0].push_back(uv + V2d(3e9 + 0.125, 0.5));
  p.indices.insert(p.indices.end(), {4, 5, 6, 4, 6, 7});
  test::add(scene, p, test::material(0));
  const Surface s = build_one(scene);
  CHECK(s.vertices[0].uv == V2f(0, 0));
  CHECK(s.vertices[4].uv == V2f(0.125F, 0.5F));
  CHECK(s.vertices[6].uv == V2f(1.125F, 1.5F));
}

TEST_CASE("a picture that ends is not moved, a mirrored one by pairs of repeats") {
  Scene scene;
  SceneMaterial material = test::material(-1);
  material.base_color_texture.image = 0;
  material.base_color_texture.wrap_u = Wrap::clamp;
  material.base_color_texture.wrap_v = Wrap::mirror;
  ScenePrimitive p = test::square(1);
  for (V2d& uv : p.tex_coords[0]) uv += V2d(5, 5);
  test::add(scene, p, material);
  CHECK(build_one(scene).vertices[0].uv == V2f(5, 1));
}

TEST_CASE("vertex colours and the file's own tangents come along") {
  Scene scene;
  SceneMaterial material = test::material(-1);
  material.normal_texture.image = 0;
  ScenePrimitive p = test::square(1);
  p.colors.assign(4, V4f(0.5F, 0.25F, 1, 1));
  p.tangents.assign(4, V4f(0, 1, 0, -1));
  M44d world;
  world.setScale(V3d(1, -3, 1));
  test::add(scene, p, material, world);
  const Surface s = build_one(scene);
  CHECK(s.colors == std::vector<V4f>(4, V4f(0.5F, 0.25F, 1, 1)));
  // A mirroring turns cross(normal, tangent) against the picture: the sign turns, too.
  for (const SurfaceVertex& v : s.vertices) CHECK(v.tangent == V4f(0, -1, 0, 1));
}

TEST_CASE("triangles without area leave finite vertices") {
  Scene scene;
  ScenePrimitive p = test::square(1);
  p.indices.insert(p.indices.end(), {0, 0, 0, 0, 1, 1});
  p.tex_coords[0][3] = p.tex_coords[0][2];
  p.normals[1] = V3f(0, 0, 0);
  test::add(scene, p, test::material(0));
  for (const SurfaceVertex& v : build_one(scene).vertices) {
    CHECK(std::isfinite(v.tangent.dot(v.tangent)));
    CHECK(std::isfinite(v.normal.length()));
  }
}

TEST_CASE("refuses what cannot be drawn") {
  const auto code_of = [](const ScenePrimitive& p) {
    Scene scene;
    test::add(scene, p, test::material(0));
    return test::error_of(build_surfaces(scene, V3d(0, 0, 0))).code;
  };
  ScenePrimitive p = test::square(1);
  p.tex_coords[0].clear();
  CHECK(code_of(p) == Code::garment_no_uvs);
  p = test::square(1);
  p.tex_coords[0][0].x = std::numeric_limits<double>::infinity();
  CHECK(code_of(p) == Code::mesh_not_finite);
  p = test::square(1);
  p.positions[0].x = std::numeric_limits<float>::quiet_NaN();
  CHECK(code_of(p) == Code::mesh_not_finite);
}

TEST_CASE("a scene without triangles has no points, and none lie beyond 10^9 m") {
  Scene scene;
  CHECK(test::error_of(world_points(scene)).code == Code::garment_empty);
  ScenePrimitive far = test::square(1);
  far.positions[0].x = 1.9e30F;  // an offset that was off by a byte
  test::add(scene, far, test::material(0));
  CHECK(test::error_of(world_points(scene)).code == Code::mesh_not_finite);
}

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

/// Millimetres on the cloth where a point of the garment's coordinates lies.
V2d place_on_cloth(const Scene& scene, const Fabric& fabric, const V2d& uv) {
  return scene.materials[0].fabric->transform.apply(uv) * V2d(fabric.period_mm);
}

TEST_CASE("a fitted fabric has larger stitches, and a quarter turn is one of millimetres") {
  Fabric fabric;
  fabric.period_mm = V2f(3, 5);
  for (const double quarters : {0, 1, 2, 3}) {
    Scene scene;
    scene.materials.resize(2);
    scene.materials[0].fabric = FabricReference{};
    UvTransform& transform = scene.materials[0].fabric->transform;
    transform.offset = V2d(0.2, -0.4);
    transform.rotation = quarters * std::numbers::pi / 2;
    transform.scale = V2d(40, 30);
    scene.materials[0].garment_textures.tint = V3f(1, 0.5F, 1);
    const Scene before = scene;
    FabricFit fit;
    fit.stitch_scale = 2.5;
    fit.quarter_turns = 3;
    fit.tint = V3f(0.5F, 0.5F, 2);
    fit_fabrics(std::vector<FabricFit>{fit, {}}, std::vector<Fabric>{fabric}, scene);
    CHECK(scene.materials[0].garment_textures.tint == V3f(0.5F, 0.25F, 2));
    CHECK_FALSE(scene.materials[1].fabric.has_value());
    for (const V2d& uv : {V2d(0, 0), V2d(1, 0), V2d(0.3, 0.9)}) {
      const V2d was = place_on_cloth(before, fabric, uv);
      const V2d is = place_on_cloth(scene, fabric, uv);
      // Three turns of (x, y) -> (y, -x) are one of (x, y) -> (-y, x).
      CHECK(is.x == doctest::Approx(-was.y / 2.5));
      CHECK(is.y == doctest::Approx(was.x / 2.5));
    }
  }
}

}  // namespace
}  // namespace selvedge
