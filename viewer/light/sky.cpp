#include "viewer/light/sky.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include "format/base/chunks.h"
#include "format/base/parallel.h"
#include "format/picture/image.h"

namespace selvedge {
namespace {

/// Directions over the sphere, in pairs: one picture of the scene has the depths for a direction and for its
/// opposite.
constexpr int direction_count = 48;
constexpr int sky_size = 512;
constexpr std::size_t vertices_per_task = 1024;

/// Points of a spiral over half of the sphere, each with the same part of it.
V3f spiral_direction(int i) {
  const double z = 1 - (2 * i + 1.0) / direction_count;
  const double angle = i * std::numbers::pi * (3 - std::sqrt(5.0));
  const double planar = std::sqrt(1 - z * z);
  return V3f(V3d(planar * std::cos(angle), planar * std::sin(angle), z));
}

/// A garment's mask, and where it cuts.
struct Mask {
  Image image;
  MaterialTexture texture;
  float cutoff = 0;
  bool cuts(const V2f& uv) const {
    const auto texel = [](float x, Wrap wrap, int size) {
      if (wrap == Wrap::clamp) return std::clamp(static_cast<int>(x * static_cast<float>(size)), 0, size - 1);
      x -= (wrap == Wrap::mirror ? 2.0F : 1.0F) * std::floor(wrap == Wrap::mirror ? 0.5F * x : x);
      return std::clamp(static_cast<int>((x > 1 ? 2 - x : x) * static_cast<float>(size)), 0, size - 1);
    };
    const std::size_t y = texel(uv.y, texture.wrap_v, image.height);
    const std::size_t i = y * image.width + texel(uv.x, texture.wrap_u, image.width);
    return has_alpha(image) && image.pixels[(i + 1) * image.channels - 1] < cutoff;
  }
};

/// Triangles that cast shadows.
struct Occluders {
  std::vector<std::uint32_t> triangles;
  std::vector<std::optional<Mask>> masks;  ///< of surfaces
};

/// As ShadowPass has them.
Occluders occluders_of(const MergedSurfaces& mesh, const Materials& materials) {
  Occluders all;
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
    const SurfaceMaterial& material = materials.surfaces[mesh.triangles[i].surface];
    if (material.fabric >= 0 || !material.keeps_opacity) all.triangles.push_back(i);
  }
  all.masks.resize(materials.surfaces.size());
  for (std::size_t i = 0; i < all.masks.size(); ++i) {
    if (!has_mask(materials, i)) continue;
    const MaterialTexture& texture = materials.pbr[i].metallic_roughness;
    Result<Image> image = decode_mask(materials.pictures[texture.image]);
    if (image) all.masks[i] = Mask{std::move(*image), texture, materials.surfaces[i].opaque_from};
  }
  return all;
}

/// Depths along a direction, row by row: of the surfaces nearest to the light, and from the other side of
/// those farthest from it.
struct Depths {
  ShadowMap front, back;
};

/// Draws triangles by their texels' middles.
Depths draw_depths(const ShadowView& view, const MergedSurfaces& mesh, const Occluders& occluders) {
  std::vector<V3f> places(mesh.positions.size());
  std::ranges::transform(mesh.positions, places.begin(), [&](const V3f& p) {
    return V3f(along(view.rows[0], p) - 0.5F, along(view.rows[1], p) - 0.5F, along(view.rows[2], p));
  });
  const std::size_t size = view.size;
  Depths depths{{view, std::vector<float>(size * size, 1)}, {view, std::vector<float>(size * size, 1)}};
  // The depth from the other side.
  V4f& row = depths.back.view.rows[2];
  row = V4f(-row.x, -row.y, -row.z, 1 - row.w);
  for (const std::uint32_t i : occluders.triangles) {
    const MergedTriangle& triangle = mesh.triangles[i];
    const V3f a = places[triangle.corners[0]];
    const V3f b = places[triangle.corners[1]] - a;
    const V3f c = places[triangle.corners[2]] - a;
    const float area = b.x * c.y - b.y * c.x;
    if (area == 0) continue;
    const auto& mask = occluders.masks[triangle.surface];
    const auto uv = [&](std::size_t k) { return mesh.uv(triangle.corners[k], mask->texture.mapping); };
    // The margin of the view keeps all of it within the map.
    const auto first = [](float x, float y, float z) {
      return static_cast<int>(std::ceil(std::min({x, y, z})));
    };
    const auto last = [](float x, float y, float z) {
      return static_cast<int>(std::floor(std::max({x, y, z})));
    };
    for (int y = first(a.y, a.y + b.y, a.y + c.y); y <= last(a.y, a.y + b.y, a.y + c.y); ++y) {
      for (int x = first(a.x, a.x + b.x, a.x + c.x); x <= last(a.x, a.x + b.x, a.x + c.x); ++x) {
        const V2f p(static_cast<float>(x) - a.x, static_cast<float>(y) - a.y);
        const float to_b = (p.x * c.y - p.y * c.x) / area;
        const float to_c = (b.x * p.y - b.y * p.x) / area;
        if (to_b < 0 || to_c < 0 || to_b + to_c > 1) continue;
        if (mask && mask->cuts(uv(0) * (1 - to_b - to_c) + uv(1) * to_b + uv(2) * to_c)) continue;
        const float depth = a.z + to_b * b.z + to_c * c.z;
        const std::size_t texel = y * size + x;
        depths.front.depths[texel] = std::min(depths.front.depths[texel], depth);
        depths.back.depths[texel] = std::min(depths.back.depths[texel], 1 - depth);
      }
    }
  }
  return depths;
}

}  // namespace

