#include "viewer/hybrid/shade.h"

#include <algorithm>
#include <cmath>

#include "format/simd/wide_float.h"
#include "viewer/cells/cell_pass.h"
#include "viewer/hybrid/pbr_shading.h"
#include "viewer/scene/view_rays.h"

namespace selvedge {
namespace {

/// Smallest cosine between view and normal after bending.
constexpr float horizon = 0.01F;

template <std::size_t N>
SELVEDGE_INLINE WideVec3<N> load(const LaneDirections& d, std::size_t first) {
  using Wide = WideFloat<N>;
  return {Wide::load(&d.x[first]), Wide::load(&d.y[first]), Wide::load(&d.z[first])};
}

template <std::size_t N>
SELVEDGE_INLINE void store(const WideVec3<N>& v, LaneDirections& d, std::size_t first) {
  v.x.store(&d.x[first]);
  v.y.store(&d.y[first]);
  v.z.store(&d.z[first]);
}

template <std::size_t N>
SELVEDGE_INLINE WideVec3<N> wide(const V3f& v) {
  return {WideFloat<N>(v.x), WideFloat<N>(v.y), WideFloat<N>(v.z)};
}

template <std::size_t N>
SELVEDGE_INLINE WideVec3<N> choose(const WideFloat<N>& a, const WideFloat<N>& b, const WideVec3<N>& yes,
                                   const WideVec3<N>& no) {
  return {if_greater(a, b, yes.x, no.x), if_greater(a, b, yes.y, no.y), if_greater(a, b, yes.z, no.z)};
}

/// `v` normalised; `otherwise` if it has no direction.
template <std::size_t N>
SELVEDGE_INLINE WideVec3<N> unit_or(const WideVec3<N>& v, const WideVec3<N>& otherwise) {
  using Wide = WideFloat<N>;
  const Wide length2 = v.dot(v);
  // Comparisons with NaN are false.
  const Wide usable = if_greater(Wide(1e36F), length2, length2, Wide(0));
  return choose(usable, Wide(1e-36F), v * (Wide(1) / sqrt(length2)), otherwise);
}

/// `t` perpendicular to the normal. The fixed axis replaces it where it has no direction: x, or y if the
/// normal is along x (tangent_of()).
template <std::size_t N>
SELVEDGE_INLINE WideVec3<N> across(const WideVec3<N>& normal, const WideVec3<N>& t) {
  using Wide = WideFloat<N>;
  using Vec = WideVec3<N>;
  const Wide zero(0);
  const Vec axis =
      choose(Wide(1) - normal.x * normal.x, Wide(1e-6F), Vec{Wide(1), zero, zero}, Vec{zero, Wide(1), zero});
  const Vec fixed = unit_or(axis - normal * normal.dot(axis), axis);
  return unit_or(t - normal * normal.dot(t), fixed);
}

template <std::size_t N>
SELVEDGE_INLINE void frames(const ViewRays& rays, const PixelPlaces& block, LaneFrames& result) {
  using Wide = WideFloat<N>;
  using Vec = WideVec3<N>;
  for (std::size_t first = 0; first < lane_count; first += N) {
    const Vec ray = wide<N>(rays.base) + wide<N>(rays.right) * Wide::load(&block.from_middle_x[first]) +
                    wide<N>(rays.up) * Wide::load(&block.from_middle_y[first]);
    const Vec view = ray * (Wide(1) / sqrt(ray.dot(ray)));
    const Wide side = Wide::load(&block.side[first]);
    const Wide turned = side * Wide::load(&block.handedness[first]);
    const Vec t = load<N>(block.tangent, first);
    Vec normal = unit_or(load<N>(block.normal, first), view * side) * side;
    if (block.bent) {
      const Wide x = Wide::load(&block.slope_x[first]);
      const Wide y = Wide::load(&block.slope_y[first]);
      const Vec along = across(normal, t);
      normal = along * (x * side) + normal.cross(along) * (y * side * turned) +
               normal * sqrt(max(Wide(1) - x * x - y * y, Wide(0)));
      normal = unit_or(normal, view);
    }
    const Wide cosine = normal.dot(view);
    const Wide min_cosine(horizon);
    normal = choose(min_cosine, cosine, unit_or(normal + view * (min_cosine - cosine), view), normal);
    const Vec tangent = across(normal, t);
    const Vec up = normal.cross(tangent) * turned;
    store(tangent, result.tangent, first);
    store(up, result.up, first);
    store(normal, result.normal, first);
    store(Vec{view.dot(tangent), view.dot(up), view.dot(normal)}, result.view, first);
  }
}
SELVEDGE_THREE_BODIES(frames, (const ViewRays& rays, const PixelPlaces& block, LaneFrames& result),
                      (rays, block, result))

template <std::size_t N>
SELVEDGE_INLINE void light_lanes(const LaneFrames& frame, const V3f& direction, LaneDirections& result) {
  for (std::size_t first = 0; first < lane_count; first += N) {
    const WideVec3<N> d = wide<N>(direction);
    store(WideVec3<N>{d.dot(load<N>(frame.tangent, first)), d.dot(load<N>(frame.up, first)),
                      d.dot(load<N>(frame.normal, first))},
          result, first);
  }
}
SELVEDGE_THREE_BODIES(light_lanes, (const LaneFrames& frame, const V3f& direction, LaneDirections& result),
                      (frame, direction, result))

template <std::size_t N>
SELVEDGE_INLINE void turn_lanes(const LaneFrames& frame, LaneSmoothLight& light) {
  using Wide = WideFloat<N>;
  for (std::size_t first = 0; first < lane_count; first += N) {
    for (std::size_t c = 0; c < 3; ++c) {
      std::array<Wide, smooth_functions> of_colour;
      for (std::size_t k = 0; k < smooth_functions; ++k)
        of_colour[k] = Wide::load(&light.factors[k][c][first]);
      const auto in_frame = turned(of_colour, load<N>(frame.tangent, first), load<N>(frame.up, first),
                                   load<N>(frame.normal, first));
      for (std::size_t k = 0; k < smooth_functions; ++k) in_frame[k].store(&light.factors[k][c][first]);
    }
  }
}
SELVEDGE_THREE_BODIES(turn_lanes, (const LaneFrames& frame, LaneSmoothLight& light), (frame, light))

/// Prevents NaN in sums and filters from lobes that overflowed.
float tame(float radiance) { return radiance >= 0 ? std::min(radiance, 1e30F) : 0.0F; }

/// The fabric's result in the picture's form: opaque if the material requires it.
template <std::size_t N>
SELVEDGE_INLINE void finish(const LaneFloats& keeps_opacity, LaneShading& shading) {
  using Wide = WideFloat<N>;
  const Wide zero(0);
  const Wide one(1);
  const Wide max_radiance(1e30F);
  for (std::size_t first = 0; first < lane_count; first += N) {
    const Wide keeps = Wide::load(&keeps_opacity[first]);
    const Wide alpha = Wide::load(&shading.alpha[first]);
    const Wide scale = if_greater(keeps, zero, one, if_greater(alpha, zero, one / alpha, zero));
    for (LaneFloats* channel : {&shading.red, &shading.green, &shading.blue}) {
      float* values = channel->data() + first;
      const Wide radiance = Wide::load(values) * scale;
      // False for NaN.
      if_greater(radiance, zero, min(radiance, max_radiance), zero).store(values);
    }
    // Weights sum to 1 but for rounding.
    if_greater(keeps, zero, min(alpha, one), one).store(&shading.alpha[first]);
  }
}
SELVEDGE_THREE_BODIES(finish, (const LaneFloats& keeps_opacity, LaneShading& shading),
                      (keeps_opacity, shading))

void set(LaneShading& shading, std::size_t lane, const V3f& colour, float alpha) {
  shading.red[lane] = tame(colour.x);
  shading.green[lane] = tame(colour.y);
  shading.blue[lane] = tame(colour.z);
  shading.alpha[lane] = alpha;
}

/// Whether the material of a fabric has emission.
bool has_emission(const ShadingScene& scene, std::uint32_t surface) {
  return surface < scene.pbr.size() && scene.pbr[surface].emissive != V3f(0, 0, 0);
}

/// Dims what reaches fabrics from all around by their occlusion textures.
void occlude(const ShadingScene& scene, ShadedBlock& shaded) {
  const PixelPlaces& block = shaded.places;
  for (std::size_t lane = 0; lane < block.count; ++lane) {
    if (!scene.materials[block.surface[lane]].occluded) continue;
    const float occlusion = pbr_values(block.pbr[lane]).occlusion;
    for (LaneLight& light : shaded.lights) {
      if (light.of_environment && scene.shadows.empty()) light.share[lane] *= occlusion;
    }
    if (scene.around == nullptr) continue;
    const float left =
        std::min(1.0F, occlusion / std::max(share_around(scene, shaded, lane, V3f(0, 0, 1)), 1e-3F));
    for (LaneColours& factor : shaded.around.factors) {
      for (LaneFloats& colour : factor) colour[lane] *= left;
    }
  }
}

bool is_one_surface(const PixelPlaces& block) {
  return std::all_of(block.surface.begin() + 1,
                     block.surface.begin() + static_cast<std::ptrdiff_t>(block.count),
                     [&](std::uint32_t surface) { return surface == block.surface[0]; });
}

/// The block's texels without texels of other fabrics, and of other sides.
std::span<const LaneTexels> texels_of(const ShadingScene& scene, const PixelBlock& block,
                                      const PackedFabric* fabric, std::vector<LaneTexels>& texels) {
  texels.assign(block.texels.begin(), block.texels.begin() + static_cast<std::ptrdiff_t>(block.texel_count));
  for (std::size_t lane = 0; lane < block.count; ++lane) {
    if (seen_fabric(scene, block, lane) == fabric) continue;
    for (LaneTexels& list : texels) list.weight[lane] = 0;
  }
  return texels;
}

void fill_frames(const Camera& camera, int width, int height, const PixelPlaces& block, LaneFrames& result) {
  static const auto fill = frames_for_this_processor();
  fill(view_rays(camera, width, height), block, result);
}

}  // namespace

const PackedFabric* seen_fabric(const ShadingScene& scene, const PixelPlaces& block, std::size_t lane) {
  const int fabric = scene.materials[block.surface[lane]].fabric;
  return fabric < 0 ? nullptr : &scene.fabrics[fabric].seen_from(block.side[lane]);
}

LaneFrames garment_frames(const Camera& camera, int width, int height, const PixelPlaces& block) {
  LaneFrames result;
  fill_frames(camera, width, height, block, result);
  return result;
}

V3d seen_point(const MergedSurfaces& mesh, const V3d& origin, const PixelPlaces& block, std::size_t lane) {
  const auto& corners = mesh.triangles[block.triangle[lane]].corners;
  const V3d a(mesh.positions[corners[0]]);
  const V3d b(mesh.positions[corners[1]]);
  const V3d c(mesh.positions[corners[2]]);
  return origin + a + (b - a) * static_cast<double>(block.second_corner[lane]) +
         (c - a) * static_cast<double>(block.third_corner[lane]);
}

namespace {

/// A point or spot light, which has another direction at each point of the block.
void place_light(const ShadingScene& scene, const PixelPlaces& block, const LaneFrames& frames,
                 const Light& light, LaneLight& result) {
  for (std::size_t lane = 0; lane < lane_count; ++lane) {
    const LightShare light_share = light_share_at(light, seen_point(*scene.mesh, scene.origin, block, lane));
    const V3f d(light_share.direction);
    const auto along = [&](const LaneDirections& axis) {
      return d.x * axis.x[lane] + d.y * axis.y[lane] + d.z * axis.z[lane];
    };
    result.direction.x[lane] = along(frames.tangent);
    result.direction.y[lane] = along(frames.up);
    result.direction.z[lane] = along(frames.normal);
    result.share[lane] = static_cast<float>(std::min(light_share.share, 1e24));
  }
}

/// Reduces the lights by shadows.
void cast_shadow(const ShadingScene& scene, const PixelPlaces& block, const LaneFrames& frames,
                 const ShadowMap& map, LaneLight& light) {
  for (std::size_t lane = 0; lane < block.count; ++lane) {
    // direction.z is the cosine: most fabrics show no light from behind, and a share of 0 stays 0.
    const bool behind = !(light.direction.z[lane] > 0);
    const PackedFabric* const fabric = behind ? seen_fabric(scene, block, lane) : nullptr;
    if (fabric != nullptr && !fabric->through) continue;
    const V3f tangent(frames.tangent.x[lane], frames.tangent.y[lane], frames.tangent.z[lane]);
    const V3f up(frames.up.x[lane], frames.up.y[lane], frames.up.z[lane]);
    const V3f normal(frames.normal.x[lane], frames.normal.y[lane], frames.normal.z[lane]);
    const V3f direction =
        tangent * light.direction.x[lane] + up * light.direction.y[lane] + normal * light.direction.z[lane];
    // Transmitted light leaves the cloth on the light's side, so that it is not in its own shadow.
    light.share[lane] *=
        shadow_share(map, V3f(seen_point(*scene.mesh, scene.origin, block, lane) - scene.origin),
                     fabric != nullptr ? -normal : normal, direction);
  }
}

}  // namespace

namespace {

/// Light from all around at the block's pixels, world axes.
void gather_around(const ShadingScene& scene, const PixelPlaces& block, LaneSmoothLight& result) {
  for (std::size_t lane = 0; lane < lane_count; ++lane) {
    SmoothLight light = *scene.around;
    if (!scene.around_vertices.empty()) {
      const auto& corners = scene.mesh->triangles[block.triangle[lane]].corners;
      const std::array weights{1 - block.second_corner[lane] - block.third_corner[lane],
                               block.second_corner[lane], block.third_corner[lane]};
      light = {};
      for (std::size_t corner = 0; corner < 3; ++corner) {
        const SmoothLight& there = scene.around_vertices[corners[corner]];
        for (std::size_t k = 0; k < smooth_functions; ++k)
          light.factors[k] += there.factors[k] * weights[corner];
      }
    }
    for (std::size_t k = 0; k < smooth_functions; ++k) {
      for (std::size_t c = 0; c < 3; ++c) result.factors[k][c][lane] = light.factors[k][static_cast<int>(c)];
    }
  }
}

}  // namespace

void shade_texels(const ShadingScene& scene, const PixelBlock& block, ShadingScratch& scratch,
                  ShadedBlock& result) {
  static const auto light_lanes = light_lanes_for_this_processor();
  result.places = block;
  LaneFrames& frames = result.frames;
  fill_frames(scene.camera, scene.width, scene.height, block, frames);
  std::vector<LaneLight>& lights = result.lights;
  lights.resize(scene.lights.size());
  for (std::size_t i = 0; i < scene.lights.size(); ++i) {
    lights[i].irradiance = scene.lights[i].irradiance;
    lights[i].of_environment = scene.lights[i].of_environment;
    if (scene.lights[i].kind != LightKind::directional && scene.mesh != nullptr) {
      place_light(scene, block, frames, scene.lights[i], lights[i]);
      continue;
    }
    light_lanes(frames, V3f(scene.lights[i].direction), lights[i].direction);
    lights[i].share.fill(1);
  }
  for (const ShadowMap& map : scene.shadows) cast_shadow(scene, block, frames, map, lights[map.view.light]);
  if (scene.around != nullptr) {
    static const auto turn = turn_lanes_for_this_processor();
    gather_around(scene, block, result.around);
    turn(frames, result.around);
  }
  occlude(scene, result);
  const LaneSmoothLight* around = scene.around != nullptr ? &result.around : nullptr;
  LaneShading& light = result.light;
  light = {};
  std::array<const PackedFabric*, lane_count> seen{};
  for (std::size_t lane = 0; lane < block.count; ++lane) seen[lane] = seen_fabric(scene, block, lane);
  const auto end = seen.begin() + static_cast<std::ptrdiff_t>(block.count);
  for (auto of = seen.begin(); of != end; ++of) {
    if (*of == nullptr || std::find(seen.begin(), of, *of) != of) continue;
    const bool all =
        std::all_of(seen.begin(), end, [&](const PackedFabric* fabric) { return fabric == *of; });
    evaluate_lanes(**of,
                   all ? std::span<const LaneTexels>(block.texels).first(block.texel_count)
                       : texels_of(scene, block, *of, scratch.texels),
                   frames.view, lights, scratch.lanes, light, around);
  }
}

void add_cells(const ShadingScene& scene, ShadedBlock& shaded) {
  const PixelPlaces& block = shaded.places;
  if (!block.shows_yarn || scene.cells == nullptr) return;
  CellPixels pixels;
  for (std::size_t lane = 0; lane < lane_count; ++lane) {
    const bool shows = lane < block.count && block.yarn[lane] > 0;
    pixels.surface[lane] =
        shows ? 2 * block.triangle[lane] + (block.side[lane] < 0 ? 1 : 0) : scene.cells->nothing();
  }
  pixels.x = block.from_middle_x;
  pixels.y = block.from_middle_y;
  CellShading cells;
  scene.cells->look(pixels, cells);
  for (std::size_t lane = 0; lane < block.count; ++lane) {
    if (!(block.yarn[lane] > 0)) continue;
    const V4f value = cells.at(lane) * block.yarn[lane];
    shaded.light.red[lane] += value.x;
    shaded.light.green[lane] += value.y;
    shaded.light.blue[lane] += value.z;
    shaded.light.alpha[lane] += value.w;
  }
}

void finish_light(const ShadingScene& scene, ShadedBlock& shaded) {
  static const auto finish = finish_for_this_processor();
  const PixelPlaces& block = shaded.places;
  LaneShading& light = shaded.light;
  const auto material_of = [&](std::size_t lane) -> const SurfaceMaterial& {
    return scene.materials[block.surface[lane]];
  };
  const bool one_surface = is_one_surface(block);
  alignas(64) LaneFloats keeps_opacity{};
  if (one_surface) {
    keeps_opacity.fill(material_of(0).keeps_opacity ? 1.0F : 0.0F);
  } else {
    for (std::size_t lane = 0; lane < block.count; ++lane)
      keeps_opacity[lane] = material_of(lane).keeps_opacity ? 1.0F : 0.0F;
  }
  finish(keeps_opacity, light);
  if (one_surface && material_of(0).fabric >= 0 && !material_of(0).tinted &&
      !has_emission(scene, block.surface[0]))
    return;
  LaneShading pbr;
  bool any_pbr = false;
  for (std::size_t lane = 0; lane < block.count; ++lane) any_pbr |= material_of(lane).fabric < 0;
  if (any_pbr) shade_pbr(scene, shaded, pbr);
  for (std::size_t lane = 0; lane < block.count; ++lane) {
    if (material_of(lane).fabric < 0) {
      const float alpha = std::clamp(block.pbr[lane].colour.w, 0.0F, 1.0F);
      set(light, lane, V3f(pbr.red[lane], pbr.green[lane], pbr.blue[lane]) * alpha, alpha);
    } else {
      V3f radiance(light.red[lane], light.green[lane], light.blue[lane]);
      const V4f& tint = block.pbr[lane].colour;
      if (material_of(lane).tinted) radiance *= V3f(tint.x, tint.y, tint.z);
      if (has_emission(scene, block.surface[lane]))
        radiance += pbr_values(block.pbr[lane]).emission * light.alpha[lane];
      set(light, lane, radiance, light.alpha[lane]);
    }
  }
}

const LaneShading& shade(const ShadingScene& scene, const PixelBlock& block, ShadingScratch& scratch) {
  shade_texels(scene, block, scratch, scratch.block);
  add_cells(scene, scratch.block);
  finish_light(scene, scratch.block);
  return scratch.block.light;
}

}  // namespace selvedge
