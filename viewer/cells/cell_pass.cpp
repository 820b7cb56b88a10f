#include "viewer/cells/cell_pass.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <cstring>

#include "format/base/parallel.h"
#include "format/fabric/lifted.h"

namespace selvedge {
namespace {

/// Smaller fractions of a light are not seen.
constexpr float unseen_visibility = 1.0F / 256;
constexpr std::size_t chunk = 2048;
/// Bound on a triangle's curvature, as a multiple of the largest along its edges.
constexpr float max_bend = 1.5F;
/// Whole repeats of a triangle from the origin, at most.
constexpr float max_whole = 1e9F;

/// Calls body(i) for the flags that are set; mostly few are.
template <class Body>
void for_each_set(const std::vector<std::uint8_t>& flags, const Body& body) {
  for (std::size_t i = 0; i < flags.size(); i += sizeof(std::uint64_t)) {
    std::uint64_t some = 0;
    const std::size_t end = std::min(i + sizeof some, flags.size());
    std::memcpy(&some, &flags[i], end - i);
    for (std::size_t k = i; some != 0 && k < end; ++k)
      if (flags[k] != 0) body(static_cast<std::uint32_t>(k));
  }
}

/// Bit of a light in masks (CellLights).
std::uint32_t bit_of(std::size_t light) { return light < 32 ? 1U << light : 0; }

/// Fraction of a light that reaches a vertex, on the light's side of the cloth.
float visibility_at(const CellLights& lights, const ShadowMap& map, const V3f& point, V3f normal) {
  const Light& light = lights.lights[map.view.light];
  const V3f direction(illumination_at(light, lights.origin + V3d(point)).direction);
  if (normal.dot(direction) < 0) normal = -normal;
  return shadow_visibility(map, point, normal, direction);
}

}  // namespace

CellPass::CellPass(const PreparedScene& scene)
    : scene_(scene), store_(scene.mesh, scene.materials.surfaces, scene.fabrics, scene.origin) {
  const MergedSurfaces& mesh = scene.mesh;
  // One more for nothing().
  kinds_.assign(mesh.triangles.size() + 1, Kind::none);
  uneven_.resize(kinds_.size());
  if (store_.patches().empty()) return;
  transmitted_.resize(mesh.positions.size());
  planes_.resize(mesh.triangles.size() + 1);
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    if (store_.patches().place(static_cast<std::uint32_t>(i)).chart < 0) continue;
    const std::uint32_t surface = mesh.triangles[i].surface;
    const SurfaceMaterial& m = scene.materials.surfaces[surface];
    kinds_[i] = m.is_modified() || scene.materials.emits(surface) ? Kind::changed : Kind::plain;
    for (const std::uint32_t corner : mesh.triangles[i].corners)
      transmitted_[corner] = store_.transmitted_fraction(m.fabric);
  }
  thickness_.resize(scene.fabrics.size());
  for (std::size_t i = 0; i < scene.fabrics.size(); ++i) {
    const Fabric& front = *scene.fabrics[i].front;
    if (const auto& yarns = front.levels.front().yarns())
      thickness_[i] = std::max(front.reference_height - yarns->geometry().min_z, 0.0F);
  }
  outline_rises_.resize(mesh.triangles.size());
  extents_.resize(mesh.triangles.size());
  seen_.resize(mesh.triangles.size());
  seen_patches_.resize(2 * store_.patches().count());
  numbers_.resize(seen_patches_.size());
  calls_.resize(seen_patches_.size());
  parallel_each(mesh.triangles.size(), chunk, [&](std::size_t i) {
    outline_rises_[i] = outline_rise(i);
    extents_[i] = store_.patches().extent(mesh, i);
  });
}

void CellPass::update_shape() {
  if (store_.patches().empty()) return;
  store_.update_shape(scene_.origin);
  brightness_.clear();
  parallel_each(outline_rises_.size(), chunk, [&](std::size_t i) { outline_rises_[i] = outline_rise(i); });
}

