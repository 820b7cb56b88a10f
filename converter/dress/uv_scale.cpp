#include "converter/dress/uv_scale.h"

#include <Imath/ImathMatrix.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <unordered_map>

#include "converter/dress/flatten.h"
#include "format/base/disjoint_sets.h"
#include "format/base/guard.h"
#include "format/scene/framing.h"

namespace selvedge {
namespace {

/// dP/du and dP/dv of a triangle, and its area (twice, m^2); not finite where its UVs cover none.
struct Sample {
  V3d along_u;
  V3d along_v;
  double area;
};

/// Values, each with its area.
using Spread = std::vector<std::pair<double, double>>;

/// The values that 5, 50 and 95 % of the area stay below.
std::array<double, 3> quantiles(Spread values) {
  constexpr std::array<double, 3> wanted{0.05, 0.5, 0.95};
  double total = 0;
  for (const auto& [value, area] : values) total += area;
  std::ranges::sort(values);
  std::array<double, 3> found{};
  double sum = 0;
  std::size_t next = 0;
  for (const auto& [value, area] : values) {
    sum += area;
    for (; next < wanted.size() && sum >= wanted[next] * total; ++next) found[next] = value;
  }
  return found;
}

/// How many times cloth of this size is too long or too short one way: by the singular values of its stretch.
double stretch_of(const Sample& sample, const V2d& metres) {
  const V3d u = sample.along_u / metres.x;
  const V3d v = sample.along_v / metres.y;
  const double sum = u.length2() + v.length2();
  const double root = V2d(u.length2() - v.length2(), 2 * u.dot(v)).length();  // hypot() differs by C library
  const double longest = std::sqrt((sum + root) / 2);
  const double shortest = std::sqrt(std::max(0.0, (sum - root) / 2));
  const double most = std::max(longest, 1 / shortest);
  return std::isnan(most) ? std::numeric_limits<double>::infinity() : most;
}

/// Adds the samples of a primitive, and the area of triangles that have none.
void measure(const ScenePrimitive& primitive, const M44d& world, int tex_coord, std::vector<Sample>& samples,
             double& without) {
  static const std::vector<V2d> none;
  const std::vector<V2d>& uvs = tex_coord < 0 || tex_coord > 1 ? none : primitive.tex_coords[tex_coord];
  for (std::size_t t = 0; t + 2 < primitive.indices.size(); t += 3) {
    const std::size_t a = primitive.indices[t];
    const std::size_t b = primitive.indices[t + 1];
    const std::size_t c = primitive.indices[t + 2];
    const V3d origin = V3d(primitive.positions[a]) * world;
    const V3d e1 = V3d(primitive.positions[b]) * world - origin;
    const V3d e2 = V3d(primitive.positions[c]) * world - origin;
    const double area = e1.cross(e2).length();
    if (!(area > 0)) continue;
    const V2d d1 = uvs.empty() ? V2d(0, 0) : uvs[b] - uvs[a];
    const V2d d2 = uvs.empty() ? V2d(0, 0) : uvs[c] - uvs[a];
    const double determinant = d1.x * d2.y - d1.y * d2.x;
    const Sample sample{(e1 * d2.y - e2 * d1.y) / determinant, (e2 * d1.x - e1 * d2.x) / determinant, area};
    if (std::isfinite(sample.along_u.length()) && std::isfinite(sample.along_v.length()))
      samples.push_back(sample);
    else
      without += area;
  }
}

/// Whether triangles in a box are a flat rectangle: then their area is the area of the rhombus that has a
/// diagonal and, as long as the other one reaches across, its height.
bool is_flat_rectangle(const std::vector<V3d>& positions, const std::vector<std::uint32_t>& triangles,
                       const Imath::Box3d& box) {
  const double area = twice_area_of(positions, triangles);
  V3d normal(0, 0, 0);
  for (const V3d& sum : normal_sums(positions, triangles)) normal += sum / 3;
  if (normal.length() < 0.999 * area) return false;  // bent
  V3d corner(0, 0, 0);
  for (const std::uint32_t i : triangles)
    if ((positions[i] - box.center()).length2() > corner.length2()) corner = positions[i] - box.center();
  const V3d across = normal.cross(corner).normalized();
  double height = 0;
  for (const std::uint32_t i : triangles)
    height = std::max(height, std::abs((positions[i] - box.center()).dot(across)));
  return std::abs(4 * corner.length() * height - area) < 0.05 * area;
}

}  // namespace

UvSize measure_uv(const Scene& scene, const std::set<int>& chosen, int tex_coord) {
  UvSize size;
  std::vector<Sample> all;
  double without = 0;
  for (const SceneInstance& instance : scene.instances) {
    if (!chosen.contains(instance.primitive)) continue;
    std::vector<Sample> samples;
    measure(scene.primitives[instance.primitive], instance.world, tex_coord, samples, without);
    if (samples.empty()) continue;
    ++size.primitives;
    all.insert(all.end(), samples.begin(), samples.end());
  }
  Spread lengths_u;
  Spread lengths_v;
  for (const Sample& sample : all) {
    lengths_u.emplace_back(sample.along_u.length(), sample.area);
    lengths_v.emplace_back(sample.along_v.length(), sample.area);
  }
  const auto u = quantiles(std::move(lengths_u));
  const auto v = quantiles(std::move(lengths_v));
  size.metres_per_uv_p5 = V2d(u[0], v[0]);
  size.metres_per_uv = V2d(u[1], v[1]);
  size.metres_per_uv_p95 = V2d(u[2], v[2]);
  double area = without;
  Spread stretches{{std::numeric_limits<double>::infinity(), without}};
  for (const Sample& sample : all) {
    area += sample.area;
    const double stretch = stretch_of(sample, size.metres_per_uv);
    stretches.emplace_back(stretch, sample.area);
    if (stretch > max_stretch) size.stretched_fraction += sample.area;
    if (!(stretch <= max_usable_stretch)) size.unusable_fraction += sample.area;
  }
  if (area > 0) {
    size.stretch_p95 = quantiles(std::move(stretches))[2];
    size.stretched_fraction /= area;
    size.unusable_fraction = (size.unusable_fraction + without) / area;
    size.fraction_without_uvs = without / area;
  }
  return size;
}

Issues check_uv_areas(const Scene& scene) {
  Issues issues;
  for (std::size_t m = 0; m < scene.materials.size(); ++m) {
    const std::optional<FabricReference>& fabric = scene.materials[m].fabric;
    if (!fabric || fabric->tex_coord > 1) continue;
    std::set<int> primitives;  // those that show
    for (const SceneInstance& instance : scene.instances)
      if (scene.primitives[instance.primitive].material == static_cast<int>(m))
        primitives.insert(instance.primitive);
    const V2d metres = measure_uv(scene, primitives, fabric->tex_coord).metres_per_uv;
    if (primitives.empty() || (metres.x > 0 && metres.y > 0)) continue;
    issues.push_back({Code::garment_no_uvs, scene.file, fmt::format("/materials/{}", m),
                      "its texture coordinates cover no area in the scene"});
  }
  return issues;
}

std::vector<UvPart> uv_parts(const Scene& scene, const std::map<int, V2i>& materials_and_sets) {
  constexpr double unseen = 1e-6;  // weight of what faces elsewhere
  const Framing framing = value_or_throw(frame_scene(scene));
  const double azimuth = framing.azimuth * std::numbers::pi / 180;
  const double elevation = framing.elevation * std::numbers::pi / 180;
  const V3d way(std::sin(azimuth) * std::cos(elevation), std::sin(elevation),
                std::cos(azimuth) * std::cos(elevation));
  struct Vertex {
    int material;
    V2d uv;
    V3d place;
  };
  std::vector<Vertex> vertices;
  std::vector<int> corners;
  DisjointSets sets(0);
  std::map<std::array<double, 6>, int> known;
  std::set<int> placed;
  for (const SceneInstance& instance : scene.instances) {
    const auto entry = materials_and_sets.find(instance.primitive);
    if (entry == materials_and_sets.end() || !placed.insert(instance.primitive).second) continue;
    const ScenePrimitive& p = scene.primitives[instance.primitive];
    const auto [material, set] = entry->second;
    const auto begin = static_cast<int>(vertices.size());
    for (std::size_t i = 0; i < p.tex_coords[set].size(); ++i) {
      const V2d& uv = p.tex_coords[set][i];
      const V3d at = V3d(p.positions[i]) * instance.world;
      const int own = sets.add();
      vertices.push_back({material, uv, at});
      sets.unite(own, known.try_emplace({uv.x, uv.y, at.x, at.y, at.z, 1.0 * material}, own).first->second);
    }
    if (std::ssize(vertices) > begin)
      for (const std::uint32_t i : p.indices) corners.push_back(begin + static_cast<int>(i));
  }
  for (std::size_t c = 0; c < corners.size(); ++c) sets.unite(corners[c], corners[c - c % 3]);
  std::map<int, UvPart> found;
  for (std::size_t t = 0; t + 2 < corners.size(); t += 3) {
    UvPart& part = found[sets.root(corners[t])];
    const auto corner = [&](std::size_t k) -> const Vertex& { return vertices[corners[t + k]]; };
    const V3d normal = (corner(1).place - corner(0).place).cross(corner(2).place - corner(0).place);
    const double weight = std::max(0.0, normal.dot(way)) + unseen * normal.length();
    part.material = corner(0).material;
    part.weight += weight;
    for (std::size_t k = 0; k < 3; ++k) {
      part.box.extendBy(corner(k).uv);
      part.middle += corner(k).uv * (weight / 3);
      part.nearness += corner(k).place.dot(way) * weight / 3;
    }
  }
  std::vector<UvPart> parts;
  for (const auto& [first, part] : found)
    if (part.weight > 0) parts.push_back(part);
  for (UvPart& part : parts) {
    part.middle /= part.weight;
    part.nearness /= part.weight;
  }
  std::ranges::sort(parts, std::greater(), &UvPart::weight);
  const auto small =
      std::ranges::find_if(parts, [&](const UvPart& p) { return 2 * p.weight < parts[0].weight; });
  const auto front = std::max_element(
      parts.begin(), small, [](const UvPart& a, const UvPart& b) { return a.nearness < b.nearness; });
  if (!parts.empty()) std::rotate(parts.begin(), front, front + 1);
  return parts;
}

Imath::Box3d bounds_of(const Scene& scene) {
  Imath::Box3d bounds;
  for (const SceneInstance& instance : scene.instances)
    for (const V3d& point : used_points(scene, instance)) bounds.extendBy(point);
  return bounds;
}

GarmentBounds robust_bounds(const Scene& scene, const std::set<int>& chosen) {
  SceneParts parts;
  for (const SceneInstance& instance : scene.instances)
    if (chosen.contains(instance.primitive)) parts.push_back(&instance);
  const Imath::Box3d bulk = bulk_box(scene, parts);
  GarmentBounds found;
  for (const SceneInstance* part : parts) {
    double farthest = 0;
    for (const V3d& point : used_points(scene, *part)) {
      const double away = stray_distance_of(point, bulk);
      if (away == 0 && !bulk.isEmpty()) found.box.extendBy(point);
      farthest = std::max(farthest, away);
    }
    if (farthest == 0) continue;
    const ScenePrimitive& p = scene.primitives[part->primitive];
    const std::string material = p.material < 0 ? "" : scene.materials[p.material].name;
    double& known = found.stray_distances[fmt::format("\"{}\" of material \"{}\"", p.name, material)];
    known = std::max(known, farthest);
  }
  return found;
}

std::vector<V3d> normal_sums(const std::vector<V3d>& positions, const std::vector<std::uint32_t>& triangles) {
  std::vector<V3d> sums(positions.size(), V3d(0, 0, 0));
  for (std::size_t t = 0; t + 2 < triangles.size(); t += 3) {
    const V3d& a = positions[triangles[t]];
    const V3d normal = (positions[triangles[t + 1]] - a).cross(positions[triangles[t + 2]] - a);
    for (std::size_t k = 0; k < 3; ++k) sums[triangles[t + k]] += normal;
  }
  return sums;
}

double twice_area_of(const std::vector<V3d>& positions, const std::vector<std::uint32_t>& triangles) {
  double sum = 0;
  for (std::size_t t = 0; t + 2 < triangles.size(); t += 3) {
    const V3d& origin = positions[triangles[t]];
    sum += (positions[triangles[t + 1]] - origin).cross(positions[triangles[t + 2]] - origin).length();
  }
  return sum;
}

PrimitivesInScene primitives_in(const Scene& scene) {
  PrimitivesInScene places;
  for (const SceneInstance& instance : scene.instances) {
    const ScenePrimitive& p = scene.primitives[instance.primitive];
    const auto [entry, fresh] = places.try_emplace(PrimitiveIndex(p.mesh, p.primitive_index));
    if (!fresh) continue;
    const M44d& world = instance.world;
    std::vector<V3d> positions;
    for (const V3f& position : p.positions) positions.push_back(V3d(position) * world);
    entry->second = {twice_area_of(positions, p.indices), -V3d(world[0][1], world[1][1], world[2][1])};
  }
  return places;
}

std::map<int, MaterialExtent> material_extents(const Scene& scene) {
  std::map<int, MaterialExtent> extents;
  for (const SceneInstance& instance : scene.instances) {
    const ScenePrimitive& p = scene.primitives[instance.primitive];
    std::vector<V3d> positions;
    for (const V3f& position : p.positions) positions.push_back(V3d(position) * instance.world);
    Imath::Box3d box;
    for (const std::uint32_t i : p.indices) box.extendBy(positions[i]);
    MaterialExtent& extent = extents[p.material];
    extent.box.extendBy(box);
    extent.twice_area += twice_area_of(positions, p.indices);
    extent.is_flat_rectangle = extent.is_flat_rectangle && is_flat_rectangle(positions, p.indices, box);
  }
  return extents;
}

std::map<int, double> double_layer_fractions(const Scene& scene) {
  constexpr double tolerance = 2e-4;    // of the diagonal
  constexpr double opposite = -0.99;    // cosine of the normals
  constexpr std::size_t max_faces = 8;  // looked at on one edge
  std::vector<V3d> positions;
  std::vector<std::uint32_t> corners;
  std::vector<int> materials;  // by triangle
  std::set<int> placed;
  for (const SceneInstance& instance : scene.instances) {
    const ScenePrimitive& p = scene.primitives[instance.primitive];
    if (!placed.insert(instance.primitive).second) continue;
    for (const std::uint32_t i : p.indices)
      corners.push_back(static_cast<std::uint32_t>(positions.size()) + i);
    for (const V3f& position : p.positions) positions.push_back(V3d(position) * instance.world);
    materials.insert(materials.end(), p.indices.size() / 3, p.material);
  }
  const std::vector<std::uint32_t> welded = weld(positions, tolerance * bounds_of(scene).size().length());
  std::vector<V3d> normals;
  std::unordered_map<std::uint64_t, std::vector<std::size_t>> faces;  // by edge
  const auto faces_of = [&](std::size_t face, std::size_t k) -> std::vector<std::size_t>& {
    const auto [a, b] = std::minmax(welded[corners[3 * face + k]], welded[corners[3 * face + (k + 1) % 3]]);
    return faces[std::uint64_t{a} << 32U | b];
  };
  for (std::size_t f = 0; f < materials.size(); ++f) {
    const V3d& a = positions[corners[3 * f]];
    normals.push_back((positions[corners[3 * f + 1]] - a).cross(positions[corners[3 * f + 2]] - a));
    for (std::size_t k = 0; k < 3; ++k)
      if (faces_of(f, k).size() < max_faces) faces_of(f, k).push_back(f);
  }
  std::map<int, double> backed;
  std::map<int, double> areas;
  for (std::size_t f = 0; f < materials.size(); ++f) {
    int shared = 0;  // two at least: the diagonals of squares may differ, and folds share one
    for (std::size_t k = 0; k < 3; ++k)
      shared += std::ranges::any_of(faces_of(f, k), [&](std::size_t other) {
        return normals[f].dot(normals[other]) < opposite * normals[f].length() * normals[other].length();
      });
    areas[materials[f]] += normals[f].length();
    if (shared > 1) backed[materials[f]] += normals[f].length();
  }
  for (auto& [material, area] : backed) area /= areas[material];
  return backed;
}

}  // namespace selvedge
