#include "viewer/light/reflections.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <numbers>

#include "format/base/parallel.h"
#include "viewer/light/pbr_brdf.h"

namespace selvedge {
namespace {

using std::numbers::pi;
constexpr int rough_levels = 8;
/// The first level's width.
constexpr int mirror_width = 2048;
constexpr int min_width = 64;
constexpr int max_width = 512;
/// The part of a lobe within this number of alphas of its middle is summed over pixels as small as the
/// level's, parts farther out by this factor over pixels larger by the same factor.
constexpr double near_part = 12;
constexpr int part_ratio = 4;
constexpr int min_part_width = 8;

/// GGX's distribution times the cosine to the light, but for a factor; of view and normal in the middle.
struct Lobe {
  double alpha2;
  double at(double cosine) const {
    const double d = 1 + alpha2 - (1 - alpha2) * cosine;
    return std::max(cosine, 0.0) / (d * d);
  }
  /// The integral of at() over the cosine from some beginning.
  double sum_to(double cosine) const {
    const double d = 1 + alpha2 - (1 - alpha2) * cosine;
    return (std::log(d) + (1 + alpha2) / d) / ((1 - alpha2) * (1 - alpha2));
  }
};

/// For every pixel, the mean of the picture under the part of the lobe that has cosines from `outer` to
/// `inner`.
Environment means(const Environment& e, const Lobe& lobe, double inner, double outer) {
  Environment result{e.width, e.height, std::vector<V3f>(e.radiance.size()), {}};
  const int half = e.width / 2;
  const std::size_t row = 3 * static_cast<std::size_t>(e.width);
  parallel_for(0, e.height, [&](int y) {
    const auto polar = [&](int line) { return (line + 0.5) / e.height * pi; };
    std::vector<float> sums(row, 0.0F);
    std::vector<float> wrapped(2 * row);
    double total = 0;
    for (int from = 0; from < e.height; ++from) {
      if (std::cos(polar(from) - polar(y)) < outer) continue;
      const auto* values = &e.radiance[static_cast<std::size_t>(from) * e.width].x;
      for (std::size_t i = 0; i < 2 * row; ++i)
        wrapped[i] = values[(i + row - 3 * static_cast<std::size_t>(half)) % row];
      for (int across = -half; across < e.width - half; ++across) {
        const double cosine =
            std::cos(polar(y)) * std::cos(polar(from)) +
            std::sin(polar(y)) * std::sin(polar(from)) * std::cos(2 * pi * across / e.width);
        if (cosine < outer || cosine >= inner) continue;
        const double weight = lobe.at(cosine) * e.solid_angle(from);
        total += weight;
        const auto factor = static_cast<float>(weight);
        const float* shifted = &wrapped[3 * static_cast<std::size_t>(across + half)];
        for (std::size_t i = 0; i < row; ++i) sums[i] += factor * shifted[i];
      }
    }
    const auto scale = static_cast<float>(total > 0 ? 1 / total : 0);
    for (int x = 0; x < e.width; ++x) {
      const float* sum = &sums[3 * static_cast<std::size_t>(x)];
      result.radiance[static_cast<std::size_t>(y) * e.width + x] = V3f(sum[0], sum[1], sum[2]) * scale;
    }
  });
  return result;
}

/// A picture without options in a mirror of this roughness.
Environment blurred(const Environment& picture, double roughness) {
  const double alpha = roughness * roughness;
  // Where the distribution is even the sums have another form.
  const Lobe lobe{std::min(alpha * alpha, 0.999)};
  // A lobe is six pixels wide where it has half its height, at the least three.
  const auto wanted = std::bit_ceil(static_cast<unsigned>(std::lround(1 + 15 / alpha)));
  const Environment source = downsample(picture, std::clamp(static_cast<int>(wanted), min_width, max_width));
  Environment result{source.width, source.height, std::vector<V3f>(source.radiance.size(), V3f(0)), {}};
  int width = source.width;
  double inner = 2;
  for (double angle = near_part * alpha; inner > 0; angle *= part_ratio) {
    const double outer = angle < pi / 2 ? std::cos(angle) : 0;
    const auto fraction = static_cast<float>((lobe.sum_to(std::min(inner, 1.0)) - lobe.sum_to(outer)) /
                                             (lobe.sum_to(1) - lobe.sum_to(0)));
    const Environment part = means(downsample(source, width), lobe, inner, outer);
    for (int y = 0; y < result.height; ++y)
      for (int x = 0; x < result.width; ++x)
        result.radiance[static_cast<std::size_t>(y) * result.width + x] +=
            part.radiance_at(result.direction(x, y)) * fraction;
    inner = outer;
    width = std::max(width / part_ratio, min_part_width);
  }
  return result;
}

/// Fractions of environment_brdf(), [roughness][cosine].
constexpr int environment_brdf_size = 32;
using EnvironmentBrdfTable = std::array<V2f, std::size_t{environment_brdf_size} * environment_brdf_size>;

EnvironmentBrdfTable make_fractions() {
  constexpr int samples = 24;  // along either side of a square
  EnvironmentBrdfTable fractions;
  for (int i = 0; i < environment_brdf_size; ++i) {
    const double roughness = static_cast<double>(i) / (environment_brdf_size - 1);
    const double a2 = std::max(std::pow(roughness, 4), static_cast<double>(min_alpha2));
    for (int j = 0; j < environment_brdf_size; ++j) {
      const double nv = std::max(static_cast<double>(j) / (environment_brdf_size - 1), 1e-3);
      const V3d v(std::sqrt(1 - nv * nv), 0, nv);
      V2d sum(0, 0);
      for (int k = 0; k < samples * samples; ++k) {
        // Normals of facets with GGX's frequency.
        const int ring = k / samples;
        const double u = (ring + 0.5) / samples;
        const double nh = std::sqrt((1 - u) / (1 + (a2 - 1) * u));
        const double angle = (k % samples + 0.5) / samples * 2 * pi;
        const double planar = std::sqrt(1 - nh * nh);
        const double vh = v.dot(V3d(planar * std::cos(angle), planar * std::sin(angle), nh));
        const double nl = 2 * vh * nh - nv;
        if (!(vh > 0) || !(nl > 0)) continue;
        const auto side = [&](double cosine) { return cosine + std::sqrt(a2 + (1 - a2) * cosine * cosine); };
        const double reflected = 4 * nl * vh / (nh * side(nl) * side(nv));
        const auto schlick = static_cast<double>(schlick_fifth_power(static_cast<float>(vh)));
        sum += V2d(1 - schlick, schlick) * reflected;
      }
      fractions[static_cast<std::size_t>(i) * environment_brdf_size + j] = V2f(sum / (samples * samples));
    }
  }
  return fractions;
}

}  // namespace

V3f Reflections::at(const V3d& direction, float roughness) const {
  const auto last = static_cast<float>(levels.size() - 1);
  const float place = std::clamp(roughness, 0.0F, 1.0F) * last;
  const float low = std::min(std::floor(place), last - 1);
  const auto level = static_cast<std::size_t>(low);
  return levels[level].radiance_at(direction) * (low + 1 - place) +
         levels[level + 1].radiance_at(direction) * (place - low);
}

Reflections reflections_of(const Environment& environment) {
  Reflections result;
  Environment picture = environment;
  picture.options = {};
  result.levels.push_back(downsample(picture, mirror_width));
  for (int k = 1; k <= rough_levels; ++k)
    result.levels.push_back(blurred(picture, static_cast<double>(k) / rough_levels));
  for (Environment& level : result.levels) level.options = environment.options;
  return result;
}

V2f environment_brdf(float roughness, float cosine) {
  const auto place = [](float x) { return std::clamp(x, 0.0F, 1.0F) * (environment_brdf_size - 1); };
  const V2f at(place(roughness), place(cosine));
  const V2i low(std::min(static_cast<int>(at.x), environment_brdf_size - 2),
                std::min(static_cast<int>(at.y), environment_brdf_size - 2));
  const V2f fraction = at - V2f(low);
  static const EnvironmentBrdfTable table = make_fractions();
  const auto* fractions = &table[static_cast<std::size_t>(low.x) * environment_brdf_size + low.y];
  return (fractions[0] * (1 - fraction.y) + fractions[1] * fraction.y) * (1 - fraction.x) +
         (fractions[environment_brdf_size] * (1 - fraction.y) +
          fractions[environment_brdf_size + 1] * fraction.y) *
             fraction.x;
}

}  // namespace selvedge