SkyVisibility sky_visibility(const MergedSurfaces& mesh, const Materials& materials) {
  SkyVisibility sky;
  for (int i = 0; i < direction_count; ++i) {
    const V3f direction = spiral_direction(i / 2);
    sky.directions.push_back(i % 2 == 0 ? direction : -direction);
  }
  const std::size_t count = mesh.positions.size();
  sky.fractions.resize(count * direction_count);
  const Occluders occluders = occluders_of(mesh, materials);
  parallel_for(0, direction_count / 2, [&](int pair) {
    const std::array lamp{Light{V3d(sky.directions[2 * pair])}};
    const Depths depths =
        draw_depths(shadow_views(lamp, mesh.positions, V3d(0, 0, 0), sky_size)[0], mesh, occluders);
    for (std::size_t i = 0; i < count; ++i) {
      const Group& n = mesh.attributes[i][0];
      const V3f normal(n[0], n[1], n[2]);
      for (const int side : {0, 1}) {
        const std::size_t number = 2 * pair + side;
        const V3f& d = sky.directions[number];
        const float fraction = shadow_visibility(side == 0 ? depths.front : depths.back, mesh.positions[i],
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
    for (int k = 0; k < smooth_functions; ++k) radiance += light.factors[k] * basis[k];
    const double solid_angle = 4 * std::numbers::pi / static_cast<double>(directions);
    for (int k = 0; k < smooth_functions; ++k)
      parts[i].factors[k] = radiance * (basis[k] * static_cast<float>(solid_angle / smooth_norms[k]));
  }
  std::vector<SmoothLight> result(visibility.fractions.size() / directions, light);
  parallel_each(result.size(), vertices_per_task, [&](std::size_t vertex) {
    for (std::size_t i = 0; i < directions; ++i) {
      const float hidden = 1 - static_cast<float>(visibility.fractions[vertex * directions + i]) / 255;
      if (!(hidden > 0)) continue;
      for (int k = 0; k < smooth_functions; ++k) result[vertex].factors[k] -= parts[i].factors[k] * hidden;
    }
  });
  return result;
}

}  // namespace selvedge
