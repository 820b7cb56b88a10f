#include "converter/dress/fallback.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "format/base/parallel.h"
#include "format/fabric/evaluate.h"

namespace selvedge {
namespace {

constexpr double grazing = 75.0 / 180.0 * std::numbers::pi;

/// Weight of each light: equal parts of the hemisphere, corrected (by less than 1%) so that a Lambertian
/// texel gives exactly its albedo.
double weight_of(const std::vector<V3f>& lights) {
  double cosines = 0;
  for (const V3f& light : lights) cosines += light.z;
  return std::numbers::pi / cosines;
}

/// Integral of f(l, view) over the lights.
V3f albedo(const Fabric& fabric, int level, int x, int y, const std::vector<V3f>& lights, const V3f& view) {
  V3d sum(0, 0, 0);
  for (const V3f& light : lights) sum += V3d(evaluate(fabric, level, x, y, light, view).radiance);
  return V3f(sum * weight_of(lights));
}

/// KHR_materials_sheen's lobe towards `view` with colour 1: Charlie's distribution and Ashikhmin's visibility
/// term, as in the extension, integrated over the lights with the cosine.
double charlie_albedo(const std::vector<V3f>& lights, const V3f& view, double roughness) {
  const double inverse = 1.0 / (roughness * roughness);
  double sum = 0;
  for (const V3f& light : lights) {
    const double cosine = (light + view).normalized().z;
    const double sine = std::sqrt(std::max(0.0, 1.0 - cosine * cosine));
    const double distribution = (2.0 + inverse) * std::pow(sine, inverse) / (2.0 * std::numbers::pi);
    const double l = light.z;
    const double v = view.z;
    sum += distribution / (4.0 * (l + v - l * v)) * l;
  }
  return sum * weight_of(lights);
}

V3f mean_albedo(const Fabric& fabric, int level, const std::vector<V3f>& lights, const V3f& view) {
  const FabricLevel& source = fabric.levels[level];
  V3d sum(0, 0, 0);
  double weight = 0;
  for (int y = 0; y < source.height; ++y) {
    for (int x = 0; x < source.width; ++x) {
      const double alpha = evaluate(fabric, level, x, y, view, view).alpha;
      sum += V3d(albedo(fabric, level, x, y, lights, view)) * alpha;
      weight += alpha;
    }
  }
  return weight > 0 ? V3f(sum / weight) : V3f(0, 0, 0);
}

/// The coarsest level is a fit of the mean over the repeat, which suffices for a sheen.
void estimate_sheen(const Fabric& fabric, const std::vector<V3f>& lights, Fallback& fallback) {
  const int coarsest = static_cast<int>(fabric.levels.size()) - 1;
  V3f rim(0, 0, 0);
  const auto sine = static_cast<float>(std::sin(grazing));
  const auto cosine = static_cast<float>(std::cos(grazing));
  const std::array<V3f, 4> views{V3f(sine, 0, cosine), V3f(0, sine, cosine), V3f(-sine, 0, cosine),
                                 V3f(0, -sine, cosine)};
  for (const V3f& view : views) rim += mean_albedo(fabric, coarsest, lights, view) * 0.25F;
  const V3f rise = rim - mean_albedo(fabric, coarsest, lights, V3f(0, 0, 1));
  const double lobe = charlie_albedo(lights, views[0], fallback.sheen_roughness);
  for (int c = 0; c < 3; ++c) {
    fallback.sheen_color[c] = std::clamp(rise[c] / static_cast<float>(lobe), 0.0F, 1.0F);
  }
  // Less than one step of an 8-bit colour is noise of the fit.
  const V3f& color = fallback.sheen_color;
  if (std::max({color.x, color.y, color.z}) < 1.0F / 255.0F) fallback.sheen_color = V3f(0, 0, 0);
}

void fill_holes(Image& image) {
  const V3f mean = mean_color(image);
  for (std::size_t i = 0; i < image.pixels.size(); i += 4) {
    if (image.pixels[i + 3] > 0) continue;
    for (int c = 0; c < 3; ++c) image.pixels[i + c] = mean[c];
  }
}

Image normals_of(const FabricLevel& level) {
  Image image{level.width, level.height, 3, {}};
  for (const TexelFrame& frame : level.frame()) {
    V3f normal = frame.normal;
    // glTF requires z > 0 in normal textures.
    normal.z = std::max(normal.z, 0.05F);
    normal.normalize();
    for (int c = 0; c < 3; ++c) image.pixels.push_back(normal[c] * 0.5F + 0.5F);
  }
  return image;
}

}  // namespace

V3f mean_color(const Image& image) {
  V3d sum(0, 0, 0);
  double weight = 0;
  const std::size_t channels = image.channels;
  for (std::size_t i = 0; i + channels <= image.pixels.size(); i += channels) {
    const double alpha = channels == 4 ? image.pixels[i + 3] : 1.0;
    sum += V3d(image.pixels[i], image.pixels[i + 1], image.pixels[i + 2]) * alpha;
    weight += alpha;
  }
  return weight > 0 ? V3f(sum / weight) : V3f(0, 0, 0);
}

Fallback bake_fallback(const Fabric& fabric, const FallbackOptions& options) {
  int level = 0;
  while (level + 1 < static_cast<int>(fabric.levels.size()) &&
         std::max(fabric.levels[level].width, fabric.levels[level].height) > options.largest_side) {
    ++level;
  }
  const FabricLevel& source = fabric.levels[level];
  const std::vector<V3f> lights = directions_of(grid_of(options.lights));
  Fallback fallback;
  fallback.base_color = Image{source.width, source.height, 4, {}};
  fallback.base_color.pixels.resize(source.texels() * 4);
  const V3f up(0, 0, 1);
  parallel_for(0, source.height, [&](int y) {
    for (int x = 0; x < source.width; ++x) {
      float* pixel = fallback.base_color.pixels.data() + (y * source.width + x) * 4;
      const V3f color = albedo(fabric, level, x, y, lights, up);
      for (int c = 0; c < 3; ++c) pixel[c] = std::clamp(color[c], 0.0F, 1.0F);
      pixel[3] = evaluate(fabric, level, x, y, up, up).alpha;
    }
  });
  fallback.holes = has_holes(fabric, level);
  fill_holes(fallback.base_color);
  if (source.has(LayerKind::frame)) fallback.normal = normals_of(source);
  estimate_sheen(fabric, lights, fallback);
  return fallback;
}

}  // namespace selvedge