void CellPass::begin(const FrameView& view, bool shows, int supersample, const ProjectedVertices& projected) {
  active_ = shows && !store_.patches().empty();
  if (!active_) return;
  // Images that later frames show again are whole, and small ones are not worth the search for parts.
  has_parts_ = view.options.blocks != nullptr || (!view.options.cells.is_moving && store_.has_large_cells());
  if (has_parts_) seen_parts_.resize(seen_patches_.size());
  lights_ = {view.options.lights, view.shadows,
             view.options.smooth_light ? &*view.options.smooth_light : nullptr, view.vertex_lights,
             scene_.origin};
  projected_ = &projected;
  camera_ = &view.camera;
  mapped_ = 0;
  for (const ShadowMap& map : view.shadows) mapped_ |= bit_of(map.view.light);
  nearest_ = view.options.levels.forced_level >= 0;
  middle_x_ = 0.5F * static_cast<float>(projected.width) - 0.5F;
  middle_y_ = 0.5F * static_cast<float>(projected.height) - 0.5F;
  store_.begin({.camera = view.camera,
                .size = V2i(projected.width, projected.height),
                .options = view.options,
                .supersample = supersample,
                .lights = lights_,
                .is_economical = true});
  light_vertices();
  const MergedSurfaces& mesh = scene_.mesh;
  slopes_.resize(mesh.positions.size());
  parallel_each(slopes_.size(), chunk, [&](std::size_t i) {
    const auto vertex = static_cast<std::uint32_t>(i);
    const V3f viewer = to_viewer(mesh.positions[i]);
    const V3f normal = mesh.normal(vertex);
    const V3f tangent = (mesh.tangent(vertex) - normal * normal.dot(mesh.tangent(vertex))).normalized();
    const float facing = normal.dot(viewer);
    const float rise = std::max(std::abs(facing), min_ray_rise);
    slopes_[i] = {tangent.dot(viewer) / rise, normal.cross(tangent).dot(viewer) / rise, facing};
  });
  // Marks of large triangles and of parts need planes; others get them once they are seen.
  parallel_each(extents_.size(), chunk, [&](std::size_t i) {
    if (has_parts_ || extents_[i].is_large()) set_planes(i);
  });
}

/// Whether a triangle is wide compared with its distance to a point light or a spot, or texels lie across a
/// terminator.
bool CellPass::is_lit_unevenly(std::size_t triangle) const {
  const auto& corners = scene_.mesh.triangles[triangle].corners;
  const auto corner = [&](std::size_t k) { return scene_.mesh.positions[corners[k]]; };
  const auto normal = [&](std::size_t k) { return scene_.mesh.normal(corners[k]); };
  const float wide = std::max(
      {(corner(1) - corner(0)).length(), (corner(2) - corner(1)).length(), (corner(0) - corner(2)).length()});
  return std::any_of(lights_.lights.begin(), lights_.lights.end(), [&](const Light& light) {
    if (light.kind == LightKind::directional) {
      const V3f d(light.direction);
      const bool faces = normal(0).dot(d) > 0;
      return transmitted_[corners[0]] == 0 &&
             (faces != (normal(1).dot(d) > 0) || faces != (normal(2).dot(d) > 0));
    }
    const V3f at(light.position - lights_.origin);
    const float near =
        std::min({(at - corner(0)).length(), (at - corner(1)).length(), (at - corner(2)).length()});
    return wide > 0.1F * std::max(near - wide, 0.0F);
  });
}

float CellPass::brightness_gain(TriangleSide surface, int x, int y, const V3f& normal, const V3f& point,
                                const SmoothLight* around, float environment_gain) const {
  const std::uint32_t triangle = surface / 2;
  const auto& c = planes_[triangle].coefficients;
  const V2f at = offset_from_centre(x, y);
  const float by_corners =
      (c[2][1] * at.x + c[2][2] * at.y + c[2][3]) / (c[0][0] * at.x + c[0][1] * at.y + c[0][2]);
  const CellLook& image = store_.look(2 * patch_at(triangle, place_at(triangle, at)) + surface % 2);
  const float transmitted = transmitted_[scene_.mesh.triangles[triangle].corners[0]];
  const float bright = lights_.brightness(normal, point, around, transmitted, environment_gain);
  constexpr float max_gain = 8;
  const float applied = std::clamp(by_corners * image.inverse_brightness, image.min_gain, image.max_gain);
  const float ratio = std::clamp(bright * image.inverse_brightness, 0.0F, max_gain) / applied;
  return ratio >= 0 ? ratio : 1;
}

