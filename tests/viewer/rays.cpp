#include "tests/viewer/rays.h"

#include <Imath/ImathBox.h>

#include <algorithm>
#include <numeric>

#include "format/base/guard.h"
#include "format/base/parallel.h"
#include "viewer/gl/context.h"
#include "viewer/hybrid/raster.h"
#include "viewer/light/shadow_pass.h"

namespace selvedge::test {
namespace {

constexpr int rays_per_side = 8;
static_assert(Raster::strip_rows % rays_per_side == 0);
constexpr float horizon = 0.01F;  ///< least cosine between view and normal

struct Garment {
  const Camera& camera;
  V2i rays;
  std::span<const Light> lights;
  V3d origin{0, 0, 0};
  Materials materials{};
  MergedSurfaces mesh{};
  std::vector<Fabric> fabrics{};  ///< each from the front, then from behind
  std::vector<ShadowMap> shadows{};
};

void cast_shadows(Garment& garment, int size) {
  const auto context = value_or_throw(make_osmesa_context());
  value_or_throw(context->make_current());
  const GlFunctions gl = value_or_throw(load_gl_functions(*context));
  const auto pass = value_or_throw(ShadowPass::create(gl, garment.mesh, garment.materials));
  value_or_throw(pass->draw(shadow_views(garment.lights, garment.mesh.positions, garment.origin, size)));
  const std::span<const ShadowMap> maps = pass->read();
  garment.shadows.assign(maps.begin(), maps.end());
}

/// Change of a place on the surface, mm, and of its normal, to the next ray to the right and upwards.
struct Slopes {
  std::array<V2f, 2> place, normal;
};

/// Of the ellipse that a ray stands for, the shorter axis.
float width_across_view(const Slopes& s) {
  const float area = s.place[0].cross(s.place[1]);
  const float half = (s.place[0].length2() + s.place[1].length2()) / 2;
  return std::abs(area) / std::sqrt(half + std::sqrt(std::max(half * half - area * area, 0.0F)));
}

/// How far below its plane yarn `thickness` deep is met where cloth bends away.
float outline_depth(const Slopes& s, const V3f& view, float thickness) {
  const float level = V2f(view.x, view.y).length();
  const V2f across = V2f(view.x, view.y) / level;
  const auto& [right, up] = s.place;
  const V2f turn = s.normal[0] * across.cross(up) + s.normal[1] * right.cross(across);
  const float bend = turn.dot(across) / right.cross(up);
  if (!(bend > 0)) return HUGE_VALF;
  return 0.5F * view.z * view.z / (level * level * std::min(bend, 0.25F / thickness));
}

/// Adds the light of a ray that meets yarn at a surface; false where it passes through a hole.
bool shade(const Garment& garment, SeenSurface surface, int x, int y, V3f& radiance) {
  const MergedTriangle& triangle = garment.mesh.triangles[surface / 2];
  const float side = surface % 2 == 0 ? 1 : -1;
  std::array<V3d, 3> corners;
  std::array<V3f, 3> normals;
  std::array<V3f, 3> tangents;
  std::array<V2d, 3> uvs;
  for (std::size_t k = 0; k < 3; ++k) {
    const auto& [normal_u, tangent_v] = garment.mesh.attributes[triangle.corners[k]];
    corners[k] = V3d(garment.mesh.positions[triangle.corners[k]]);
    normals[k] = {normal_u[0], normal_u[1], normal_u[2]};
    tangents[k] = {tangent_v[0], tangent_v[1], tangent_v[2]};
    uvs[k] = V2d(V2f(normal_u[3], tangent_v[3]));
  }
  const auto towards_viewer = [&](double ray_x, double ray_y) {
    const V2d part = (V2d(ray_x, ray_y) + V2d(0.5)) / V2d(garment.rays);
    return view_direction(garment.camera, part * 2.0 - V2d(1));
  };
  // Weights of the second and third corner where a ray meets the triangle's plane.
  const auto meet = [&](double ray_x, double ray_y) {
    const V3d ray = towards_viewer(ray_x, ray_y);
    const V3d a = corners[1] - corners[0];
    const V3d b = corners[2] - corners[0];
    const V3d from = garment.camera.position - garment.origin - corners[0];
    const V3d h = ray.cross(b);
    return V2d(from.dot(h), ray.dot(from.cross(a))) / a.dot(h);
  };
  const auto along = []<class T>(const std::array<T, 3>& values, const V2d& weights) {
    using Number = typename T::BaseType;
    return (values[1] - values[0]) * static_cast<Number>(weights.x) +
           (values[2] - values[0]) * static_cast<Number>(weights.y);
  };
  const V2d at = meet(x, y);
  const std::array steps{meet(x + 1, y) - at, meet(x, y + 1) - at};

  const V3f view(towards_viewer(x, y));
  V3f normal = normals[0] + along(normals, at);
  const float length = normal.length();
  normal *= side / length;
  if (const float facing = normal.dot(view); facing < horizon)
    normal = (normal + view * (horizon - facing)).normalized();
  V3f tangent = tangents[0] + along(tangents, at);
  tangent = (tangent - normal * normal.dot(tangent)).normalized();
  const V3f up = normal.cross(tangent) * (side * triangle.handedness);
  const auto in_frame = [&](const V3f& d) { return V3f(d.dot(tangent), d.dot(up), d.dot(normal)); };

  const int number = garment.materials.surfaces[triangle.surface].fabric;
  const Fabric& fabric = garment.fabrics[2 * number + surface % 2];
  const Yarns& yarns = *fabric.levels.front().yarns();
  Slopes slopes;
  for (std::size_t i = 0; i < 2; ++i) {
    slopes.place[i] = V2f(along(uvs, steps[i])) * V2f(yarns.period().x, -yarns.period().y);
    const V3f turn = in_frame(along(normals, steps[i]) / length);
    slopes.normal[i] = {turn.x, turn.y};
  }
  const V3f v = in_frame(view);
  const auto hit =
      yarns.trace(uvs[0] + along(uvs, at), fabric.reference_height, v, width_across_view(slopes));
  if (!hit) return false;
  const float z = yarns.inside().segments[hit->segment].start.z + hit->from_start.z;
  const float below = fabric.reference_height - z;
  const float deepest = outline_depth(slopes, v, fabric.reference_height - yarns.inside().low);
  if (below > deepest || (side < 0 && below < -deepest)) return false;

  YarnPoint point = yarns.point_at(*hit);
  yarns.add_strands(point, v);
  const V3f place(corners[0] + along(corners, at));
  for (std::size_t i = 0; i < garment.lights.size(); ++i) {
    const V3f towards(garment.lights[i].direction);
    const V3f l = in_frame(towards);
    const bool through = l.z < 0;
    if (through && yarns.data().through.empty()) continue;
    V3f f = indirect_light(yarns.transfer_at(point, through), through ? mirrored(l) : l) * point.brightness;
    const V3f lit = through ? V3f(0) : yarns.direct(point, l, v);
    if (lit != V3f(0) && !yarns.occluded(*hit, point, l)) f += lit;
    for (const ShadowMap& map : garment.shadows) {
      if (map.view.light == i) f *= shadow_share(map, place, through ? -normal : normal, towards);
    }
    radiance += f * garment.lights[i].irradiance;
  }
  return true;
}

}  // namespace

Frame march(const Scene& scene, std::span<const Fabric> fabrics, const Camera& camera, const V2i& size,
            std::span<const Light> lights, int shadows) {
  Garment garment{camera, size * rays_per_side, lights};
  Imath::Box3d bounds;
  for (const V3d& point : value_or_throw(world_points(scene))) bounds.extendBy(point);
  garment.origin = bounds.center();
  const std::vector<Surface> surfaces = value_or_throw(build_surfaces(scene, garment.origin));
  std::vector<std::string> remarks;
  garment.materials = value_or_throw(materials_of(scene, surfaces, fabrics.size(), remarks));
  garment.mesh = merge(surfaces);
  for (const Fabric& fabric : fabrics) {
    garment.fabrics.push_back(fabric);
    garment.fabrics.push_back(fabric.side_of(Side::back) != nullptr ? turned_over(fabric) : fabric);
  }
  if (shadows > 0) cast_shadows(garment, shadows);

  const V2i& rays = garment.rays;
  const ProjectedVertices projected =
      project(garment.mesh, clip_matrix(camera, garment.origin), rays.x, rays.y);
  const TriangleLists lists = list_bands(garment.mesh, projected, garment.materials.surfaces, rays.y)[0];
  std::array<Raster, 2> sides;
  sides[0].begin(garment.mesh, projected, lists.front, false, 0, rays.y);
  sides[1].begin(garment.mesh, projected, lists.back, true, 0, rays.y);
  Frame frame{size.x, size.y, std::vector<V4f>(std::size_t{1} * size.x * size.y, V4f(0))};
  parallel_for(0, (rays.y + Raster::strip_rows - 1) / Raster::strip_rows, [&](int strip) {
    const int first = strip * Raster::strip_rows;
    std::vector<std::uint32_t> numbers(rays.x * std::min(Raster::strip_rows, rays.y - first));
    std::iota(numbers.begin(), numbers.end(), static_cast<std::uint32_t>(first * rays.x));
    std::vector<DeepHit> hits;
    for (const Raster& side : sides) side.find(strip, numbers, hits);
    std::ranges::sort(hits, {}, [](const DeepHit& hit) { return std::pair(hit.pixel, hit.depth); });
    std::uint32_t met = ~0U;
    for (const DeepHit& hit : hits) {
      const int x = static_cast<int>(hit.pixel) % rays.x;
      const int y = static_cast<int>(hit.pixel) / rays.x;
      V3f radiance(0);
      if (hit.pixel == met || !shade(garment, hit.surface, x, y, radiance)) continue;
      met = hit.pixel;
      const int row = size.y - 1 - y / rays_per_side;
      frame.pixels[row * size.x + x / rays_per_side] +=
          V4f(radiance.x, radiance.y, radiance.z, 1) / (rays_per_side * rays_per_side);
    }
  });
  return frame;
}

}  // namespace selvedge::test
