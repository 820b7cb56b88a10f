#include "viewer/scene/surfaces.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "format/base/disjoint_sets.h"
#include "format/base/guard.h"
#include "format/scene/tangents.h"

namespace selvedge {
namespace {

constexpr double farthest_uv = 1e15;

bool finite(const V3d& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

const std::vector<V2d>* coordinates_of(const ScenePrimitive& primitive, int set) {
  if (set < 0 || set > 1) return nullptr;
  const std::vector<V2d>& coordinates = primitive.tex_coords[set];
  return coordinates.empty() ? nullptr : &coordinates;
}

/// Throws GARMENT_NO_UVS for a primitive without the texture coordinates of its fabric.
void check(const Scene& scene, const ScenePrimitive& primitive, const SceneMaterial& material) {
  if (!material.fabric || coordinates_of(primitive, material.fabric->tex_coord) != nullptr) return;
  throw Failure{{Code::garment_no_uvs, scene.file, primitive.name,
                 fmt::format("material \"{}\" has a fabric but there is no TEXCOORD_{}", material.name,
                             material.fabric->tex_coord)}};
}

/// The charts of a primitive: for every vertex, a representative vertex of its chart.
std::vector<int> charts_of(const std::vector<std::uint32_t>& indices, std::size_t vertices) {
  DisjointSets sets(vertices);
  for (std::size_t i = 0; i + 2 < indices.size(); i += 3)
    for (std::size_t k = 1; k < 3; ++k)
      sets.unite(static_cast<int>(indices[i]), static_cast<int>(indices[i + k]));
  std::vector<int> charts;
  for (int v = 0; v < static_cast<int>(vertices); ++v) charts.push_back(sets.root(v));
  return charts;
}

/// The period of a wrapped picture, by which a chart may be moved; 0: not at all.
double period_of(Wrap wrap) { return wrap == Wrap::repeat ? 1 : wrap == Wrap::mirror ? 2 : 0; }

/// The coordinates of a mapping, each chart brought near zero; empty if the primitive has none. Throws
/// MESH_NOT_FINITE.
std::vector<V2d> map(const Scene& scene, const ScenePrimitive& primitive, const Mapping& mapping,
                     const std::vector<int>& charts) {
  std::vector<V2d> uvs;
  const std::vector<V2d>* coordinates = coordinates_of(primitive, mapping.tex_coord);
  if (coordinates == nullptr) return uvs;
  uvs.reserve(coordinates->size());
  for (const V2d& uv : *coordinates) {
    const V2d at = mapping.transform.apply(uv);
    if (!std::isfinite(at.x) || !std::isfinite(at.y))
      throw Failure{
          {Code::mesh_not_finite, scene.file, primitive.name, "a texture coordinate is not finite"}};
    // Floats stay finite.
    uvs.emplace_back(std::clamp(at.x, -farthest_uv, farthest_uv),
                     std::clamp(at.y, -farthest_uv, farthest_uv));
  }
  const V2d period(period_of(mapping.wrap_u), period_of(mapping.wrap_v));
  std::vector<V2d> low(uvs.size(), V2d(HUGE_VAL, HUGE_VAL));
  for (std::size_t v = 0; v < uvs.size(); ++v) {
    V2d& chart_low = low[charts[v]];
    chart_low = V2d(std::min(chart_low.x, uvs[v].x), std::min(chart_low.y, uvs[v].y));
  }
  for (std::size_t v = 0; v < uvs.size(); ++v)
    for (int c = 0; c < 2; ++c)
      if (period[c] > 0) uvs[v][c] -= std::floor(low[charts[v]][c] / period[c]) * period[c];
  return uvs;
}

/// An instance in world space, in double precision.
struct Placed {
  std::vector<V3d> position;
  std::vector<V3d> normal;
  std::vector<V4f> tangent;  ///< from the file, if it has tangents
  std::vector<std::uint32_t> indices;
};

/// Throws MESH_NOT_FINITE.
Placed place(const Scene& scene, const SceneInstance& instance, const V3d& origin) {
  const ScenePrimitive& primitive = scene.primitives[instance.primitive];
  Placed placed;
  placed.position.reserve(primitive.positions.size());
  for (const V3f& p : primitive.positions) {
    placed.position.push_back(V3d(p) * instance.world - origin);
    if (!finite(placed.position.back()))
      throw Failure{{Code::mesh_not_finite, scene.file, primitive.name, "a position is not finite"}};
  }
  // Rows of the cofactor matrix: the inverse transpose up to a factor, but defined for flat scales, too.
  const M44d& m = instance.world;
  const V3d x(m[0][0], m[0][1], m[0][2]);
  const V3d y(m[1][0], m[1][1], m[1][2]);
  const V3d z(m[2][0], m[2][1], m[2][2]);
  const bool mirrored = x.dot(y.cross(z)) < 0;
  const double sign = mirrored ? -1 : 1;
  const V3d normal_x = y.cross(z) * sign;
  const V3d normal_y = z.cross(x) * sign;
  const V3d normal_z = x.cross(y) * sign;
  for (const V3f& n : primitive.normals) {
    const V3d moved = normal_x * n.x + normal_y * n.y + normal_z * n.z;
    const double length = moved.length();
    placed.normal.push_back(std::isfinite(length) && length > 0 ? moved / length : V3d(0, 0, 0));
  }
  for (const V4f& t : primitive.tangents) {
    const V3d moved = x * t.x + y * t.y + z * t.z;
    const double length = moved.length();
    const V3f unit(std::isfinite(length) && length > 0 ? moved / length : V3d(0, 0, 0));
    placed.tangent.emplace_back(unit.x, unit.y, unit.z, static_cast<float>(t.w * sign));
  }
  placed.indices = primitive.indices;
  // Mirroring reverses the winding of triangles (glTF 2.0, section 3.7.4).
  if (mirrored)
    for (std::size_t i = 0; i + 2 < placed.indices.size(); i += 3)
      std::swap(placed.indices[i + 1], placed.indices[i + 2]);
  return placed;
}

/// The vertex of the file that a vertex is, or is a copy of.
std::size_t source_of(std::size_t vertex, std::size_t given, const Tangents& tangents) {
  return vertex < given ? vertex : tangents.copy_sources[vertex - given];
}

/// Mappings::normal_frame of vertices with the tangents of a fabric. Where the normal texture is mirrored on
/// one side of a vertex alone, `tangents` gets one more copy of it.
std::array<std::vector<V2f>, 2> turn_normals(const Placed& placed, const std::vector<V2d>& uvs,
                                             Tangents& tangents) {
  std::array<std::vector<V2f>, 2> directions;
  if (uvs.empty()) return directions;
  const std::size_t given = placed.position.size();
  const std::size_t count = tangents.tangents.size();
  std::vector<V3d> position;
  std::vector<V3d> normal;
  std::vector<V2d> uv;
  for (std::size_t v = 0; v < count; ++v) {
    const std::size_t source = source_of(v, given, tangents);
    position.push_back(placed.position[source]);
    normal.push_back(placed.normal[source]);
    uv.push_back(uvs[source]);
  }
  Tangents of_texture = compute_tangents(position, normal, uv, tangents.indices, Facing::normals);
  tangents.indices = std::move(of_texture.indices);
  for (const std::uint32_t v : of_texture.copy_sources) {
    tangents.copy_sources.push_back(static_cast<std::uint32_t>(source_of(v, given, tangents)));
    tangents.tangents.push_back(V4f(tangents.tangents[v]));
    normal.push_back(V3d(normal[v]));
  }
  for (std::size_t v = 0; v < tangents.tangents.size(); ++v) {
    const auto axes = [&](const V4f& t) {
      const V3d x(t.x, t.y, t.z);
      return std::pair(x, normal[v].cross(x) * static_cast<double>(t.w));
    };
    const auto [x, y] = axes(tangents.tangents[v]);
    const auto [along, up] = axes(of_texture.tangents[v]);
    directions[0].emplace_back(V2d(along.dot(x), along.dot(y)));
    directions[1].emplace_back(V2d(up.dot(x), up.dot(y)));
  }
  return directions;
}

Surface finish(const ScenePrimitive& primitive, const SceneMaterial& material, const Mappings& mappings,
               const Placed& placed, const std::vector<std::vector<V2d>>& uvs) {
  Tangents tangents;
  tangents.indices = placed.indices;
  // Tangents follow the fabric's coordinates, or the normal texture's if the file has no tangents.
  int followed = material.fabric ? 0 : -1;
  if (!material.fabric && material.normal_texture.image >= 0 && placed.tangent.empty())
    followed = mappings.index_of(mapping_of(material.normal_texture));
  if (followed >= 0 && !uvs[followed].empty()) {
    // A fabric counts as upright or mirrored seen from the normals; a normal texture as in MikkTSpace.
    const Facing facing = material.fabric ? Facing::normals : Facing::winding;
    tangents = compute_tangents(placed.position, placed.normal, uvs[followed], placed.indices, facing);
  } else if (!material.fabric) {
    tangents.tangents = placed.tangent;
  }
  tangents.tangents.resize(placed.position.size() + tangents.copy_sources.size(), V4f(0, 0, 0, 1));

  Surface surface;
  surface.material = primitive.material;
  std::array<std::vector<V2f>, 2> directions;
  if (mappings.normal_frame > 0) {
    const int mapping = mappings.index_of(mapping_of(material.garment_textures.normal));
    directions = turn_normals(placed, uvs[mapping], tangents);
  }
  surface.indices = std::move(tangents.indices);
  surface.degenerate_uvs = std::move(tangents.degenerate_uvs);
  surface.vertices.reserve(tangents.tangents.size());
  surface.extra_uvs.resize(uvs.empty() ? 0 : uvs.size() - 1);
  if (mappings.normal_frame > 0)
    surface.extra_uvs.insert(surface.extra_uvs.end(), directions.begin(), directions.end());
  for (std::size_t v = 0; v < tangents.tangents.size(); ++v) {
    const std::size_t source = source_of(v, placed.position.size(), tangents);
    const V2f uv = uvs.empty() || uvs[0].empty() ? V2f(0, 0) : V2f(uvs[0][source]);
    V2f whole(0, 0);
    if (material.fabric && !uvs[0].empty()) {
      const Mapping& mapping = mappings.list[0];
      const V2d moved =
          mapping.transform.apply((*coordinates_of(primitive, mapping.tex_coord))[source]) - uvs[0][source];
      whole = {static_cast<float>(std::round(moved.x)), static_cast<float>(std::round(moved.y))};
    }
    surface.vertices.push_back(
        {V3f(placed.position[source]), V3f(placed.normal[source]), tangents.tangents[v], uv, whole});
    for (std::size_t m = 1; m < uvs.size(); ++m)
      if (!uvs[m].empty()) surface.extra_uvs[m - 1].emplace_back(uvs[m][source]);
    if (!primitive.colors.empty()) surface.colors.push_back(primitive.colors[source]);
  }
  return surface;
}

}  // namespace

Mapping mapping_of(const TextureReference& texture) {
  return {texture.tex_coord, texture.transform, texture.wrap_u, texture.wrap_v};
}

int Mappings::index_of(const Mapping& mapping) const {
  const auto found = std::ranges::find(list, mapping);
  return found == list.end() ? -1 : static_cast<int>(found - list.begin());
}

Mappings mappings_of(const SceneMaterial& material) {
  Mappings mappings;
  const auto add = [&](const Mapping& mapping) {
    if (mappings.index_of(mapping) < 0) mappings.list.push_back(mapping);
  };
  const auto add_texture = [&](const TextureReference& texture) {
    if (texture.image >= 0) add(mapping_of(texture));
  };
  if (material.fabric) {
    const FabricReference& fabric = *material.fabric;
    const TextureReference& normal = material.garment_textures.normal;
    add({fabric.tex_coord, fabric.transform, Wrap::repeat, Wrap::repeat});
    add_texture(material.garment_textures.tint_texture);
    add_texture(material.garment_textures.mask);
    add_texture(normal);
    const V2d signs = fabric.transform.scale * normal.transform.scale;
    const bool same_axes = fabric.tex_coord == normal.tex_coord && fabric.transform.rotation == 0 &&
                           normal.transform.rotation == 0 && signs.x > 0 && signs.y > 0;
    if (normal.image >= 0 && !same_axes) mappings.normal_frame = 1;  // its number follows
  } else {
    add_texture(material.base_color_texture);
    add_texture(material.metallic_roughness_texture);
    add_texture(material.normal_texture);
  }
  add_texture(material.occlusion_texture);  // occlusion and emission apply to fabrics, too
  add_texture(material.emissive_texture);
  if (mappings.normal_frame > 0) mappings.normal_frame = static_cast<int>(mappings.list.size());
  return mappings;
}

Result<std::vector<Surface>> build_surfaces(const Scene& scene, const V3d& origin) {
  return catch_failure([&] {
    std::vector<Surface> surfaces;
    for (const SceneInstance& instance : scene.instances) {
      const ScenePrimitive& primitive = scene.primitives[instance.primitive];
      if (primitive.indices.empty()) continue;
      const SceneMaterial material =
          primitive.material >= 0 ? scene.materials[primitive.material] : SceneMaterial{};
      check(scene, primitive, material);
      const Placed placed = place(scene, instance, origin);
      const std::vector<int> charts = charts_of(primitive.indices, primitive.positions.size());
      const Mappings mappings = mappings_of(material);
      std::vector<std::vector<V2d>> uvs;
      for (const Mapping& mapping : mappings.list) uvs.push_back(map(scene, primitive, mapping, charts));
      surfaces.push_back(finish(primitive, material, mappings, placed, uvs));
    }
    return surfaces;
  });
}

}  // namespace selvedge