/// Change of the normal of the front, and mm of yarn, along an edge of a triangle.
CellPass::Edge CellPass::edge(std::size_t triangle, std::size_t from, std::size_t to) const {
  const MergedSurfaces& mesh = scene_.mesh;
  const auto& corners = mesh.triangles[triangle].corners;
  const SurfaceMaterial& material = scene_.materials.surfaces[mesh.triangles[triangle].surface];
  const V2f period = scene_.fabrics[material.fabric].front->levels.front().yarns()->repeat();
  return {mesh.positions[corners[to]] - mesh.positions[corners[from]],
          mesh.normal(corners[to]) - mesh.normal(corners[from]),
          (mesh.uv(corners[to]) - mesh.uv(corners[from])) * period};
}

/// The least cosine to the viewer from which on rays that enter a triangle's yarn do not leave it again.
float CellPass::outline_rise(std::size_t triangle) const {
  if (kinds_[triangle] == Kind::none) return 0;
  const SurfaceMaterial& material = scene_.materials.surfaces[scene_.mesh.triangles[triangle].surface];
  const float thickness = thickness_[material.fabric];
  if (thickness == 0 || !material.keeps_opacity) return 0;
  float bend = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const Edge e = edge(triangle, k, (k + 1) % 3);
    const float length = e.along.length() * e.yarn.length();
    if (length > 0) bend = std::max(bend, e.turn.dot(e.along) / length);
  }
  return std::sqrt(std::min(2 * max_bend * bend * thickness, 0.5F));
}

/// How far below its plane yarn is met at a pixel where cloth bends away, mm: a ray leaves a parabola again.
float CellPass::outline_depth(std::uint32_t triangle, float x, float y) const {
  const Surface surface = surface_at(triangle, x, y);
  const V3f view = to_viewer(surface.point);
  const float rise = surface.normal.dot(view);
  if (std::abs(rise) > outline_rises_[triangle]) return HUGE_VALF;
  const V3f level = view - surface.normal * rise;
  const Edge a = edge(triangle, 0, 1);
  const Edge b = edge(triangle, 0, 2);
  const V3f area = a.along.cross(b.along);
  const V2f weights = V2f(level.cross(b.along).dot(area), a.along.cross(level).dot(area)) / area.length2();
  const float bend = (a.turn * weights.x + b.turn * weights.y).dot(level) /
                     (level.length() * (a.yarn * weights.x + b.yarn * weights.y).length());
  if (!(bend > 0)) return HUGE_VALF;
  const float thickness =
      thickness_[scene_.materials.surfaces[scene_.mesh.triangles[triangle].surface].fabric];
  return 0.5F * rise * rise / (level.length2() * std::min(bend, 0.25F / thickness));
}

/// Samples the fraction of a light within a triangle that is larger than shadows may be.
void CellPass::add_inner_visibility(const ShadowMap& map, std::size_t triangle) {
  constexpr float shadow_texels_per_pixel = 32;
  constexpr int max_parts = 64;
  const MergedSurfaces& mesh = scene_.mesh;
  const auto& corners = mesh.triangles[triangle].corners;
  const V3f a = mesh.positions[corners[0]];
  const V3f b = mesh.positions[corners[1]] - a;
  const V3f c = mesh.positions[corners[2]] - a;
  const float longest = std::max({b.length(), c.length(), (b - c).length()});
  const int parts = std::clamp(
      static_cast<int>(longest / (shadow_texels_per_pixel * map.view.texel_cell_size)), 1, max_parts);
  for (int i = 0; i <= parts && parts > 1; ++i) {
    for (int j = 0; j <= parts - i; ++j) {
      const V2f at(static_cast<float>(i) / static_cast<float>(parts),
                   static_cast<float>(j) / static_cast<float>(parts));
      const V3f normal = mesh.normal(corners[0]) * (1 - at.x - at.y) + mesh.normal(corners[1]) * at.x +
                         mesh.normal(corners[2]) * at.y;
      const float fraction = visibility_at(lights_, map, a + b * at.x + c * at.y, normal.normalized());
      if (fraction > unseen_visibility) lit_by_[triangle].lit |= bit_of(map.view.light);
      if (fraction < 1 - unseen_visibility) lit_by_[triangle].unlit |= bit_of(map.view.light);
    }
  }
}

