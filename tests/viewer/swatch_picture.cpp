#include "tests/viewer/swatch_picture.h"

#include <algorithm>
#include <cmath>

#include "format/base/parallel.h"
#include "format/fabric/evaluate.h"
#include "format/fabric/footprint.h"

namespace selvedge {
namespace {

/// Width of the largest pixel among the texels of its level, which only the coarsest levels exceed.
constexpr float max_pixel_size = 3.5F;

/// A level's texels along each side that lie under one pixel.
constexpr int max_pixel_texels = 8;

/// The pixel as a parallelogram among the texels of a level, at least as wide as a texel.
struct PixelBox {
  V2f across;  ///< a pixel's coordinate to the right is across . (x, y), -1/2 to 1/2 within it
  V2f along;   ///< the same upwards
  V2f texel;   ///< size of a texel in these coordinates
  V2f reach;   ///< texels whose centres are further away have no weight
};

/// `size`: pixel_size(), in texels of the level.
PixelBox pixel_box(const TexelSlopes& slopes, float size) {
  constexpr float tiny = 1e-12F;
  const float shrink = std::min(max_pixel_size / size, 1.0F);
  // A side shorter than a texel becomes as long as one: texels are then interpolated.
  const auto lengthened = [](const V2f& side, const V2f& otherwise) {
    const float length = side.length();
    return length > tiny ? side / std::min(length, 1.0F) : otherwise;
  };
  V2f right = lengthened(slopes.right * shrink, V2f(1, 0));
  V2f up = lengthened(slopes.up * shrink, V2f(0, 1));
  // A parallelogram thinner than a texel becomes a strip of both sides' length.
  if (!(std::abs(right.cross(up)) > std::min(right.length(), up.length()) / 2)) {
    right += right.dot(up) > 0 ? up : -up;
    up = V2f(-right.y, right.x) / std::max(right.length(), tiny);
  }
  const float inverse = 1 / right.cross(up);
  PixelBox box;
  box.across = V2f(up.y, -up.x) * inverse;
  box.along = V2f(-right.y, right.x) * inverse;
  box.texel = {box.across.length(), box.along.length()};
  const V2f half = (V2f(1, 1) + box.texel) / 2;
  constexpr float most = 0.5F * max_pixel_texels;
  box.reach = {std::min(std::abs(right.x) * half.x + std::abs(up.x) * half.y, most),
               std::min(std::abs(right.y) * half.x + std::abs(up.y) * half.y, most)};
  return box;
}

/// Weight of a texel whose centre lies so many texels from the pixel's, times a constant: exactly the area
/// under the pixel where both have the same directions.
float texel_weight(const PixelBox& box, const V2f& from_centre) {
  if (!(std::abs(from_centre.x) < box.reach.x && std::abs(from_centre.y) < box.reach.y)) return 0;
  const auto overlap = [](float texel, float away) {
    return std::min(std::max((1 + texel) / 2 - std::abs(away), 0.0F), std::min(texel, 1.0F));
  };
  return overlap(box.texel.x, box.across.dot(from_centre)) * overlap(box.texel.y, box.along.dot(from_centre));
}

/// One lookup of a pixel: a texel, or a point of the yarn.
struct Tap {
  int level = 0;  ///< -1: the yarn
  V2i texel{0, 0};
  float weight = 1;
  V2d uv{0, 0};  ///< of a point
};

/// Texture coordinates at a point of the cloth.
V2d uv_of(const Fabric& fabric, const V2d& point) {
  return point * 1000.0 / V2d(fabric.period_mm) * V2d(1, -1);
}

/// The texels of a level under the pixel; `right` and `up` in repeats.
void add_texels(const Fabric& fabric, int level, const LevelOptions& options, const V2d& uv, const V2d& right,
                const V2d& up, float weight, std::vector<Tap>& taps) {
  const FabricLevel& texels = fabric.levels[level];
  if (options.forced >= 0) {
    taps.push_back({level, {wrap_texel(uv.x, texels.width), wrap_texel(uv.y, texels.height)}, weight});
    return;
  }
  const V2d size(texels.width, texels.height);
  const auto slopes = [&](const V2d& axis) { return TexelSlopes{V2f(right * axis), V2f(up * axis)}; };
  const float pixel = pixel_size(slopes(V2d(fabric.texels())));
  const PixelBox box = pixel_box(slopes(size), std::ldexp(pixel, -level));
  const V2d centre = uv * size;
  const V2i first(static_cast<int>(std::floor(centre.x - static_cast<double>(box.reach.x) + 0.5)),
                  static_cast<int>(std::floor(centre.y - static_cast<double>(box.reach.y) + 0.5)));
  const std::size_t begin = taps.size();
  float sum = 0;
  for (int y = first.y; y < first.y + max_pixel_texels; ++y) {
    for (int x = first.x; x < first.x + max_pixel_texels; ++x) {
      const V2d at(x + 0.5, y + 0.5);
      const V2f away(at - centre);
      const float weight_here = texel_weight(box, away);
      if (!(weight_here > 0)) continue;
      sum += weight_here;
      taps.push_back({level,
                      {wrap_texel(at.x / size.x, texels.width), wrap_texel(at.y / size.y, texels.height)},
                      weight_here});
    }
  }
  for (std::size_t i = begin; i < taps.size(); ++i) taps[i].weight *= weight / sum;
}

/// Points of the yarn, evenly over the pixel.
void add_points(const LevelOptions& options, const V2d& uv, const V2d& right, const V2d& up, float weight,
                std::vector<Tap>& taps) {
  const int n = options.points;
  const auto offset = [&](int i) { return (i + 0.5) / n - 0.5; };
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) {
      taps.push_back(
          {-1, {0, 0}, weight / static_cast<float>(n * n), uv + right * offset(i) + up * offset(j)});
    }
  }
}

