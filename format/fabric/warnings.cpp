#include "format/fabric/warnings.h"

#include <Imath/half.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "format/fabric/evaluate.h"
#include "format/fabric/level_values.h"
#include "format/fabric/names.h"

namespace selvedge {
namespace {

constexpr double largest_half = 65504;

/// The largest of some values of a level, and its place.
struct Maximum {
  double value = 0;
  int texel = 0;
  int channel = 0;  ///< as in channel_name
  void update(double other, int other_texel, int other_channel) {
    if (other > value) *this = {other, other_texel, other_channel};
  }
};

float largest_exponent(const FabricLevel& level) {
  float largest = 0;
  const std::size_t stride = parameter_count(level.lobe_count());
  for (std::size_t i = 0; i < level.lobes().size(); ++i) {
    if (i % stride != 0 && i % stride % 4 == 0) largest = std::max(largest, level.lobes()[i]);
  }
  return largest;
}

/// A direction of the hemisphere, and its weight in the integral of v_z over the hemisphere, which is pi.
struct WeightedDirection {
  V3f direction;
  double weight = 0;
};

/// One direction for each cell of a square grid over the unit disc: the mean of its points within the disc.
std::vector<WeightedDirection> disc_directions(int side) {
  constexpr int points = 8;  // per side of a cell
  std::vector<WeightedDirection> result;
  double total = 0;
  for (int cell = 0; cell < side * side; ++cell) {
    V2d sum(0, 0);
    double inside = 0;
    for (int point = 0; point < points * points; ++point) {
      const int row = cell / side;
      const int row_within = point / points;
      const V2d p(2 * (cell % side + (point % points + 0.5) / points) / side - 1,
                  2 * (row + (row_within + 0.5) / points) / side - 1);
      if (p.length2() >= 1) continue;
      sum += p;
      ++inside;
    }
    if (inside == 0) continue;
    const V2d mean = sum / inside;
    result.push_back({V3f(V3d(mean.x, mean.y, std::sqrt(1 - mean.length2()))), inside});
    total += inside;
  }
  for (WeightedDirection& d : result) d.weight *= std::numbers::pi / total;
  return result;
}

/// Integral over the outgoing hemisphere of alpha f v_z, per channel, of one texel.
V3d radiosity_of(const LitSide& side, int texel, const V3f& light,
                 const std::vector<WeightedDirection>& directions) {
  V3d sum(0, 0, 0);
  if (side.level == nullptr) return sum;
  const int width = side.level->width;
  for (const auto& [view, weight] : directions) {
    const Shading s = evaluate(*side.level, *side.info, texel % width, texel / width, light, view);
    sum += V3d(s.radiance) * (static_cast<double>(s.alpha) * weight);
  }
  return sum;
}

}  // namespace

double lobe_peak(const float* lobe) {
  const float base = std::max({std::abs(lobe[0]), std::abs(lobe[1]), lobe[2], 0.0F});
  return base > 0 ? std::pow(static_cast<double>(base), static_cast<double>(lobe[3])) : 0;
}

void warn_of_peaks(const FabricLevel& level, Side side, int level_index, bool half, IssueSink& sink) {
  const int lobes = level.lobe_count();
  const int stride = parameter_count(lobes);
  Maximum peak;
  Maximum exponent;
  for (int i = 0; i < 3 * level.texels(); ++i) {
    for (int k = 1; level.has(LayerKind::lobes) && k < stride; k += 4) {
      const float* lobe = &level.lobes()[i * stride + k];
      const int channel = i % 3 * stride + k + 3;
      peak.update(lobe_peak(lobe), i / 3, channel);
      exponent.update(static_cast<double>(lobe[3]), i / 3, channel);
    }
  }
  const auto place = [&](const Maximum& worst) {
    LayerShape shape;
    shape.lobes = lobes;
    shape.side = side;
    return value_place(part_name(LayerKind::lobes, side), level_index,
                       channel_name(LayerKind::lobes, shape, worst.channel), worst.texel, level.width);
  };
  if (peak.value > largest_half) {
    sink.add(Code::fabric_peak, place(peak),
             fmt::format("the lobe's peak is {:.3g}, beyond {} of half precision", peak.value, largest_half));
  }
  if (half && exponent.value > static_cast<double>(max_half_exponent)) {
    sink.add(Code::fabric_peak, place(exponent),
             fmt::format("exponent {:.4g} in half precision: the peak may be off by {:.0f} %", exponent.value,
                         100 * exponent.value / 2048));
  }
}

void warn_of_precision(const FabricLevel& level, Side side, int level_index, const LayerSet& half,
                       IssueSink& sink) {
  constexpr double allowed = 0.05;
  const auto rounded = [](float value) { return static_cast<float>(Imath::half(value)); };
  const auto warn = [&](LayerKind kind, const Maximum& worst, const char* what) {
    if (!(worst.value > allowed)) return;
    sink.add(Code::fabric_precision,
             fmt::format("{}/level {}/pixel {},{}", part_name(kind, side), level_index,
                         worst.texel % level.width, worst.texel / level.width),
             fmt::format("half precision changes {} by {:.3g} %", what, 100 * worst.value));
  };
  if (level.has(LayerKind::lobes) && half.contains(LayerKind::lobes)) {
    const int stride = parameter_count(level.lobe_count());
    Maximum worst;
    for (int i = 0; i < 3 * level.texels(); ++i) {
      const float* p = &level.lobes()[i * stride];
      double whole = static_cast<double>(p[0]);
      double change = std::abs(static_cast<double>(rounded(p[0])) - whole);
      for (int j = 1; j < stride; j += 4) {
        const std::array<float, 4> lobe{rounded(p[j]), rounded(p[j + 1]), rounded(p[j + 2]),
                                        rounded(p[j + 3])};
        const double peak = lobe_peak(p + j);
        whole += peak;
        change += std::abs(lobe_peak(lobe.data()) - peak);
      }
      if (whole > 0) worst.update(change / whole, i / 3, 0);
    }
    warn(LayerKind::lobes, worst, "the lobes");
  }
  if (level.has(LayerKind::products) && half.contains(LayerKind::products)) {
    const int count = level[LayerKind::products].channels;
    Maximum worst;
    for (int texel = 0; texel < level.texels(); ++texel) {
      double largest = 0;
      double change = 0;
      for (const float c : level.coefficients().subspan(std::size_t{1} * texel * count, count)) {
        largest = std::max(largest, static_cast<double>(std::abs(c)));
        change = std::max(change, static_cast<double>(std::abs(rounded(c) - c)));
      }
      if (largest > 0) worst.update(change / largest, texel, 0);
    }
    warn(LayerKind::products, worst, "the products");
  }
}

void warn_of_energy(const LitSide& reflecting, const LitSide& other, int level_index, IssueSink& sink) {
  constexpr double allowed = 1.01;
  constexpr std::size_t max_pairs = 131072;
  const FabricLevel& level = *reflecting.level;
  const float exponent =
      std::max(largest_exponent(level), other.level != nullptr ? largest_exponent(*other.level) : 0.0F);
  const double side = std::ceil(2.5 * std::sqrt(static_cast<double>(exponent)));
  const std::vector<WeightedDirection> directions =
      disc_directions(static_cast<int>(std::clamp(side, 24.0, 256.0)));
  const auto samples = static_cast<int>(max_pairs / directions.size());
  const int texels = level.texels();
  // Odd, so that no column is left out if the width is a power of two.
  const int step = texels <= samples ? 1 : (texels / samples) | 1;
  const float low = std::sqrt(0.75F);
  Maximum single;
  Maximum mean;
  for (const V3f& light :
       {V3f(0, 0, 1), V3f(low, 0, 0.5F), V3f(-low, 0, 0.5F), V3f(0, low, 0.5F), V3f(0, -low, 0.5F)}) {
    V3d sum(0, 0, 0);
    double count = 0;
    for (int texel = 0; texel < texels; texel += step) {
      const V3d out =
          radiosity_of(reflecting, texel, light, directions) + radiosity_of(other, texel, light, directions);
      for (int c = 0; c < 3; ++c) single.update(out[c], texel, c);
      sum += out;
      ++count;
    }
    for (int c = 0; c < 3; ++c) {
      mean.update(sum[c] / count / static_cast<double>(light.z), 0, c);
    }
  }
  const std::string place =
      (reflecting.info->side == Side::front ? "" : "back ") + fmt::format("level {}", level_index);
  if (single.value > allowed) {
    sink.add(
        Code::fabric_energy,
        fmt::format("{}/{}/{},{}", place, names::colour_suffix[single.channel], single.texel % level.width,
                    single.texel / level.width),
        fmt::format("sends out {:.3g} times what a surface that faces the light receives", single.value));
  }
  if (mean.value > allowed) {
    sink.add(Code::fabric_energy, fmt::format("{}/{}", place, names::colour_suffix[mean.channel]),
             fmt::format("the cloth sends out {:.3g} times the light that falls on it", mean.value));
  }
}

}  // namespace selvedge
