#include "converter/dress/add_tangents.h"

#include <doctest/doctest.h>

#include <cmath>
#include <filesystem>

#include "format/gltf/edit.h"
#include "format/gltf/read_scene.h"
#include "format/scene/tangents.h"
#include "samples/gltf_writer.h"
#include "tests/format/garments.h"
#include "tests/format/gltf_fixtures.h"
#include "tests/require.h"
#include "tests/shared_data.h"

using namespace selvedge;
using test::Folder;
namespace fs = std::filesystem;

TEST_CASE("tangents: an upright picture has its tangent along growing u and w = +1") {
  const std::vector<V3d> positions{V3d(0, 0, 0), V3d(1, 0, 0), V3d(1, 1, 0), V3d(0, 1, 0)};
  const std::vector<V3d> normals(4, V3d(0, 0, 1));
  const std::vector<V2d> uvs{V2d(0, 1), V2d(1, 1), V2d(1, 0), V2d(0, 0)};
  const std::vector<std::uint32_t> indices{0, 1, 2, 0, 2, 3};
  const Tangents tangents = compute_tangents(positions, normals, uvs, indices, Facing::winding);
  REQUIRE(tangents.tangents.size() == 4);
  // The bitangent cross(n, t) * w is +y: up in the picture, where v falls.
  for (const V4f& t : tangents.tangents) CHECK(t == V4f(1, 0, 0, 1));
  CHECK(tangents.copy_of.empty());
  CHECK(tangents.indices == indices);
}

TEST_CASE("tangents: vertices on the seam of a mirrored chart are split") {
  // Two squares side by side, the right one with the picture mirrored; vertices 1 and 2 are shared.
  const std::vector<V3d> positions{V3d(0, 0, 0), V3d(1, 0, 0), V3d(1, 1, 0),
                                   V3d(0, 1, 0), V3d(2, 0, 0), V3d(2, 1, 0)};
  const std::vector<V3d> normals(6, V3d(0, 0, 1));
  const std::vector<V2d> uvs{V2d(0, 1), V2d(1, 1), V2d(1, 0), V2d(0, 0), V2d(0, 1), V2d(0, 0)};
  const std::vector<std::uint32_t> indices{0, 1, 2, 0, 2, 3, 1, 4, 5, 1, 5, 2};
  const Tangents tangents = compute_tangents(positions, normals, uvs, indices, Facing::winding);
  CHECK(tangents.copy_of == std::vector<std::uint32_t>{1, 2});
  for (std::size_t i = 0; i < 6; ++i) {
    CHECK(tangents.tangents[tangents.indices[i]] == V4f(1, 0, 0, 1));
    CHECK(tangents.tangents[tangents.indices[i + 6]] == V4f(-1, 0, 0, -1));
  }
}

TEST_CASE("tangents: triangles without area in UV say nothing") {
  const std::vector<V3d> positions{V3d(0, 0, 0), V3d(1, 0, 0), V3d(0, 1, 0)};
  const std::vector<V3d> normals(3, V3d(1, 0, 0));
  const std::vector<V2d> uvs(3, V2d(0.5, 0.5));
  const std::vector<std::uint32_t> indices{0, 1, 2};
  const Tangents tangents = compute_tangents(positions, normals, uvs, indices, Facing::winding);
  for (const V4f& t : tangents.tangents) CHECK(t == V4f(0, 0, 0, 1));
  CHECK(any_perpendicular(normals[0]).dot(normals[0]) == 0);
  CHECK(any_perpendicular(normals[0]).length() == doctest::Approx(1));
}

TEST_CASE("tangents: corners that only meet in a vertex have tangents of their own") {
  // Two triangles of one vertex, their pictures turned against each other.
  const std::vector<V3d> positions{V3d(0, 0, 0), V3d(1, 0, 0), V3d(0, 1, 0), V3d(-1, 0, 0), V3d(0, -1, 0)};
  const std::vector<V3d> normals(5, V3d(0, 0, 1));
  const std::vector<V2d> uvs{V2d(0, 0), V2d(1, 0), V2d(0, -1), V2d(0, 1), V2d(1, 0)};
  const std::vector<std::uint32_t> indices{0, 1, 2, 0, 3, 4};
  const Tangents tangents = compute_tangents(positions, normals, uvs, indices, Facing::winding);
  CHECK(tangents.copy_of == std::vector<std::uint32_t>{0});
  CHECK((tangents.tangents[tangents.indices[0]] - V4f(1, 0, 0, 1)).length() < 1e-6F);
  CHECK((tangents.tangents[tangents.indices[3]] - V4f(0, -1, 0, 1)).length() < 1e-6F);
}

