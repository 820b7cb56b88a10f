#include "viewer/light/shadow_maps.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <set>

#include "format/base/parallel.h"
#include "format/gltf/memory.h"
#include "format/simd/wide_float.h"

namespace selvedge {
namespace {

/// Directions over the sphere, in pairs: one picture of the scene has the depths for a direction and for its
/// opposite.
constexpr int direction_count = 48;
constexpr int sky_size = 512;
constexpr std::size_t vertices_per_task = 1024;

/// Halvings of a mask.
int halvings_of(const MaterialPicture& picture) {
  constexpr int largest = 1024;
  int halvings = 0;
  while (std::max(picture.size.x, picture.size.y) >> halvings > largest) ++halvings;
  return halvings;
}

/// The picture of the mask of a surface's fabric, or -1.
int mask_of(const Materials& materials, std::size_t surface) {
  const int image = materials.pbr[surface].metallic_roughness_texture.image;
  return materials.surfaces[surface].fabric >= 0 && image >= 0 && materials.pictures[image].bytes ? image
                                                                                                  : -1;
}

/// A triangle in a map, by linear functions of a texel's (x, y, 1): the corners' weights times a common
/// factor, all positive within it, and the depth. (Olano and Greer 1997, where corners may lie behind a
/// spot.)
struct MapTriangle {
  std::array<V3d, 3> weights;
  std::array<double, 3> inverse{};  ///< of -weights.x
  V3d depth{0, 0, 0};
  int first_row = 0, last_row = -1;

  MapTriangle(const std::array<V4f, 3>& corners, int size) {
    std::array<V3d, 3> p;
    double low = HUGE_VAL;
    double high = -HUGE_VAL;
    bool is_in_front = false;
    for (std::size_t k = 0; k < 3; ++k) {
      const double w = static_cast<double>(corners[k].w);
      // From the middle of the first texel.
      p[k] = V3d(static_cast<double>(corners[k].x) - 0.5 * w, static_cast<double>(corners[k].y) - 0.5 * w, w);
      low = std::min(low, w > 0 ? p[k].y / w : -HUGE_VAL);
      high = std::max(high, w > 0 ? p[k].y / w : HUGE_VAL);
      is_in_front |= w > 0;
    }
    const double det = p[0].dot(p[1].cross(p[2]));
    if (!is_in_front || !std::isnormal(det)) return;
    for (std::size_t k = 0; k < 3; ++k) {
      weights[k] = p[(k + 1) % 3].cross(p[(k + 2) % 3]) / det;
      inverse[k] = weights[k].x == 0 ? 0 : -1 / weights[k].x;
      depth += weights[k] * static_cast<double>(corners[k].z);
    }
    first_row = static_cast<int>(std::clamp(std::ceil(low), 0.0, static_cast<double>(size)));
    last_row = static_cast<int>(std::clamp(std::floor(high), -1.0, size - 1.0));
  }