/// Brightness and shadows at the vertices, where lights have changed.
void CellPass::light_vertices() {
  const bool same_lights = !brightness_.empty() && std::ranges::equal(known_lights_, lights_.lights);
  std::vector<SmoothLight> around(lights_.vertex_lights.begin(), lights_.vertex_lights.end());
  if (around.empty() && lights_.smooth_light != nullptr) around.push_back(*lights_.smooth_light);
  std::vector<ShadowView> views;
  for (const ShadowMap& map : lights_.shadows) views.push_back(map.view);
  const MergedSurfaces& mesh = scene_.mesh;
  if (!same_lights || around != known_around_) {
    brightness_.resize(mesh.positions.size());
    parallel_each(mesh.positions.size(), chunk, [&](std::size_t i) {
      const SmoothLight* const there = around.empty()       ? nullptr
                                       : around.size() == 1 ? around.data()
                                                            : &around[i];
      const V3f normal = mesh.normal(static_cast<std::uint32_t>(i));
      brightness_[i] = {lights_.brightness(normal, mesh.positions[i], there, transmitted_[i]),
                        lights_.brightness(-normal, mesh.positions[i], there, transmitted_[i])};
    });
    parallel_each(mesh.triangles.size(), chunk,
                  [&](std::size_t i) { uneven_[i] = is_lit_unevenly(i) ? 1 : 0; });
  }
  if (!same_lights || views != known_views_) {
    std::vector<LitBy> of_vertices(mesh.positions.size());
    parallel_each(of_vertices.size(), chunk, [&](std::size_t i) {
      for (const ShadowMap& map : lights_.shadows) {
        const float fraction =
            visibility_at(lights_, map, mesh.positions[i], mesh.normal(static_cast<std::uint32_t>(i)));
        if (fraction > unseen_visibility) of_vertices[i].lit |= bit_of(map.view.light);
        if (fraction < 1 - unseen_visibility) of_vertices[i].unlit |= bit_of(map.view.light);
      }
    });
    lit_by_.assign(mesh.triangles.size(), {});
    parallel_each(lit_by_.size(), chunk, [&](std::size_t i) {
      for (const std::uint32_t corner : mesh.triangles[i].corners) {
        lit_by_[i].lit |= of_vertices[corner].lit;
        lit_by_[i].unlit |= of_vertices[corner].unlit;
      }
      for (const ShadowMap& map : lights_.shadows) add_inner_visibility(map, i);
    });
  }
  known_lights_.assign(lights_.lights.begin(), lights_.lights.end());
  known_views_ = std::move(views);
  known_around_ = std::move(around);
}

V3f CellPass::to_viewer(const V3f& point) const {
  return camera_->projection == Projection::parallel
             ? V3f(camera_->to_viewer)
             : (V3f(camera_->position - scene_.origin) - point).normalized();
}

/// Homogeneous coordinates, as in the index pass: correct in perspective and for corners behind the viewer.
void CellPass::set_planes(std::size_t i) {
  const MergedSurfaces& mesh = scene_.mesh;
  if (kinds_[i] == Kind::none) return;
  const auto& corners = mesh.triangles[i].corners;
  std::array<V3d, 3> p;
  for (std::size_t k = 0; k < 3; ++k) {
    const Group& g = projected_->screen[corners[k]];
    p[k] = V3d(g[0], g[1], g[2]);
  }
  const std::array edges{p[1].cross(p[2]), p[2].cross(p[0]), p[0].cross(p[1])};
  const double det = p[0].dot(edges[0]);
  const double scale = std::abs(det) > 1e-30 ? 1 / det : 0;
  const std::size_t side = det < 0 ? 1 : 0;
  const Patches& patches = store_.patches();
  const V2f first = patches.place(mesh, i, 0);
  const V2f whole(std::floor(first.x), std::floor(first.y));
  std::array<V3d, 6> sums;
  sums.fill(V3d(0, 0, 0));
  for (std::size_t k = 0; k < 3; ++k) {
    const V2f uv = patches.place(mesh, i, k) - whole;
    const V3d edge = edges[k] * scale;
    sums[0] += edge;
    sums[1] += edge * static_cast<double>(uv.x);
    sums[2] += edge * static_cast<double>(uv.y);
    sums[3] += edge * static_cast<double>(brightness_[corners[k]][side]);
    sums[4] += edge * static_cast<double>(slopes_[corners[k]].x);
    sums[5] += edge * static_cast<double>(slopes_[corners[k]].y * mesh.triangles[i].handedness);
  }
  std::array<float, 20> flat{};
  for (std::size_t k = 0; k < 18; ++k) flat[k] = static_cast<float>(sums[k / 3][static_cast<int>(k % 3)]);
  const V2f lacking = mesh.triangles[i].whole_repeats * patches.repeats_per_uv(i);
  const V2f from_origin = whole + V2f(std::floor(lacking.x), std::floor(lacking.y));
  flat[18] = std::clamp(from_origin.x, -max_whole, max_whole);
  flat[19] = std::clamp(from_origin.y, -max_whole, max_whole);
  std::memcpy(planes_[i].coefficients.data(), flat.data(), sizeof flat);
  const auto [low, high] = std::minmax({slopes_[corners[0]].z, slopes_[corners[1]].z, slopes_[corners[2]].z});
  planes_[i].at_outline = low < outline_rises_[i] && high > -outline_rises_[i];
  planes_[i].place = store_.patches().place(static_cast<std::uint32_t>(i));
}

