#include "tests/viewer/rays.h"

#include <Imath/ImathBox.h>

#include <algorithm>
#include <map>
#include <numeric>

#include "format/base/guard.h"
#include "format/base/parallel.h"
#include "format/fabric/evaluate.h"
#include "format/fabric/footprint.h"
#include "viewer/light/pbr_brdf.h"
#include "viewer/light/shadow_maps.h"
#include "viewer/raster/raster.h"

namespace selvedge::test {
namespace {

constexpr int rays_per_side = 8;
static_assert(Raster::strip_rows % rays_per_side == 0);
constexpr float horizon = 0.01F;  ///< least cosine between view and normal

struct Garment {
  const Camera& camera;
  V2i rays;
  std::span<const Light> lights;
  int forced = -1;  ///< level
  V3d origin{0, 0, 0};
  Materials materials{};
  MergedSurfaces mesh{};
  std::vector<Fabric> fabrics{};  ///< each from the front, then from behind
  std::vector<ShadowMap> shadows{};
};

void cast_shadows(Garment& garment, int size) {
  const Occluders occluders(garment.mesh, garment.materials);
  for (const ShadowView& view : shadow_views(garment.lights, garment.mesh.positions, garment.origin, size))
    garment.shadows.push_back(occluders.draw(view));
}

/// Change of a place on the surface, mm, and of its normal, to the next ray to the right and upwards.
struct Slopes {
  std::array<V2f, 2> place, normal;
};

/// The shorter axis of the ellipse that a ray stands for.
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

/// Where a ray meets a surface: directions in the frame of the side that is seen, texture coordinates, and
/// their changes.
struct Meeting {
  V3f place, normal, tangent, up, view;
  V2d uv;
  std::array<V2d, 2> steps;
  std::array<V3f, 2> turns;  ///< of the front's unit normal
  float side = 1;
  V3f in_frame(const V3f& d) const { return {d.dot(tangent), d.dot(up), d.dot(normal)}; }
};

Meeting meet(const Garment& garment, TriangleSide surface, double x, double y) {
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
  const auto weights = [&](double ray_x, double ray_y) {
    const V3d ray = towards_viewer(ray_x, ray_y);
    const V3d a = corners[1] - corners[0];
    const V3d b = corners[2] - corners[0];
    V3d from = garment.camera.position - garment.origin - corners[0];
    if (garment.camera.projection == Projection::parallel) {
      const V2d part = (V2d(ray_x, ray_y) + V2d(0.5)) / V2d(garment.rays);
      const V2d at_window =
          garment.camera.window_centre + (part * 2.0 - V2d(1)) * garment.camera.window_half_size;
      from += garment.camera.right * at_window.x + garment.camera.up * at_window.y;
    }
    const V3d h = ray.cross(b);
    return V2d(from.dot(h), ray.dot(from.cross(a))) / a.dot(h);
  };
  const auto along = []<class T>(const std::array<T, 3>& values, const V2d& by) {
    using Number = typename T::BaseType;
    return (values[1] - values[0]) * static_cast<Number>(by.x) +
           (values[2] - values[0]) * static_cast<Number>(by.y);
  };
  const V2d at = weights(x, y);

  Meeting m;
  m.side = side;
  m.view = V3f(towards_viewer(x, y));
  m.place = V3f(corners[0] + along(corners, at));
  m.uv = uvs[0] + along(uvs, at) + V2d(garment.mesh.triangles[surface / 2].whole_repeats);
  m.normal = normals[0] + along(normals, at);
  const float length = m.normal.length();
  for (std::size_t i = 0; i < 2; ++i) {
    const V2d step = weights(x + (i == 0 ? 1 : 0), y + (i == 0 ? 0 : 1)) - at;
    m.steps[i] = along(uvs, step);
    m.turns[i] = along(normals, step) / length;
  }
  m.normal *= side / length;
  if (const float facing = m.normal.dot(m.view); facing < horizon)
    m.normal = (m.normal + m.view * (horizon - facing)).normalized();
  m.tangent = tangents[0] + along(tangents, at);
  m.tangent = (m.tangent - m.normal * m.normal.dot(m.tangent)).normalized();
  m.up = m.normal.cross(m.tangent) * (side * triangle.handedness);
  return m;
}

/// Calls body(direction in the frame, irradiance, fraction outside of shadows) for each light.
template <class Body>
void for_each_light(const Garment& garment, const Meeting& m, const Body& body) {
  for (std::size_t i = 0; i < garment.lights.size(); ++i) {
    const Light& light = garment.lights[i];
    const Illumination there = illumination_at(light, garment.origin + V3d(m.place));
    const V3f towards(there.direction);
    const V3f l = m.in_frame(towards);
    float fraction = 1;
    for (const ShadowMap& map : garment.shadows)
      if (map.view.light == i)
        fraction = shadow_visibility(map, m.place, l.z < 0 ? -m.normal : m.normal, towards);
    body(l, there.irradiance, fraction);
  }
}

/// Radiance of the yarn that a ray meets, and 1; 0 where it passes through a hole.
V4f shade_yarn(const Garment& garment, const Fabric& fabric, const Meeting& m) {
  const Yarns& yarns = *fabric.levels.front().yarns();
  Slopes slopes;
  for (std::size_t i = 0; i < 2; ++i) {
    slopes.place[i] = V2f(m.steps[i]) * V2f(yarns.repeat().x, -yarns.repeat().y);
    const V3f turn = m.in_frame(m.turns[i]);
    slopes.normal[i] = {turn.x, turn.y};
  }
  const V3f v = m.in_frame(m.view);
  const V2d uv = displaced_place(yarns.variation(), m.uv);
  const auto hit = yarns.trace(uv, fabric.reference_height, v, width_across_view(slopes));
  if (!hit) return V4f(0);
  const float z = yarns.geometry().segments[hit->segment].start.z + hit->start_offset.z;
  const float below = fabric.reference_height - z;
  const float deepest = outline_depth(slopes, v, fabric.reference_height - yarns.geometry().min_z);
  if (below > deepest || (m.side < 0 && below < -deepest)) return V4f(0);

  YarnPoint point = yarns.point_at(*hit);
  yarns.perturb_by_strands(point, v);
  const float factor = yarns.variation_factor(uv, point.curve);
  V3f sum(0);
  for_each_light(garment, m, [&](const V3f& l, const V3f& irradiance, float fraction) {
    const bool through = l.z < 0;
    if (through && yarns.data().light_through.empty()) return;
    V3f f = indirect_light(yarns.transfer_at(point, through), through ? mirrored(l) : l) * point.brightness;
    if (!through) f *= yarns.lustre_view_factor(point, v);
    const V3f lit = through ? V3f(0) : yarns.direct_reflectance(point, l, v);
    if (lit != V3f(0) && !yarns.is_occluded(*hit, point, l)) f += lit;
    sum += f * irradiance * (fraction * factor);
  });
  return {sum.x, sum.y, sum.z, 1};
}

/// Weights of texels: level, column, row.
using TexelWeights = std::map<std::array<int, 3>, float>;

/// Adds the texels of a level under a pixel that is at least as wide as one of them, by the places of points
/// in it.
void add_texels(const Fabric& fabric, int level, const V2d& uv, std::array<V2d, 2> steps, float weight,
                TexelWeights& texels) {
  constexpr int points = 16;
  const FabricLevel& stored = fabric.levels[level];
  const V2d size(stored.width, stored.height);
  for (std::size_t i = 0; i < 2; ++i) {
    const double length = (steps[i] * size).length();
    steps[i] = length > 1e-12 ? steps[i] / std::min(length, 1.0) : V2d(i == 0 ? 1 : 0, i == 0 ? 0 : 1) / size;
  }
  for (int i = 0; i < points * points; ++i) {
    const V2d part = V2d(i % points + 0.5, i / points + 0.5) / points - V2d(0.5);
    const V2d at = uv + steps[0] * part.x + steps[1] * part.y;
    texels[{level, wrap_texel(at.x, stored.width), wrap_texel(at.y, stored.height)}] +=
        weight / (points * points);
  }
}

/// Radiance by each light and opacity of the texels under a pixel, of which this is the middle (spec/brdf.md,
/// "The viewer"); of a forced level, of the nearest one.
std::vector<V4f> shade_texels(const Garment& garment, const Fabric& fabric, const Meeting& m) {
  const std::array<V2d, 2> steps{m.steps[0] * double{rays_per_side}, m.steps[1] * double{rays_per_side}};
  V2d place = m.uv;
  float varied = 1;
  if (const auto& yarns = fabric.levels.front().yarns(); yarns) {
    const Variation& variation = yarns->variation();
    const VariationFade fade = variation_fade(
        variation, V2f(V2d(std::hypot(steps[0].x, steps[1].x), std::hypot(steps[0].y, steps[1].y))));
    const RepeatPlace moved = displaced_place(variation, repeat_place(m.uv), offset_weight(fade));
    varied = variation_at(variation, moved, variation.along_v_fraction, fade);
    place = V2d(moved.fraction);
  }
  TexelWeights texels;
  if (garment.forced >= 0) {
    const FabricLevel& level = fabric.levels[garment.forced];
    texels[{garment.forced, wrap_texel(place.x, level.width), wrap_texel(place.y, level.height)}] = 1;
  } else {
    const V2d size(fabric.texels());
    const float pixel = pixel_width_texels({V2f(steps[0] * size), V2f(steps[1] * size)});
    const float level =
        std::clamp(std::log2(pixel) + level_bias, 0.0F, static_cast<float>(fabric.levels.size() - 1));
    const int lower = static_cast<int>(level);
    const float of_upper = coarser_level_weight(level - std::floor(level));
    if (of_upper < 1) add_texels(fabric, lower, place, steps, 1 - of_upper, texels);
    if (of_upper > 0) add_texels(fabric, lower + 1, place, steps, of_upper, texels);
  }
  std::vector<V4f> by_light;
  for_each_light(garment, m, [&](const V3f& l, const V3f& irradiance, float) {
    V4f p(0);
    for (const auto& [texel, weight] : texels) {
      const Shading s = evaluate(fabric, texel[0], texel[1], texel[2], l, m.in_frame(m.view));
      const V3f radiance = s.radiance * irradiance * (s.alpha * weight * varied);
      p += V4f(radiance.x, radiance.y, radiance.z, s.alpha * weight);
    }
    by_light.push_back(p.w > 0 ? V4f(p.x / p.w, p.y / p.w, p.z / p.w, p.w) : V4f(0));
  });
  return by_light;
}

/// Texels under pixels, which all rays of a pixel share.
using PixelTexels = std::map<std::pair<std::uint32_t, TriangleSide>, std::vector<V4f>>;

/// Radiance and opacity of a surface.
V4f shade(const Garment& garment, TriangleSide surface, int x, int y, PixelTexels& texels) {
  const std::uint32_t number = garment.mesh.triangles[surface / 2].surface;
  const SurfaceMaterial& material = garment.materials.surfaces[number];
  const Meeting m = meet(garment, surface, x, y);
  if (material.fabric < 0) {
    const PbrMaterial& pbr = garment.materials.pbr[number];
    const V4f& base = material.base_color_factor;
    const PbrPoint point{V3f(base.x, base.y, base.z), pbr.metallic, pbr.roughness};
    V3f sum(0);
    for_each_light(garment, m, [&](const V3f& l, const V3f& irradiance, float fraction) {
      sum += pbr_brdf(point, V3f(0, 0, 1), m.in_frame(m.view), l) * irradiance * fraction;
    });
    return {sum.x, sum.y, sum.z, 1};
  }
  const Fabric& fabric = garment.fabrics[2 * material.fabric + surface % 2];
  V4f shaded(0);
  if (garment.forced == -1 && fabric.levels.front().yarns()) {
    shaded = shade_yarn(garment, fabric, m);
  } else {
    const V2i pixel(x / rays_per_side, y / rays_per_side);
    const auto place = static_cast<std::uint32_t>(pixel.y * garment.rays.x + pixel.x);
    std::vector<V4f>& by_light = texels[{place, surface}];
    if (garment.forced >= 0) {
      by_light = shade_texels(garment, fabric, m);
    } else if (by_light.empty()) {
      const V2d middle = (V2d(pixel) + V2d(0.5)) * double{rays_per_side} - V2d(0.5);
      by_light = shade_texels(garment, fabric, meet(garment, surface, middle.x, middle.y));
    }
    auto light = by_light.begin();
    for_each_light(garment, m, [&](const V3f&, const V3f&, float fraction) {
      shaded += V4f(light->x * fraction, light->y * fraction, light->z * fraction, 0);
      shaded.w = light++->w;
    });
  }
  if (!material.keeps_opacity) shaded.w = 1;
  return shaded;
}

}  // namespace

Frame march(const Scene& scene, std::span<const Fabric> fabrics, const Camera& camera, const V2i& size,
            std::span<const Light> lights, int shadows, int layers, int forced) {
  Garment garment{camera, size * rays_per_side, lights, forced};
  garment.origin = bounding_box(value_or_throw(world_points(scene))).center();
  const std::vector<Surface> surfaces = value_or_throw(build_surfaces(scene, garment.origin));
  std::vector<std::string> remarks;
  garment.materials = materials_of(scene, surfaces, remarks);
  garment.mesh = merge(surfaces);
  for (const Fabric& fabric : fabrics) {
    garment.fabrics.push_back(fabric);
    garment.fabrics.push_back(fabric.find_side(Side::back) != nullptr ? turned_over(fabric) : fabric);
  }
  if (shadows > 0) cast_shadows(garment, shadows);

  const V2i& rays = garment.rays;
  const ProjectedVertices projected =
      project(garment.mesh, clip_matrix(camera, garment.origin), rays.x, rays.y);
  const TriangleLists lists = list_bands(garment.mesh, projected, garment.materials.surfaces, rays.y)[0];
  std::array<Raster, 2> sides;
  sides[0].begin(garment.mesh, projected, lists[0], false, 0, rays.y);
  sides[1].begin(garment.mesh, projected, lists[1], true, 0, rays.y);
  Frame frame{size.x, size.y, std::vector<V4f>(std::size_t{1} * size.x * size.y, V4f(0))};
  parallel_for(0, (rays.y + Raster::strip_rows - 1) / Raster::strip_rows, [&](int strip) {
    const int first = strip * Raster::strip_rows;
    std::vector<std::uint32_t> numbers(rays.x * std::min(Raster::strip_rows, rays.y - first));
    std::iota(numbers.begin(), numbers.end(), static_cast<std::uint32_t>(first * rays.x));
    std::vector<DeepHit> hits;
    for (const Raster& side : sides) side.find_hits(strip, numbers, hits);
    std::ranges::sort(hits, {}, [](const DeepHit& hit) { return std::pair(hit.pixel, hit.depth); });
    PixelTexels texels;
    std::uint32_t pixel = ~0U;
    int layer = 0;
    float left = 1;  // fraction of the light from behind that reaches the viewer
    for (const DeepHit& hit : hits) {
      if (hit.pixel != pixel) {
        pixel = hit.pixel;
        layer = 0;
        left = 1;
      }
      if (layer++ >= layers || left <= 0) continue;
      const int x = static_cast<int>(hit.pixel) % rays.x;
      const int y = static_cast<int>(hit.pixel) / rays.x;
      const V4f shaded = shade(garment, hit.surface, x, y, texels);
      const float fraction = left * shaded.w / (rays_per_side * rays_per_side);
      frame.pixels[(size.y - 1 - y / rays_per_side) * size.x + x / rays_per_side] +=
          V4f(shaded.x, shaded.y, shaded.z, 1) * fraction;
      left *= 1 - shaded.w;
    }
  });
  return frame;
}

}  // namespace selvedge::test
