#include "format/scene/tangents.h"

#include <doctest/doctest.h>

using namespace selvedge;

TEST_CASE("tangents: an upright picture has its tangent along growing u and w = +1") {
  const std::vector<V3d> positions{V3d(0, 0, 0), V3d(1, 0, 0), V3d(1, 1, 0), V3d(0, 1, 0)};
  const std::vector<V3d> normals(4, V3d(0, 0, 1));
  const std::vector<V2d> uvs{V2d(0, 1), V2d(1, 1), V2d(1, 0), V2d(0, 0)};
  const std::vector<std::uint32_t> indices{0, 1, 2, 0, 2, 3};
  const Tangents tangents = compute_tangents(positions, normals, uvs, indices, Facing::winding);
  REQUIRE(tangents.tangents.size() == 4);
  // The bitangent cross(n, t) * w is +y: up in the picture, where v falls.
  for (const V4f& t : tangents.tangents) CHECK(t == V4f(1, 0, 0, 1));
  CHECK(tangents.copy_sources.empty());
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
  CHECK(tangents.copy_sources == std::vector<std::uint32_t>{1, 2});
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
}

TEST_CASE("tangents: corners that only meet in a vertex have tangents of their own") {
  // Two triangles of one vertex, their pictures turned against each other.
  const std::vector<V3d> positions{V3d(0, 0, 0), V3d(1, 0, 0), V3d(0, 1, 0), V3d(-1, 0, 0), V3d(0, -1, 0)};
  const std::vector<V3d> normals(5, V3d(0, 0, 1));
  const std::vector<V2d> uvs{V2d(0, 0), V2d(1, 0), V2d(0, -1), V2d(0, 1), V2d(1, 0)};
  const std::vector<std::uint32_t> indices{0, 1, 2, 0, 3, 4};
  const Tangents tangents = compute_tangents(positions, normals, uvs, indices, Facing::winding);
  CHECK(tangents.copy_sources == std::vector<std::uint32_t>{0});
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