  /// The first and the last texel of a row whose middles the triangle covers.
  std::array<int, 2> texels(int y, int size) const {
    double first = 0;
    double last = size - 1;
    for (std::size_t k = 0; k < 3; ++k) {
      const double at_row = weights[k].y * y + weights[k].z;
      if (weights[k].x > 0)
        first = std::max(first, at_row * inverse[k]);
      else if (weights[k].x < 0)
        last = std::min(last, at_row * inverse[k]);
      else if (at_row < 0)
        last = -1;
    }
    if (!(first <= last)) return {0, -1};
    return {static_cast<int>(std::ceil(first)), static_cast<int>(std::floor(last))};
  }
};

/// Lowers depths to a surface's, which begin with `depth`; 0 before the light's near plane.
template <std::size_t N>
SELVEDGE_INLINE void lower(float* depths, int count, float depth, float step) {
  using Wide = WideFloat<N>;
  Wide lanes;
  for (std::size_t k = 0; k < N; ++k) lanes.v[k] = static_cast<float>(k);
  const auto at = [&](int i) { return Wide(depth) + Wide(step) * (lanes + Wide(static_cast<float>(i))); };
  int i = 0;
  for (; i + static_cast<int>(N) <= count; i += static_cast<int>(N))
    min(max(at(i), Wide(0)), Wide::load(depths + i)).store(depths + i);
  for (; i < count; ++i)
    depths[i] = std::min(depths[i], std::max(depth + step * static_cast<float>(i), 0.0F));
}
SELVEDGE_THREE_BODIES(lower, (float* depths, int count, float depth, float step),
                      (depths, count, depth, step))

}  // namespace

bool Occluders::Mask::cuts(const V2f& uv) const {
  const auto texel = [](float x, Wrap wrap, int size) {
    if (wrap == Wrap::clamp) return std::clamp(static_cast<int>(x * static_cast<float>(size)), 0, size - 1);
    x -= (wrap == Wrap::mirror ? 2.0F : 1.0F) * std::floor(wrap == Wrap::mirror ? 0.5F * x : x);
    return std::clamp(static_cast<int>((x > 1 ? 2 - x : x) * static_cast<float>(size)), 0, size - 1);
  };
  const std::size_t y = texel(uv.y, texture.wrap_v, image->height);
  const std::size_t i = y * image->width + texel(uv.x, texture.wrap_u, image->width);
  return has_alpha(*image) && image->pixels[(i + 1) * image->channels - 1] < cutoff;
}

Occluders::Occluders(const MergedSurfaces& mesh, const Materials& materials)
    : mesh_(mesh), masks_(materials.surfaces.size()) {
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
    const SurfaceMaterial& material = materials.surfaces[mesh.triangles[i].surface];
    if (material.fabric >= 0 || !material.keeps_opacity) triangles_.push_back(i);
  }
  std::map<int, std::shared_ptr<const Image>> images;
  for (std::size_t i = 0; i < masks_.size(); ++i) {
    const int picture = mask_of(materials, i);
    if (picture < 0) continue;
    const auto [image, fresh] = images.try_emplace(picture);
    if (fresh) {
      const MaterialPicture& masks = materials.pictures[picture];
      // Without its picture, which frames report, a surface is whole.
      const std::array halvings{halvings_of(masks)};
      if (auto decoded = decode_levels(*masks.bytes, masks.name, masks.transfer, {}, halvings))
        image->second = std::make_shared<const Image>(std::move(decoded->front()));
    }
    if (image->second)
      masks_[i] = {image->second, materials.pbr[i].metallic_roughness_texture,
                   materials.surfaces[i].min_opacity};
  }
}

std::uint64_t Occluders::mask_bytes(const Materials& materials) {
  std::uint64_t pixels = 0;
  std::set<int> known;
  for (std::size_t i = 0; i < materials.surfaces.size(); ++i) {
    const int picture = mask_of(materials, i);
    if (picture < 0 || !known.insert(picture).second) continue;
    pixels += materials.pictures[picture].pixels(halvings_of(materials.pictures[picture]));
  }
  return pixels * bytes_per_texture_pixel;
}

ShadowMap Occluders::draw(const ShadowView& view, ShadowMap* opposite) const {
  const double max_work = max_overdraw * static_cast<double>(view.size) * view.size;
  ShadowMap map{view, {}};
  double done = 0;  // fraction of the triangles
  while (!draw_into(map, opposite, map.view.size > min_shadow_size ? max_work : HUGE_VAL, done)) {
    const double fitting = map.view.size * std::sqrt(done);
    do map.view = half_size_view(map.view);
    while (map.view.size > std::max<double>(fitting, min_shadow_size));
  }
  return map;
}

/// False once texels and rows of triangles are more than `max_work`.
bool Occluders::draw_into(ShadowMap& map, ShadowMap* opposite, double max_work, double& done) const {
  const ShadowView& view = map.view;
  const std::size_t size = view.size;
  map.depths.assign(size * size, 1);
  if (opposite != nullptr) {
    *opposite = map;
    V4f& row = opposite->view.rows[2];
    row = V4f(-row.x, -row.y, -row.z, 1 - row.w);
  }
  std::vector<V4f> places(mesh_.positions.size());
  std::ranges::transform(mesh_.positions, places.begin(), [&](const V3f& p) {
    return V4f(homogeneous_coordinate(view.rows[0], p), homogeneous_coordinate(view.rows[1], p),
               homogeneous_coordinate(view.rows[2], p), homogeneous_coordinate(view.rows[3], p));
  });
  double work = 0;
  for (std::size_t i = 0; i < triangles_.size(); ++i) {
    const MergedTriangle& merged = mesh_.triangles[triangles_[i]];
    const auto& [a, b, c] = merged.corners;
    const MapTriangle triangle({places[a], places[b], places[c]}, view.size);
    const std::optional<Mask>& mask = masks_[merged.surface];
    constexpr double row_work = 16;
    work += row_work * (triangle.last_row - triangle.first_row + 1);
    for (int y = triangle.first_row; y <= triangle.last_row; ++y) {
      const std::array<int, 2> texels = triangle.texels(y, view.size);
      const int first = texels[0];
      const int last = texels[1];
      work += last - first + 1;
      const double depth = triangle.depth.dot(V3d(first, y, 1));
      const auto put = [&](int x, int count) {
        const std::size_t texel = y * size + x;
        const double there = depth + triangle.depth.x * (x - first);
        const auto step = static_cast<float>(triangle.depth.x);
        lower_for_this_processor(&map.depths[texel], count, static_cast<float>(there), step);
        if (opposite != nullptr)
          lower_for_this_processor(&opposite->depths[texel], count, static_cast<float>(1 - there), -step);
      };
      if (!mask) {
        if (first <= last) put(first, last - first + 1);
        continue;
      }
      for (int x = first; x <= last; ++x) {
        V3d weights(0, 0, 0);
        for (int k = 0; k < 3; ++k) weights[k] = triangle.weights[k].dot(V3d(x, y, 1));
        weights /= weights.x + weights.y + weights.z;
        V2f uv(0, 0);
        for (int k = 0; k < 3; ++k)
          uv += mesh_.uv(merged.corners[k], mask->texture.mapping) * static_cast<float>(weights[k]);
        if (!mask->cuts(uv)) put(x, 1);
      }
    }
    if (work > max_work) {
      done = static_cast<double>(i + 1) / static_cast<double>(triangles_.size());
      return false;
    }
  }
  return true;
}

