#include "converter/dress/fallback.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "format/base/parallel.h"
#include "format/fabric/evaluate.h"

namespace selvedge {
namespace {

constexpr int largest_side = 1024;
constexpr int yarn_side = 64;  ///< of the picture of a fabric with yarn, unless level 0 has more texels
constexpr int lights_of_integral = 256;

/// Weight of each light: equal parts of the hemisphere, corrected (by less than 1%) so that a Lambertian
/// texel gives exactly its albedo.
double weight_of(const std::vector<V3f>& lights) {
  double cosines = 0;
  for (const V3f& light : lights) cosines += light.z;
  return std::numbers::pi / cosines;
}

/// KHR_materials_sheen's lobe of colour 1 times the light's cosine: Charlie's distribution and Ashikhmin's
/// visibility term, as in the extension.
double charlie(const V3f& light, const V3f& view, double roughness) {
  const double inverse = 1.0 / (roughness * roughness);
  const double cosine = (light + view).normalized().z;
  const double sine = std::sqrt(std::max(0.0, 1.0 - cosine * cosine));
  const double distribution = (2.0 + inverse) * std::pow(sine, inverse) / (2.0 * std::numbers::pi);
  const double l = light.z;
  const double v = view.z;
  return distribution / (4.0 * (l + v - l * v)) * l;
}

/// f(l, v) of a level, the mean over its texels by their opacity.
V3f mean_reflectance(const Fabric& fabric, int level, const V3f& light, const V3f& view) {
  const FabricLevel& source = fabric.levels[level];
  V3d sum(0, 0, 0);
  double weight = 0;
  for (int y = 0; y < source.height; ++y) {
    for (int x = 0; x < source.width; ++x) {
      const Shading shading = evaluate(fabric, level, x, y, light, view);
      sum += V3d(shading.radiance) * static_cast<double>(shading.alpha);
      weight += shading.alpha;
    }
  }
  return weight > 0 ? V3f(sum / weight) : V3f(0, 0, 0);
}

/// The normal equations of one channel: base colour and sheen against the fabric.
struct TwoLobes {
  double bb = 0, bs = 0, ss = 0, bf = 0, sf = 0;
  void add(double weight, double base, double sheen, double reflected) {
    bb += weight * base * base;
    bs += weight * base * sheen;
    ss += weight * sheen * sheen;
    bf += weight * base * reflected;
    sf += weight * sheen * reflected;
  }
  /// Base colour and sheen, neither below 0.
  std::array<double, 2> solve() const {
    const double sheen = (sf * bb - bf * bs) / std::max(ss * bb - bs * bs, 1e-30);
    if (!(sheen > 0)) return {std::max(bf / bb, 0.0), 0.0};
    return {std::max((bf - sheen * bs) / bb, 0.0), sheen};
  }
};

/// Fits base colour (which is returned) and sheen to the coarsest level over pairs of directions, by least
/// squares in radiance, weighted by the cosine of the view, as a pixel is. The sheen takes from the light
/// that the base gets, as the extension says, so that the fit is repeated.
V3f fit_lobes(const Fabric& fabric, Fallback& fallback) {
  const int coarsest = static_cast<int>(fabric.levels.size()) - 1;
  const std::vector<V3f> directions = directions_of(grid_of(36));
  const std::size_t count = directions.size();
  std::vector<V3f> reflected(count * count);
  std::vector<double> lobes(count * count);
  std::vector<double> of_sheen(count);  // directional albedo of a sheen of colour 1
  const double roughness = fallback.sheen_roughness;
  parallel_for(0, static_cast<int>(count), [&](int v) {
    double sum = 0;
    for (std::size_t l = 0; l < count; ++l) {
      reflected[v * count + l] = mean_reflectance(fabric, coarsest, directions[l], directions[v]);
      sum += lobes[v * count + l] = charlie(directions[l], directions[v], roughness);
    }
    of_sheen[v] = sum * weight_of(directions);
  });
  V3f base(0, 0, 0);
  const auto fit = [&](double largest) {
    std::array<TwoLobes, 3> channels;
    for (std::size_t v = 0; v < count; ++v) {
      for (std::size_t l = 0; l < count; ++l) {
        const double left = 1.0 - largest * std::max(of_sheen[v], of_sheen[l]);
        const double lambert = left * directions[l].z / std::numbers::pi;
        for (int c = 0; c < 3; ++c)
          channels[c].add(directions[v].z, lambert, lobes[v * count + l], reflected[v * count + l][c]);
      }
    }
    for (int c = 0; c < 3; ++c) {
      const auto [diffuse, sheen] = channels[c].solve();
      base[c] = static_cast<float>(std::min(diffuse, 1.0));
      fallback.sheen_color[c] = static_cast<float>(std::min(sheen, 1.0));
    }
    const V3f& color = fallback.sheen_color;
    return std::max({color.x, color.y, color.z});
  };
  float largest = 0;
  for (int round = 0; round < 4; ++round) largest = fit(largest);
  // Less than one step of an 8-bit colour is noise of the fit.
  if (largest < 1.0F / 255.0F) fallback.sheen_color = V3f(0, 0, 0);
  return base;
}

/// Fits diffuse transmission to light from behind, mean over all pairs of directions, weighted as a pixel is.
void fit_transmission(const Fabric& fabric, Fallback& fallback) {
  const Fabric* const through = fabric.side_of(Side::through);
  if (through == nullptr) return;
  const int coarsest = static_cast<int>(fabric.levels.size()) - 1;
  const std::vector<V3f> directions = directions_of(grid_of(36));
  V3d sum(0, 0, 0);
  double weight = 0;
  for (const V3f& view : directions) {
    for (const V3f& light : directions) {
      sum += V3d(mean_reflectance(*through, coarsest, light, view)) * static_cast<double>(view.z);
      weight += static_cast<double>(view.z * light.z) / std::numbers::pi;
    }
  }
  const V3f share(sum / weight);
  const float largest = std::min(1.0F, std::max({share.x, share.y, share.z}));
  // Less than one step of an 8-bit colour is noise of the fit.
  if (largest < 1.0F / 255.0F) return;
  fallback.transmission = largest;
  for (int c = 0; c < 3; ++c) fallback.transmission_color[c] = std::clamp(share[c] / largest, 0.0F, 1.0F);
}

/// Brings the mean colour of the picture to `mean`.
void scale_to(const V3f& mean, Image& image) {
  const V3f present = mean_color(image);
  for (std::size_t i = 0; i < image.pixels.size(); i += 4) {
    for (int c = 0; c < 3; ++c) {
      float& value = image.pixels[i + c];
      if (present[c] > 0) value = std::clamp(value * (mean[c] / present[c]), 0.0F, 1.0F);
    }
  }
}

/// Albedo along the normal and opacity of one repeat: of the yarn itself where the fabric has it, whose
/// levels are coarse, else of the texels of `level`.
Image base_picture(const Fabric& fabric, int level) {
  const FabricLevel& source = fabric.levels[level];
  const bool shows_yarn = level == 0 && source.yarns() != nullptr;
  const int longest = std::max(source.width, source.height);
  const int finer = shows_yarn ? std::max(1, yarn_side / longest) : 1;
  Image image{source.width * finer, source.height * finer, 4, {}};
  image.pixels.resize(4 * source.texels() * finer * finer);
  const std::vector<V3f> lights = directions_of(grid_of(lights_of_integral));
  const V3f up(0, 0, 1);
  parallel_for(0, image.height, [&](int y) {
    for (int x = 0; x < image.width; ++x) {
      const V2d uv((x + 0.5) / image.width, (y + 0.5) / image.height);
      const auto seen = [&](const V3f& light) {
        return evaluate(fabric, shows_yarn ? -1.0 : level, uv, light, up);
      };
      V3d sum(0, 0, 0);
      for (const V3f& light : lights) sum += V3d(seen(light).radiance);
      const V3f albedo(sum * weight_of(lights));
      float* pixel = image.pixels.data() + (y * image.width + x) * 4;
      for (int c = 0; c < 3; ++c) pixel[c] = albedo[c];
      pixel[3] = seen(up).alpha;
    }
  });
  return image;
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

Fallback bake_fallback(const Fabric& fabric) {
  int level = 0;
  while (level + 1 < static_cast<int>(fabric.levels.size()) &&
         std::max(fabric.levels[level].width, fabric.levels[level].height) > largest_side) {
    ++level;
  }
  const FabricLevel& source = fabric.levels[level];
  Fallback fallback;
  fallback.base_color = base_picture(fabric, level);
  fallback.albedo = mean_color(fallback.base_color);
  fallback.holes = has_holes(fabric, level);
  fit_transmission(fabric, fallback);
  // The extension takes the transmitted light from the base colour.
  const float left = std::max(1 - fallback.transmission, 1e-3F);
  scale_to(fit_lobes(fabric, fallback) / left, fallback.base_color);
  fill_holes(fallback.base_color);
  if (source.has(LayerKind::frame)) fallback.normal = normals_of(source);
  return fallback;
}

}  // namespace selvedge
