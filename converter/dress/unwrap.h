// Texture coordinates for garments that have none.
#pragma once

#include <cstdint>
#include <set>
#include <vector>

#include "converter/dress/uv_scale.h"
#include "format/base/vec.h"
#include "format/gltf/access.h"
#include "format/gltf/materials.h"

namespace selvedge {

struct UnwrapReport {
  int chart_count = 0;
  bool had_uvs = false;  ///< there were texture coordinates before
};

/// Gives the places of a material texture coordinates in metres, in place of the set's old ones: charts
/// (cut_into_charts()) of each primitive, below each other. Vertices at seams become several; normals and
/// tangents that are not unit and joints without weight are mended, so that no fault is there twice. Tangents
/// follow the set if a normal texture is on it; without a normal texture they are dropped. Skins and morph
/// targets are kept: what is laid flat is the mesh without them, in the size that `in_scene`, of the same
/// document, has for it. A primitive without an area gets zeros where it has none. GARMENT_EMPTY without a
/// triangle that has an area, GARMENT_NO_UVS for a set above one that is missing, both of a document that is
/// as it was.
Result<UnwrapReport> unwrap(GltfDocument& document, const std::set<PrimitiveIndex>& places, int tex_coord,
                            const PrimitivesInScene& in_scene);

/// Gives every accessor of a primitive's attributes and morph targets new elements: element i is element
/// sources[i] of the old one; those that name one accessor share the new one too. The indices are left to the
/// caller. Throws Failure.
void gather_vertices(GltfDocument& document, GltfReader& reader, Json& primitive,
                     const std::vector<std::uint32_t>& sources, const std::string& place);

struct Charts {
  int count = 0;
  std::vector<std::uint32_t> source_vertices;  ///< for each new vertex, the vertex of the surface
  std::vector<V2d> uvs;  ///< for each new vertex: metres, v grows downwards, no two charts overlap
  std::vector<std::uint32_t>
      indices;  ///< new vertices, three a triangle; triangles without area are left out
};

/// Charts are parts whose normals, smoothed over some rounds of neighbours, lie nearest to the same half
/// axis: front, back, sides, top, bottom. A part of less than a hundredth of what it hangs together with
/// joins the neighbour with the longest common edge. Each is laid flat as rigidly as possible (flatten.h), or
/// projected along its mean normal where that turns a triangle over or where it has very many holes and
/// handles, and turned so that `down` is v. Charts stand in rows at v >= `top`, which moves below them.
/// Vertices nearer to each other than 0.3 % of a triangle's size count as one. A triangle that
/// faces its neighbours' other way is laid as they are; those that would make the surface no two-manifold (a
/// third one at an edge, a twin) hang together among themselves. `positions`: metres; `triangles`: three
/// vertices each, counter-clockwise seen from outside.
Charts cut_into_charts(const std::vector<V3d>& positions, const std::vector<std::uint32_t>& triangles,
                       const V3d& down, double& top);

}  // namespace selvedge