SkyVisibility sky_visibility(const MergedSurfaces& mesh, const Occluders& occluders) {
  SkyVisibility sky;
  // Points of a spiral over half of the sphere, each with the same part of it.
  for (int i = 0; i < direction_count / 2; ++i) {
    const double z = 1 - (2 * i + 1.0) / direction_count;
    const double angle = i * std::numbers::pi * (3 - std::sqrt(5.0));
    const double planar = std::sqrt(1 - z * z);
    const V3f direction(V3d(planar * std::cos(angle), planar * std::sin(angle), z));
    sky.directions.insert(sky.directions.end(), {direction, -direction});
  }
  const std::size_t count = mesh.positions.size();
  sky.fractions.resize(count * direction_count);
  parallel_for(0, direction_count / 2, [&](int pair) {
    const std::array lamp{Light{V3d(sky.directions[2 * pair])}};
    ShadowMap back;
    const ShadowMap front =
        occluders.draw(shadow_views(lamp, mesh.positions, V3d(0, 0, 0), sky_size)[0], &back);
    for (std::size_t i = 0; i < count; ++i) {
      const Group& n = mesh.attributes[i][0];
      const V3f normal(n[0], n[1], n[2]);
      for (const int side : {0, 1}) {
        const std::size_t number = 2 * pair + side;
        const V3f& d = sky.directions[number];
        const float fraction = shadow_visibility(side == 0 ? front : back, mesh.positions[i],
                                                 normal.dot(d) > 0 ? normal : -normal, d);
        sky.fractions[i * direction_count + number] = static_cast<std::uint8_t>(std::lround(fraction * 255));
      }
    }
  });
  return sky;
}

std::vector<SmoothLight> light_at_vertices(const SkyVisibility& visibility, const SmoothLight& light) {
  const std::size_t directions = visibility.directions.size();
  // The contribution of each direction to the factors.
  std::vector<SmoothLight> parts(directions);
  for (std::size_t i = 0; i < directions; ++i) {
    const V3f& d = visibility.directions[i];
    const auto basis = smooth_basis(d.x, d.y, d.z);
    V3f radiance(0, 0, 0);
    for (int k = 0; k < smooth_function_count; ++k) radiance += light.coefficients[k] * basis[k];
    const double solid_angle = 4 * std::numbers::pi / static_cast<double>(directions);
    for (int k = 0; k < smooth_function_count; ++k)
      parts[i].coefficients[k] = radiance * (basis[k] * static_cast<float>(solid_angle / smooth_norms[k]));
  }
  std::vector<SmoothLight> result(visibility.fractions.size() / directions, light);
  parallel_each(result.size(), vertices_per_task, [&](std::size_t vertex) {
    for (std::size_t i = 0; i < directions; ++i) {
      const float hidden = 1 - static_cast<float>(visibility.fractions[vertex * directions + i]) / 255;
      if (!(hidden > 0)) continue;
      for (int k = 0; k < smooth_function_count; ++k)
        result[vertex].coefficients[k] -= parts[i].coefficients[k] * hidden;
    }
  });
  return result;
}

}  // namespace selvedge
