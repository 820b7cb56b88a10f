#include "format/picture/swatch_picture.h"

#include <algorithm>
#include <cmath>

#include "format/base/parallel.h"
#include "format/fabric/evaluate.h"
#include "format/scene/footprint.h"

namespace selvedge {
namespace {

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

void add_nearest(const Fabric& fabric, int level, const V2d& uv, float weight, std::vector<Tap>& taps) {
  const FabricLevel& texels = fabric.levels[level];
  taps.push_back({level, {wrap_texel(uv.x, texels.width), wrap_texel(uv.y, texels.height)}, weight});
}

/// The four texels around (u, v), weighted by distance.
void add_linear(const Fabric& fabric, int level, const V2d& uv, float weight, std::vector<Tap>& taps) {
  const FabricLevel& texels = fabric.levels[level];
  const V2d size(texels.width, texels.height);
  const V2d at = uv * size - V2d(0.5, 0.5);
  const V2d corner(std::floor(at.x), std::floor(at.y));
  const V2f part(at - corner);
  for (const int down : {0, 1}) {
    for (const int right : {0, 1}) {
      const V2d centre = (corner + V2d(right + 0.5, down + 0.5)) / size;
      const float share = (right == 1 ? part.x : 1 - part.x) * (down == 1 ? part.y : 1 - part.y);
      add_nearest(fabric, level, centre, weight * share, taps);
    }
  }
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

/// Sets the taps of a pixel by spec/brdf.md, "Over a surface", "The viewer".
void find_taps(const Fabric& fabric, const LevelOptions& options, const V2d& uv, const V2d& right,
               const V2d& up, std::vector<Tap>& taps) {
  taps.clear();
  const FabricLevel& finest = fabric.levels.front();
  const V2d size(finest.width, finest.height);
  const V2f r(right * size);
  const V2f u(up * size);
  const TexelSlopes<float> slopes{r.x, r.y, u.x, u.y};
  const auto last = static_cast<float>(fabric.levels.size() - 1);
  const Footprint<float> ellipse = footprint(slopes, static_cast<float>(options.taps));
  const float wanted =
      options.forced >= 0 ? static_cast<float>(options.forced) : ellipse.level + options.bias;
  float yarn = finest.yarns() && options.forced < 0 ? std::clamp(-wanted, 0.0F, 1.0F) : 0;
  if (!options.blend) yarn = std::floor(yarn + 0.5F);
  if (yarn > 0) add_points(options, uv, right, up, yarn, taps);
  if (yarn == 1) return;
  const float clamped = wanted > 0 ? std::min(wanted, last) : 0;
  const float level = options.blend ? clamped : std::floor(clamped + 0.5F);
  const LevelBlend blend = level_blend(static_cast<double>(level), static_cast<int>(fabric.levels.size()));
  const float long_axis = std::sqrt(ellipse.axis_x * ellipse.axis_x + ellipse.axis_y * ellipse.axis_y) + 1;
  const float parts = std::min(ellipse.ratio, long_axis);
  const bool single = options.taps == 1 || options.forced >= 0 || !(parts > 1.001F);
  const int count = single ? 1 : std::min(static_cast<int>(parts + 0.999F), options.taps);
  const bool linear = options.linear && (blend.lower > 0 || blend.weight > 0);
  const V2d axis(static_cast<double>(ellipse.axis_x) / finest.width,
                 static_cast<double>(ellipse.axis_y) / finest.height);
  for (int i = 0; i < count; ++i) {
    const V2d at = uv + axis * ((i + 0.5) / count - 0.5);
    for (const int upper : {0, 1}) {
      const float weight =
          (1 - yarn) * (upper == 1 ? blend.weight : 1 - blend.weight) / static_cast<float>(count);
      if (weight == 0) continue;
      const int number = blend.lower + upper;
      if (linear && number > 0) {
        add_linear(fabric, number, at, weight, taps);
      } else {
        add_nearest(fabric, number, at, weight, taps);
      }
    }
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

V4f pixel_of(const Fabric& fabric, const SwatchShot& shot, const LevelOptions& levels, int x, int y,
             std::vector<Tap>& taps) {
  const V2d pixel(2.0 / shot.width, 2.0 / shot.height);
  const V2d at((x + 0.5) * pixel.x - 1, 1 - (y + 0.5) * pixel.y);
  const auto ray = swatch_ray(shot.camera, at);
  const auto right = uv_slope(fabric, shot.camera, at, {pixel.x, 0});
  const auto up = uv_slope(fabric, shot.camera, at, {0, pixel.y});
  if (!ray || !right || !up) return {0, 0, 0, 0};
  find_taps(fabric, levels, uv_of(fabric, ray->point), *right, *up, taps);
  // The fabric's frame is the world's.
  const V3f view(ray->view);
  V4f sum(0, 0, 0, 0);
  for (const Tap& tap : taps) {
    bool opacity_counted = false;
    for (const Light& light : shot.lights) {
      const Illumination from = light_at(light, {ray->point.x, ray->point.y, 0});
      const Shading s =
          tap.level < 0 ? evaluate(fabric, -1.0, tap.uv, V3f(from.direction), view)
                        : evaluate(fabric, tap.level, tap.texel.x, tap.texel.y, V3f(from.direction), view);
      const V3f radiance = s.radiance * from.irradiance * (s.alpha * tap.weight);
      sum += V4f(radiance.x, radiance.y, radiance.z, opacity_counted ? 0 : s.alpha * tap.weight);
      opacity_counted = true;
    }
  }
  return sum;
}

}  // namespace

Frame draw_swatch(const Fabric& fabric, const SwatchShot& shot, const LevelOptions& levels) {
  Frame frame{shot.width, shot.height, std::vector<V4f>(std::size_t{1} * shot.width * shot.height)};
  parallel_for(0, shot.height, [&](int y) {
    std::vector<Tap> taps;
    for (int x = 0; x < shot.width; ++x) {
      frame.pixels[std::size_t{1} * y * shot.width + x] = pixel_of(fabric, shot, levels, x, y, taps);
    }
  });
  return frame;
}

}  // namespace selvedge
