#include "viewer/geometry.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace selvedge {
namespace {

V3d transform_point(const V3f& p, const M44d& m) {
  V3d result;
  m.multVecMatrix(V3d(p), result);
  return result;
}

bool finite(const V3d& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

const SceneMaterial* material_of(const Scene& scene, int material) {
  const bool exists = material >= 0 && static_cast<std::size_t>(material) < scene.materials.size();
  return exists ? &scene.materials[static_cast<std::size_t>(material)] : nullptr;
}

/// Which texture coordinates a primitive is drawn with, and how they are transformed.
struct Mapping {
  const std::vector<V2d>* tex_coords = nullptr;
  UvTransform transform;
  bool fabric = false;
};

Result<Mapping> mapping_of(const Scene& scene, const ScenePrimitive& primitive) {
  Mapping mapping;
  const SceneMaterial* material = material_of(scene, primitive.material);
  if (material == nullptr) return mapping;
  mapping.fabric = material->fabric.has_value();
  if (!mapping.fabric && material->base_color_texture.image < 0) return mapping;
  const int set = mapping.fabric ? material->fabric->tex_coord : material->base_color_texture.tex_coord;
  mapping.transform = mapping.fabric ? material->fabric->transform : material->base_color_texture.transform;
  if (set >= 0 && set < 2) mapping.tex_coords = &primitive.tex_coords[static_cast<std::size_t>(set)];
  if (mapping.tex_coords != nullptr && mapping.tex_coords->empty()) mapping.tex_coords = nullptr;
  if (mapping.fabric && mapping.tex_coords == nullptr) {
    return fail(Code::garment_no_uvs, scene.file, primitive.name,
                fmt::format("material \"{}\" has a fabric but there is no TEXCOORD_{}", material->name, set));
  }
  return mapping;
}

Result<void> check(const Scene& scene, const ScenePrimitive& primitive, const Mapping& mapping) {
  const std::size_t count = primitive.positions.size();
  const auto refuse = [&](Code code, const char* reason) -> Result<void> {
    return fail(code, scene.file, primitive.name, reason);
  };
  if (primitive.normals.size() != count)
    return refuse(Code::mesh_invalid, "there is not one normal per vertex");
  if (primitive.indices.size() % 3 != 0) return refuse(Code::mesh_invalid, "indices do not come in threes");
  for (const std::uint32_t index : primitive.indices) {
    if (index >= count) return refuse(Code::mesh_invalid, "an index is beyond the vertices");
  }
  if (mapping.tex_coords != nullptr) {
    if (mapping.tex_coords->size() != count)
      return refuse(Code::mesh_invalid, "there is not one texture coordinate per vertex");
    for (const V2d& uv : *mapping.tex_coords) {
      const V2d moved = mapping.transform.apply(uv);
      if (!std::isfinite(moved.x) || !std::isfinite(moved.y))
        return refuse(Code::mesh_not_finite, "a texture coordinate is not finite");
    }
  }
  return {};
}

/// Positions in the world and texture coordinates in double, before anything is rounded.
struct Placed {
  std::vector<V3d> position;
  std::vector<V3d> normal;
  std::vector<V2d> uv;
  std::vector<std::uint32_t> indices;
};

Result<Placed> place(const Scene& scene, const SceneInstance& instance, const Mapping& mapping,
                     const V3d& origin) {
  const ScenePrimitive& primitive = scene.primitives[static_cast<std::size_t>(instance.primitive)];
  Placed placed;
  placed.position.reserve(primitive.positions.size());
  for (const V3f& p : primitive.positions) {
    placed.position.push_back(transform_point(p, instance.world) - origin);
    if (!finite(placed.position.back()))
      return fail(Code::mesh_not_finite, scene.file, primitive.name, "a position is not finite");
  }
  // Rows of the cofactor matrix: the inverse transpose up to a factor, and defined for flat scales, too.
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
  placed.uv.assign(primitive.positions.size(), V2d(0, 0));
  if (mapping.tex_coords != nullptr) {
    std::transform(mapping.tex_coords->begin(), mapping.tex_coords->end(), placed.uv.begin(),
                   [&](const V2d& uv) { return mapping.transform.apply(uv); });
    V2d base = placed.uv.empty() ? V2d(0, 0) : placed.uv.front();
    for (const V2d& uv : placed.uv) base = V2d(std::min(base.x, uv.x), std::min(base.y, uv.y));
    base = V2d(std::floor(base.x), std::floor(base.y));
    for (V2d& uv : placed.uv) uv -= base;
  }
  placed.indices = primitive.indices;
  // A mirroring turns the triangles' winding around (glTF 2.0, section 3.7.4).
  if (mirrored) {
    for (std::size_t i = 0; i + 2 < placed.indices.size(); i += 3)
      std::swap(placed.indices[i + 1], placed.indices[i + 2]);
  }
  return placed;
}

/// The direction of dP/du over a triangle, and whether the texture is upright (+1) or mirrored (-1) on it.
struct TriangleTangent {
  V3d direction{0, 0, 0};
  float handedness = 1;
};

TriangleTangent tangent_of(const Placed& mesh, const std::uint32_t* corner) {
  TriangleTangent result;
  const V3d e1 = mesh.position[corner[1]] - mesh.position[corner[0]];
  const V3d e2 = mesh.position[corner[2]] - mesh.position[corner[0]];
  const V2d d1 = mesh.uv[corner[1]] - mesh.uv[corner[0]];
  const V2d d2 = mesh.uv[corner[2]] - mesh.uv[corner[0]];
  const double determinant = d1.x * d2.y - d2.x * d1.y;
  if (!std::isfinite(determinant) || determinant == 0) return result;
  const V3d normal = mesh.normal[corner[0]] + mesh.normal[corner[1]] + mesh.normal[corner[2]];
  // dP/du x dP/dv = (e1 x e2) / determinant; v grows downwards in an upright picture, hence the sign.
  const double side = e1.cross(e2).dot(normal) * (determinant < 0 ? -1 : 1);
  if (side > 0) result.handedness = -1;
  const V3d along_u = (e1 * d2.y - e2 * d1.y) * (determinant < 0 ? -1 : 1);
  const double length = along_u.length();
  if (std::isfinite(length) && length > 0) result.direction = along_u / length;
  return result;
}

double angle_at(const Placed& mesh, const std::uint32_t* corner, std::size_t k) {
  const V3d& p = mesh.position[corner[k]];
  const V3d a = mesh.position[corner[(k + 1) % 3]] - p;
  const V3d b = mesh.position[corner[(k + 2) % 3]] - p;
  const double angle = std::atan2(a.cross(b).length(), a.dot(b));
  return std::isfinite(angle) ? angle : 0;
}

Surface finish(const Placed& mesh, int material, bool with_tangents) {
  Surface surface;
  surface.material = material;
  surface.indices = mesh.indices;
  std::vector<V3d> tangents;
  const auto add_vertex = [&](std::uint32_t source, float handedness) {
    surface.vertices.push_back({V3f(mesh.position[source]), V3f(mesh.normal[source]),
                                V4f(0, 0, 0, handedness), V2f(mesh.uv[source])});
    tangents.emplace_back(0, 0, 0);
    return static_cast<std::uint32_t>(surface.vertices.size() - 1);
  };
  if (!with_tangents) {
    for (std::uint32_t i = 0; i < mesh.position.size(); ++i) add_vertex(i, 1);
    return surface;
  }
  constexpr std::uint32_t none = 0xffffffffU;
  std::vector<std::array<std::uint32_t, 2>> copies(mesh.position.size(), {none, none});
  std::vector<std::uint32_t> sources;
  for (std::size_t i = 0; i + 2 < mesh.indices.size(); i += 3) {
    const std::uint32_t* corner = &mesh.indices[i];
    const TriangleTangent tangent = tangent_of(mesh, corner);
    for (std::size_t k = 0; k < 3; ++k) {
      std::uint32_t& copy = copies[corner[k]][tangent.handedness > 0 ? 0 : 1];
      if (copy == none) {
        copy = add_vertex(corner[k], tangent.handedness);
        sources.push_back(corner[k]);
      }
      surface.indices[i + k] = copy;
      tangents[copy] += tangent.direction * angle_at(mesh, corner, k);
    }
  }
  for (std::size_t i = 0; i < surface.vertices.size(); ++i) {
    const V3d& n = mesh.normal[sources[i]];
    const V3d in_plane = tangents[i] - n * n.dot(tangents[i]);
    const double length = in_plane.length();
    // Triangles that run against each other leave nothing but rounding: no direction then.
    if (length <= 1e-9) continue;
    const V3f t(in_plane / length);
    surface.vertices[i].tangent = V4f(t.x, t.y, t.z, surface.vertices[i].tangent.w);
  }
  return surface;
}

}  // namespace

Result<std::vector<V3d>> world_points(const Scene& scene) {
  std::vector<V3d> points;
  for (const SceneInstance& instance : scene.instances) {
    const ScenePrimitive& primitive = scene.primitives[static_cast<std::size_t>(instance.primitive)];
    std::vector<bool> used(primitive.positions.size(), false);
    for (const std::uint32_t index : primitive.indices) {
      if (index >= primitive.positions.size())
        return fail(Code::mesh_invalid, scene.file, primitive.name, "an index is beyond the vertices");
      used[index] = true;
    }
    for (std::size_t i = 0; i < used.size(); ++i) {
      if (!used[i]) continue;
      points.push_back(transform_point(primitive.positions[i], instance.world));
      if (!finite(points.back()))
        return fail(Code::mesh_not_finite, scene.file, primitive.name, "a position is not finite");
    }
  }
  if (points.empty()) return fail(Code::garment_empty, scene.file, "", "there is nothing to draw");
  return points;
}

Result<std::vector<Surface>> build_surfaces(const Scene& scene, const V3d& origin) {
  std::vector<Surface> surfaces;
  for (const SceneInstance& instance : scene.instances) {
    const ScenePrimitive& primitive = scene.primitives[static_cast<std::size_t>(instance.primitive)];
    if (primitive.indices.empty()) continue;
    const Result<Mapping> mapping = mapping_of(scene, primitive);
    if (!mapping) return tl::unexpected(mapping.error());
    if (const auto good = check(scene, primitive, *mapping); !good) return tl::unexpected(good.error());
    const Result<Placed> placed = place(scene, instance, *mapping, origin);
    if (!placed) return tl::unexpected(placed.error());
    surfaces.push_back(finish(*placed, primitive.material, mapping->fabric));
  }
  return surfaces;
}

}  // namespace selvedge