/// Sets the lookups of a pixel by spec/brdf.md, "Over a surface", "The viewer".
/// Points are at the texture coordinates, texels at `place` (variation.h).
void find_taps(const Fabric& fabric, const LevelOptions& options, const Footprint& at, const V2d& place,
               std::vector<Tap>& taps) {
  taps.clear();
  const auto& [uv, right, up] = at;
  const V2d size(fabric.texels());
  const float pixel = pixel_size({V2f(right * size), V2f(up * size)});
  const float wanted =
      options.forced >= 0 ? static_cast<float>(options.forced) : std::log2(pixel) + level_bias;
  const float yarn = options.forced >= 0
                         ? 0
                         : yarn_weight(pixel, largest_yarn_pixel(fabric) * largest_by_points(options.points));
  if (yarn > 0) add_points(options, uv, right, up, yarn, taps);
  const auto last = static_cast<float>(fabric.levels.size() - 1);
  const float level = wanted > 0 ? std::min(wanted, last) : 0;
  const int lower = static_cast<int>(level);
  const float of_upper = blend_of_levels(level - std::floor(level));
  for (const int k : {0, 1}) {
    const float weight = (1 - yarn) * (k == 1 ? of_upper : 1 - of_upper);
    if (weight > 0) add_texels(fabric, lower + k, options, place, right, up, weight, taps);
  }
}

/// The change of texture coordinates per pixel along `pixel`; nothing beyond the horizon.
std::optional<V2d> uv_slope(const Fabric& fabric, const Camera& camera, const V2d& at, const V2d& pixel) {
  // A central difference over a small part of the pixel.
  constexpr double part = 0.01;
  const auto before = swatch_ray(camera, at - pixel * (part / 2));
  const auto after = swatch_ray(camera, at + pixel * (part / 2));
  if (!before || !after) return std::nullopt;
  return (uv_of(fabric, after->point) - uv_of(fabric, before->point)) / part;
}

V4f pixel_of(const Fabric& fabric, const SwatchShot& shot, const LevelOptions& levels, int x, int y) {
  const V2d pixel(2.0 / shot.width, 2.0 / shot.height);
  const V2d at((x + 0.5) * pixel.x - 1, 1 - (y + 0.5) * pixel.y);
  const auto ray = swatch_ray(shot.camera, at);
  const auto right = uv_slope(fabric, shot.camera, at, {pixel.x, 0});
  const auto up = uv_slope(fabric, shot.camera, at, {0, pixel.y});
  if (!ray || !right || !up) return {0, 0, 0, 0};
  // The fabric's frame is the world's.
  std::vector<Illumination> lights;
  for (const Light& light : shot.lights) lights.push_back(light_at(light, {ray->point.x, ray->point.y, 0}));
  return shade_pixel(fabric, levels, {uv_of(fabric, ray->point), *right, *up}, V3f(ray->view), lights);
}

}  // namespace

V4f shade_pixel(const Fabric& fabric, const LevelOptions& levels, const Footprint& pixel, const V3f& view,
                std::span<const Illumination> lights) {
  thread_local std::vector<Tap> taps;
  float varied = 1;  // of texels; points have their own
  V2d place = pixel.uv;
  if (const auto& yarns = fabric.levels.front().yarns(); yarns) {
    const Variation& variation = yarns->variation();
    const V2f width(std::hypot(static_cast<float>(pixel.right.x), static_cast<float>(pixel.up.x)),
                    std::hypot(static_cast<float>(pixel.right.y), static_cast<float>(pixel.up.y)));
    const VariationFade fade = fade_of(variation, width);
    const RepeatPlace moved = place_of(variation, repeat_place(pixel.uv), offset_weight(fade));
    varied = variation_at(variation, moved, variation.fraction, fade);
    place = V2d(moved.within);
  }
  find_taps(fabric, levels, pixel, place, taps);
  V4f sum(0, 0, 0, 0);
  for (const Tap& tap : taps) {
    const float factor = tap.level < 0 ? 1 : varied;
    bool opacity_counted = false;
    for (const Illumination& from : lights) {
      const Shading s =
          tap.level < 0 ? evaluate(fabric, -1.0, tap.uv, V3f(from.direction), view)
                        : evaluate(fabric, tap.level, tap.texel.x, tap.texel.y, V3f(from.direction), view);
      const V3f radiance = s.radiance * from.irradiance * (s.alpha * tap.weight * factor);
      sum += V4f(radiance.x, radiance.y, radiance.z, opacity_counted ? 0 : s.alpha * tap.weight);
      opacity_counted = true;
    }
  }
  return sum;
}

Frame draw_swatch(const Fabric& fabric, const SwatchShot& shot, const LevelOptions& levels) {
  Frame frame{shot.width, shot.height, std::vector<V4f>(std::size_t{1} * shot.width * shot.height)};
  parallel_for(0, shot.height, [&](int y) {
    for (int x = 0; x < shot.width; ++x)
      frame.pixels[std::size_t{1} * y * shot.width + x] = pixel_of(fabric, shot, levels, x, y);
  });
  return frame;
}

}  // namespace selvedge