CellPass::Surface CellPass::surface_at(std::uint32_t triangle, float x, float y) const {
  const auto& corners = scene_.mesh.triangles[triangle].corners;
  std::array<V2f, 3> p;
  for (std::size_t k = 0; k < 3; ++k) {
    const Group& g = projected_->screen[corners[k]];
    p[k] = {g[0] - x * g[2], g[1] - y * g[2]};
  }
  const std::array w{p[1].cross(p[2]), p[2].cross(p[0]), p[0].cross(p[1])};
  const float sum = w[0] + w[1] + w[2];
  Surface surface{V3f(0, 0, 0), V3f(0, 0, 0)};
  for (std::size_t k = 0; k < 3; ++k) {
    const float fraction = sum != 0 ? w[k] / sum : 1.0F / 3;
    surface.point += scene_.mesh.positions[corners[k]] * fraction;
    surface.normal += scene_.mesh.normal(corners[k]) * fraction;
  }
  surface.normal.normalize();
  return surface;
}

float CellPass::visibility_of(std::size_t light, std::uint32_t triangle, float x, float y) const {
  if ((mapped_ & bit_of(light)) == 0) return 1;
  const LitBy& lit_by = lit_by_[triangle];
  if ((lit_by.lit & bit_of(light)) == 0) return 0;
  if ((lit_by.unlit & bit_of(light)) == 0) return 1;
  for (const ShadowMap& map : lights_.shadows) {
    if (map.view.light != light) continue;
    const Surface surface = surface_at(triangle, x, y);
    return visibility_at(lights_, map, surface.point, surface.normal);
  }
  return 1;
}

void CellPass::mark_visible(TriangleSide surface, int x, int y) {
  const std::uint32_t triangle = surface / 2;
  const auto mark = [](std::uint8_t& flag, std::uint8_t bit) {
    const std::atomic_ref<std::uint8_t> bits(flag);
    if ((bits.load(std::memory_order_relaxed) & bit) == 0) bits.fetch_or(bit, std::memory_order_relaxed);
  };
  const bool is_large = extents_[triangle].is_large();
  if (!is_large) mark(seen_[triangle], surface % 2 == 0 ? 1 : 2);
  if (!is_large && !has_parts_) return;
  const V2f place = place_at(triangle, offset_from_centre(x, y));
  if (is_large) mark(seen_patches_[2 * patch_at(triangle, place) + surface % 2], 1);
  if (has_parts_) mark_parts(surface, place);
}

/// Notes the parts of repeats that a pixel at a place looks up: there, and where variation moves it.
void CellPass::mark_parts(TriangleSide surface, const V2f& place) {
  const std::uint32_t triangle = surface / 2;
  const auto mark = [&](std::uint32_t patch, const V2f& within) {
    RepeatParts parts = 0;
    for (int axis = 0; axis < 2; ++axis)
      parts |= RepeatParts{1} << (parts_per_side * axis +
                                  std::clamp(static_cast<int>(parts_per_side * within[axis]), 0,
                                             parts_per_side - 1));
    std::atomic_ref<RepeatParts>(seen_parts_[2 * patch + surface % 2])
        .fetch_or(parts, std::memory_order_relaxed);
  };
  const V2f whole(std::floor(place.x), std::floor(place.y));
  const std::uint32_t patch = patch_at(triangle, place);
  mark(patch, place - whole);
  const Group& wholes = planes_[triangle].coefficients[4];
  const V2i repeat(V2f(wholes[2], wholes[3]) + whole);
  const RepeatPlace moved = store_.lookup_place(2 * patch + surface % 2, {repeat, place - whole});
  mark(store_.patches().is_part(patch)
           ? patch_at(triangle, V2f(moved.repeat - repeat) + whole + moved.fraction)
           : patch,
       moved.fraction);
}

