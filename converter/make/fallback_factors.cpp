#include "converter/make/fallback_factors.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "format/base/parallel.h"
#include "format/fabric/evaluate.h"
#include "format/fabric/json_io.h"

namespace selvedge {
namespace {

/// Points of a repeat each way that stand for its yarn.
constexpr int yarn_points = 6;

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

/// f(l, v), the mean by opacity over a repeat: of its yarn, at points that differ from pair to pair, or of
/// the texels of the coarsest level.
V3f mean_reflectance(const Fabric& fabric, int pair, const V3f& light, const V3f& view) {
  V3d sum(0, 0, 0);
  double weight = 0;
  const auto add = [&](const Shading& shading) {
    sum += V3d(shading.radiance) * static_cast<double>(shading.alpha);
    weight += shading.alpha;
  };
  if (const Yarns* const yarns = fabric.levels.front().yarns().get()) {
    // Additive recurrence of the plastic number: the points of all pairs fill the repeat evenly.
    const V2d shift(std::fmod(pair * 0.7548776662466927, 1), std::fmod(pair * 0.5698402909980532, 1));
    for (int i = 0; i < yarn_points * yarn_points; ++i) {
      const V2i place(i % yarn_points, i / yarn_points);
      const V2d uv = (V2d(place) + shift) / double{yarn_points};
      add(yarns->shade(uv, fabric.reference_height, light, view));
    }
  } else {
    const int level = static_cast<int>(fabric.levels.size()) - 1;
    const FabricLevel& coarsest = fabric.levels.back();
    for (int i = 0; i < coarsest.texels(); ++i)
      add(evaluate(fabric, level, i % coarsest.width, i / coarsest.width, light, view));
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

/// The fabric for all pairs of directions of view and of light, which comes from above or from below.
struct Reflected {
  std::vector<V3f> directions = cell_directions(nearly_square_grid(36));
  std::vector<V3f> values;  ///< f(l, v): [view * directions + light]
  double weight = 0;        ///< of each light: a white Lambertian surface reflects all light

  Reflected(const Fabric& fabric, float sense) : values(directions.size() * directions.size()) {
    const int count = static_cast<int>(directions.size());
    for (const V3f& light : directions) weight += light.z;
    weight = std::numbers::pi / weight;
    parallel_for(0, count * count, [&](int i) {
      const V3f light = directions[i % count];
      values[i] = mean_reflectance(fabric, i, V3f(light.x, light.y, sense * light.z), directions[i / count]);
    });
  }
};

/// Fits base colour and sheen. The sheen takes from the light that the base gets, as the extension says, so
/// that the fit is repeated.
void fit_lobes(const Reflected& reflected, FallbackFactors& factors) {
  const std::vector<V3f>& directions = reflected.directions;
  const std::size_t count = directions.size();
  std::vector<double> lobes(count * count);
  std::vector<double> of_sheen(count);  // directional albedo of a sheen of colour 1
  for (std::size_t v = 0; v < count; ++v) {
    for (std::size_t l = 0; l < count; ++l)
      of_sheen[v] += lobes[v * count + l] = charlie(directions[l], directions[v], factors.sheen_roughness);
    of_sheen[v] *= reflected.weight;
  }
  const auto fit = [&](double largest) {
    std::array<TwoLobes, 3> channels;
    for (std::size_t v = 0; v < count; ++v) {
      for (std::size_t l = 0; l < count; ++l) {
        const double left = 1.0 - largest * std::max(of_sheen[v], of_sheen[l]);
        const double lambert = left * directions[l].z / std::numbers::pi;
        for (int c = 0; c < 3; ++c)
          channels[c].add(directions[v].z, lambert, lobes[v * count + l], reflected.values[v * count + l][c]);
      }
    }
    for (int c = 0; c < 3; ++c) {
      const auto [diffuse, sheen] = channels[c].solve();
      factors.base_color[c] = static_cast<float>(std::min(diffuse, 1.0));
      factors.sheen_color[c] = static_cast<float>(std::min(sheen, 1.0));
    }
    const V3f& color = factors.sheen_color;
    return std::max({color.x, color.y, color.z});
  };
  float largest = 0;
  for (int round = 0; round < 4; ++round) largest = fit(largest);
  // Less than one step of an 8-bit colour is noise of the fit.
  if (largest < 1.0F / 255.0F) factors.sheen_color = V3f(0, 0, 0);
}

/// Fits diffuse transmission to light from behind: the mean over all pairs, weighted as a pixel is.
void fit_transmission(const Reflected& through, FallbackFactors& factors) {
  V3d sum(0, 0, 0);
  double weight = 0;
  const std::size_t count = through.directions.size();
  for (std::size_t i = 0; i < through.values.size(); ++i) {
    const float cosine = through.directions[i / count].z;
    sum += V3d(through.values[i]) * static_cast<double>(cosine);
    weight += static_cast<double>(cosine * through.directions[i % count].z) / std::numbers::pi;
  }
  const V3f fraction(sum / weight);
  const float largest = std::min(1.0F, std::max({fraction.x, fraction.y, fraction.z}));
  // Less than one step of an 8-bit colour is noise of the fit.
  if (largest < 1.0F / 255.0F) return;
  factors.transmission = largest;
  for (int c = 0; c < 3; ++c) factors.transmission_color[c] = std::clamp(fraction[c] / largest, 0.0F, 1.0F);
  // The extension takes the transmitted light from the base colour.
  for (int c = 0; c < 3; ++c)
    factors.base_color[c] = std::min(factors.base_color[c] / std::max(1 - largest, 1e-3F), 1.0F);
}

constexpr std::array<std::pair<const char*, V3f FallbackFactors::*>, 4> colors{
    {{"albedo", &FallbackFactors::albedo},
     {"baseColor", &FallbackFactors::base_color},
     {"sheenColor", &FallbackFactors::sheen_color},
     {"transmissionColor", &FallbackFactors::transmission_color}}};
constexpr std::array<std::pair<const char*, float FallbackFactors::*>, 2> numbers{
    {{"sheenRoughness", &FallbackFactors::sheen_roughness},
     {"transmission", &FallbackFactors::transmission}}};

}  // namespace

FallbackFactors fit_fallback(const Fabric& fabric) {
  FallbackFactors factors;
  const Reflected reflected(fabric, 1);
  fit_lobes(reflected, factors);
  // Yarn without light that comes through is black from behind.
  const auto yarns = fabric.levels.front().yarns();
  if (!yarns || !yarns->data().light_through.empty()) fit_transmission(Reflected(fabric, -1), factors);
  V3d sum(0, 0, 0);
  const int count = static_cast<int>(reflected.directions.size());
  for (int i = 0; i < count; ++i)
    sum += V3d(mean_reflectance(fabric, i, reflected.directions[i], V3f(0, 0, 1)));
  for (int c = 0; c < 3; ++c)
    factors.albedo[c] = std::min(static_cast<float>(sum[c] * reflected.weight), 1.0F);
  return factors;
}

FallbackFactors fallback_of(const Fabric& fabric) {
  const nlohmann::json text = provenance_json(fabric.fallback);
  const auto number = [&](const nlohmann::json& value) {
    return value.is_number() && value >= 0 && value <= 1 ? std::optional(value.get<float>()) : std::nullopt;
  };
  FallbackFactors factors;
  for (const auto& [name, color] : colors) {
    const nlohmann::json values = text.value(name, nlohmann::json());
    for (int c = 0; c < 3; ++c) {
      const auto value = values.is_array() && values.size() == 3 ? number(values[c]) : std::nullopt;
      if (!value) return fit_fallback(fabric);
      (factors.*color)[c] = *value;
    }
  }
  for (const auto& [name, member] : numbers) {
    const auto value = number(text.value(name, nlohmann::json()));
    if (!value) return fit_fallback(fabric);
    factors.*member = *value;
  }
  return factors;
}

std::string fallback_json_text(const FallbackFactors& factors) {
  // Four digits are finer than a step of an 8-bit colour.
  const auto rounded = [](float x) { return short_number(static_cast<double>(x)); };
  nlohmann::json text;
  for (const auto& [name, color] : colors) {
    const V3f& value = factors.*color;
    text[name] = {rounded(value.x), rounded(value.y), rounded(value.z)};
  }
  for (const auto& [name, member] : numbers) text[name] = rounded(factors.*member);
  return text.dump();
}

}  // namespace selvedge
