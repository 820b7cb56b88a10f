#include "converter/export/surface.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <tuple>

#include "format/base/disjoint_sets.h"
#include "format/fabric/variation.h"

namespace selvedge {
namespace {

double cross(const V2d& a, const V2d& b) { return a.x * b.y - a.y * b.x; }

/// How far the nearest of these points lies outside of a triangle, beyond the edge that parts them most, in
/// repeats; negative inside.
template <std::size_t N>
double distance_from(const Cloth::Triangle& t, const std::array<V2d, N>& points) {
  double farthest = -std::numeric_limits<double>::infinity();
  for (int i = 0; i < 3; ++i) {
    const V2d from = t.corners[i].uv, edge = t.corners[(i + 1) % 3].uv - from;
    double nearest = std::numeric_limits<double>::infinity();
    for (const V2d& point : points)
      nearest = std::min(nearest, (t.is_mirrored ? -1 : 1) * cross(edge, point - from) / edge.length());
    farthest = std::max(farthest, nearest);
  }
  return farthest;
}

}  // namespace

void Cloth::add_triangle(const std::array<Corner, 3>& corners) {
  const auto& [a, b, c] = corners;
  const V3d face = (b.position - a.position).cross(c.position - a.position);
  const double covered = cross(b.uv - a.uv, c.uv - a.uv);
  if (!(face.length() > 0) || !std::isfinite(face.length()) || !(std::abs(covered) > 0) ||
      !std::isfinite(covered))
    return;
  triangles.push_back({corners, 0, covered > 0});
  for (Corner& corner : triangles.back().corners)
    corner.normal = corner.normal.length() > 0 ? corner.normal.normalized() : face.normalized();
  area += face.length() / 2;
  uv_area += std::abs(covered) / 2;
}

void Cloth::assign_patches() {
  std::map<std::tuple<bool, double, double, double, double, double>, int> places;
  DisjointSets patches(0);
  for (Triangle& t : triangles) {
    t.patch_index = -1;
    for (const Corner& corner : t.corners) {
      const auto [place, fresh] = places.try_emplace(
          {t.is_mirrored, corner.position.x, corner.position.y, corner.position.z, corner.uv.x, corner.uv.y});
      if (fresh) place->second = patches.add();
      const int own = patches.root(place->second);
      if (t.patch_index >= 0) patches.unite(std::max(own, t.patch_index), std::min(own, t.patch_index));
      t.patch_index = t.patch_index < 0 ? own : std::min(own, t.patch_index);
    }
  }
  for (Triangle& t : triangles) t.patch_index = patches.root(t.patch_index);
}

Cloth cloth_of(const Scene& scene, int material, const V2d& cells) {
  const FabricReference& fabric = *scene.materials[material].fabric;
  Cloth cloth;
  for (const SceneInstance& instance : scene.instances) {
    const ScenePrimitive& primitive = scene.primitives[instance.primitive];
    const std::vector<V2d>& uvs = primitive.tex_coords[fabric.tex_coord];
    if (primitive.material != material || uvs.empty()) continue;
    const bool turned = instance.world.determinant() < 0;
    M44d normals = instance.world;
    normals[3][0] = normals[3][1] = normals[3][2] = 0;
    normals = normals.inverse().transposed();
    for (std::size_t i = 0; i + 2 < primitive.indices.size(); i += 3) {
      std::array<Cloth::Corner, 3> corners;
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t vertex = primitive.indices[i + (turned ? 2 - k : k)];
        corners[k] = {fabric.transform.apply(uvs[vertex]) * cells,
                      V3d(primitive.positions[vertex]) * instance.world,
                      V3d(primitive.normals[vertex]) * normals};
      }
      cloth.add_triangle(corners);
    }
  }
  cloth.assign_patches();
  return cloth;
}

std::optional<std::vector<ClothCell>> cells_of(const Cloth& cloth, const Imath::Box2d& reach, double limit) {
  std::map<std::tuple<int, int, int>, std::vector<int>> cells;
  for (int t = 0; t < static_cast<int>(cloth.triangles.size()); ++t) {
    Imath::Box2d box;
    for (const Cloth::Corner& corner : cloth.triangles[t].corners) box.extendBy(corner.uv);
    const V2d from = box.min - reach.max, to = box.max - reach.min;
    // A triangle may cover little of its box.
    constexpr double max_boxes = 64;
    if (!(std::max({-from.x, -from.y, to.x, to.y}) < max_repeat_index) ||
        (to.x - from.x) * (to.y - from.y) > max_boxes * limit)
      return {};
    for (int row = static_cast<int>(std::ceil(from.y)); row <= to.y; ++row) {
      for (int column = static_cast<int>(std::ceil(from.x)); column <= to.x; ++column) {
        const V2d low = reach.min + V2d(column, row), high = reach.max + V2d(column, row);
        if (distance_from<4>(cloth.triangles[t], {low, V2d(low.x, high.y), V2d(high.x, low.y), high}) > 0)
          continue;
        cells[{cloth.triangles[t].patch_index, row, column}].push_back(t);
        if (static_cast<double>(cells.size()) > limit) return {};
      }
    }
  }
  std::vector<ClothCell> list;
  for (auto& [key, triangles] : cells)
    list.push_back({std::get<0>(key), V2i(std::get<2>(key), std::get<1>(key)), std::move(triangles)});
  return list;
}

ClothPoint point_at(const Cloth& cloth, const ClothCell& cell, const V2d& uv) {
  constexpr double edge = 1e-9;  // belongs to both of its triangles
  const Cloth::Triangle* nearest = nullptr;
  double distance = std::numeric_limits<double>::infinity();
  for (const int i : cell.triangles) {
    const double d = distance_from<1>(cloth.triangles[i], {uv});
    if (d >= distance) continue;
    distance = d;
    nearest = &cloth.triangles[i];
    if (d <= 0) break;
  }
  const auto& [a, b, c] = nearest->corners;
  const V2d d1 = b.uv - a.uv, d2 = c.uv - a.uv;
  const double whole = cross(d1, d2);
  const V2d rest(cross(uv - a.uv, d2) / whole, cross(d1, uv - a.uv) / whole);
  const std::array<double, 3> weights{1 - rest.x - rest.y, rest.x, rest.y};
  ClothPoint point{.is_inside = distance <= edge};
  V3d middle(0, 0, 0);
  double sum = 0;
  for (int i = 0; i < 3; ++i) {
    point.position += nearest->corners[i].position * weights[i];
    // Beyond its triangle a surface does not bend on.
    const double weight = std::clamp(weights[i], 0.0, 1.0);
    point.normal += nearest->corners[i].normal * weight;
    middle += nearest->corners[i].position * weight;
    sum += weight;
  }
  point.normal.normalize();
  V3d lift(0, 0, 0);
  for (int i = 0; i < 3; ++i) {
    const Cloth::Corner& corner = nearest->corners[i];
    lift -= corner.normal *
            ((middle / sum - corner.position).dot(corner.normal) * std::clamp(weights[i], 0.0, 1.0) / sum);
  }
  point.position += lift * 0.5;  // the fraction with which the surface is at right angles to the normals
  const V3d e1 = b.position - a.position, e2 = c.position - a.position;
  for (auto* along : {&point.dp_du, &point.dp_dv}) {
    const bool u = along == &point.dp_du;
    *along = (u ? e1 * d2.y - e2 * d1.y : e2 * d1.x - e1 * d2.x) / whole;
    *along -= point.normal * point.normal.dot(*along);
  }
  return point;
}

}  // namespace selvedge