V2f CellPass::place_at(std::uint32_t triangle, const V2f& pixel) const {
  const auto& c = planes_[triangle].coefficients;
  const float sum = c[0][0] * pixel.x + c[0][1] * pixel.y + c[0][2];
  const float inverse = sum != 0 ? 1 / sum : 0;
  const auto at = [&](float a, float b, float d) {
    const float place = (a * pixel.x + b * pixel.y + d) * inverse;
    return std::isfinite(place) ? std::clamp(place, -1e8F, 1e8F) : 0;
  };
  return {at(c[0][3], c[1][0], c[1][1]), at(c[1][2], c[1][3], c[2][0])};
}

std::uint32_t CellPass::patch_at(std::uint32_t triangle, const V2f& place) const {
  const Patches& patches = store_.patches();
  const auto unit = [&](float x) {
    return patches.unit_at(static_cast<int>(std::floor(x)), x - std::floor(x));
  };
  return patches.patch_at(patches.place(triangle), unit(place.x), unit(place.y));
}

/// A patch that only shows through holes shares the image of a larger one; if memory is short, of an
/// ancestor `coarsening` levels up; if time is, of one with an image.
PatchNeed& CellPass::request(PatchSide patch, bool behind, int coarsening) {
  const PatchSide own = patch;
  const int levels = coarsening + (behind && !store_.is_made(patch) ? 1 : 0);
  for (int i = 0; i < levels || store_.is_late(patch); ++i) patch = store_.patches().parent_side(patch);
  if (patch != own) shared_.push_back({own, patch});
  if (calls_[patch] != call_) {
    calls_[patch] = call_;
    numbers_[patch] = static_cast<std::uint32_t>(needs_.size());
    needs_.push_back({patch, 0, 0, has_parts_ ? 0 : whole_repeat});
  }
  PatchNeed& need = needs_[numbers_[patch]];
  if (has_parts_) need.parts |= seen_parts_[own];
  return need;
}

void CellPass::render(bool behind) {
  if (!active_) return;
  if (!has_parts_) {
    std::vector<std::uint32_t> seen;
    for_each_set(seen_, [&](std::uint32_t i) { seen.push_back(i); });
    parallel_each(seen.size(), chunk, [&](std::size_t i) { set_planes(seen[i]); });
  }
  for (CellAnswer answer{false}; !answer.is_made;) {
    collect(behind, answer.coarsening);
    answer = store_.make({needs_, behind, answer.coarsening});
  }
  for (const auto& [patch, other] : shared_) store_.share_look(patch, other);
  std::ranges::fill(seen_, 0);
  std::ranges::fill(seen_patches_, 0);
  if (has_parts_) std::ranges::fill(seen_parts_, 0);
}

/// The patches that seen pixels need.
void CellPass::collect(bool behind, int coarsening) {
  ++call_;
  needs_.clear();
  shared_.clear();
  const std::uint32_t always = ~mapped_;
  const Patches& patches = store_.patches();
  const auto is_looked_up = [&](PatchSide patch) { return !has_parts_ || seen_parts_[patch] != 0; };
  for_each_set(seen_, [&](std::uint32_t i) {
    patches.for_each_patch(patches.place(i), extents_[i], [&](std::uint32_t patch) {
      for (std::uint32_t side = 0; side < 2; ++side) {
        if ((seen_[i] >> side & 1) == 0 || !is_looked_up(2 * patch + side)) continue;
        PatchNeed& patch_need = request(2 * patch + side, behind, coarsening);
        patch_need.lit |= always | lit_by_[i].lit;
        patch_need.unlit |= lit_by_[i].unlit;
      }
    });
  });
  for_each_set(seen_patches_, [&](std::uint32_t i) {
    PatchNeed& patch_need = request(i, behind, coarsening);
    patch_need.lit = ~0U;
    patch_need.unlit = mapped_;
  });
  if (behind || coarsening > 0) return;
  for (std::size_t k = 0, count = needs_.size(); k < count; ++k) {
    const PatchNeed need = needs_[k];
    if (!store_.needs_neighbours(need.patch)) continue;
    store_.patches().for_each_neighbour(need.patch / 2, [&](std::uint32_t other) {
      if (!is_looked_up(2 * other + need.patch % 2)) return;
      PatchNeed& patch_need = request(2 * other + need.patch % 2, behind, coarsening);
      patch_need.lit |= need.lit;
      patch_need.unlit |= need.unlit;
    });
  }
}

}  // namespace selvedge