TEST_CASE("tangents: triangles that run against their normals are mirrored by them only") {
  const std::vector<V3d> positions{V3d(0, 0, 0), V3d(1, 1, 0), V3d(1, 0, 0)};
  const std::vector<V3d> normals(3, V3d(0, 0, 1));
  const std::vector<V2d> uvs{V2d(0, 1), V2d(1, 0), V2d(1, 1)};
  const std::vector<std::uint32_t> indices{0, 1, 2};
  CHECK(compute_tangents(positions, normals, uvs, indices, Facing::winding).tangents[0] == V4f(1, 0, 0, -1));
  CHECK(compute_tangents(positions, normals, uvs, indices, Facing::normals).tangents[0] == V4f(1, 0, 0, 1));
}

TEST_CASE("tangents: duplicated vertices take every attribute and morph target along") {
  const Folder folder;
  Garment garment;
  garment.materials = {GarmentMaterial{.name = "cloth"}};
  GarmentPrimitive primitive;
  primitive.positions = {V3f(0, 0, 0), V3f(1, 0, 0), V3f(1, 1, 0), V3f(0, 1, 0), V3f(2, 0, 0), V3f(2, 1, 0)};
  primitive.normals.assign(6, V3f(0, 0, 1));
  primitive.tex_coords = {V2f(0, 1), V2f(1, 1), V2f(1, 0), V2f(0, 0), V2f(0, 1), V2f(0, 0)};
  primitive.indices = {0, 1, 2, 0, 2, 3, 1, 4, 5, 1, 5, 2};
  garment.primitives = {primitive};
  REQUIRE(write_garment(folder / "a.glb", garment));
  GltfDocument document = test::need(load_gltf(folder / "a.glb"));
  std::vector<float> moves;
  for (int i = 0; i < 18; ++i) moves.push_back(static_cast<float>(i));
  const std::vector<std::uint8_t> joints{0, 1, 2, 3, 4, 5};  // as a SCALAR of bytes, padded to 4 in the file
  AccessorShape shape{6, 1, 5121, false};
  const int view = append_attribute_view(document, shape, joints);
  document.json["accessors"].push_back(
      Json{{"bufferView", view}, {"componentType", 5121}, {"count", 6}, {"type", "SCALAR"}});
  document.json["meshes"][0]["primitives"][0]["attributes"]["_ID"] = document.json["accessors"].size() - 1;
  const int target = append_float_accessor(document, moves, 3, true);
  document.json["meshes"][0]["primitives"][0]["targets"] = Json::array({Json{{"POSITION", target}}});

  const bool added = add_tangents(document, 0, 0, 0);
  CHECK(added);
  CHECK_FALSE(add_tangents(document, 0, 0, 0));
  const Json& json = document.json["meshes"][0]["primitives"][0];
  for (const auto& [semantic, accessor] : json["attributes"].items()) {
    const std::string named = semantic;  // Clang 14 captures no bindings.
    CAPTURE(named);
    CHECK(document.json["accessors"][accessor.get<std::size_t>()]["count"] == 8);
  }
  GltfReader reader(document);
  const auto moved = reader.numbers(index_of(json["targets"][0]["POSITION"]), "");
  const auto ids = reader.numbers(index_of(json["attributes"]["_ID"]), "");
  CHECK(moved[18] == 3);  // the copy of vertex 1
  CHECK(moved[21] == 6);  // and of vertex 2
  CHECK(ids[6] == 1);
  CHECK(ids[7] == 2);
  CHECK(read_scene(document)->primitives[0].tangents.size() == 8);
}

TEST_CASE("tangents: an accessor that many morph targets name is copied once") {
  const Folder folder;
  Garment garment = test::square();
  REQUIRE(write_garment(folder / "square.glb", garment));
  GltfDocument document = test::need(load_gltf(folder / "square.glb"));
  Json& primitive = document.json["meshes"][0]["primitives"][0];
  primitive["attributes"].erase("NORMAL");  // flat normals need vertices of their own
  const Json target{{"POSITION", primitive["attributes"]["POSITION"]}};
  primitive["targets"] = Json::array();
  for (int i = 0; i < 1000; ++i) primitive["targets"].push_back(target);
  const std::size_t accessors = document.json["accessors"].size();
  CHECK(add_tangents(document, 0, 0, 0));
  // Positions, texture coordinates, indices, normals and tangents.
  CHECK(document.json["accessors"].size() == accessors + 5);
  CHECK(document.json["meshes"][0]["primitives"][0]["targets"][999]["POSITION"] ==
        document.json["meshes"][0]["primitives"][0]["attributes"]["POSITION"]);
}
