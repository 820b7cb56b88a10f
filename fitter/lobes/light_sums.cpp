#include "fitter/lobes/light_sums.h"

#include <algorithm>

#include "format/simd/powers.h"

namespace selvedge {
namespace {

/// Sets `to`, [stride], to rho + sum_j size_j max(0, d_j . (l * v))^n_j for one light and every view.
template <std::size_t Count>
SELVEDGE_INLINE void add_lobes(const TexelSamples& samples, const V3f& light,
                               std::span<const LobeShape> shapes, std::span<const double> sizes, float* to) {
  using L = Lanes<Count>;
  const std::size_t stride = samples.stride();
  std::fill_n(to, stride, static_cast<float>(sizes[0]));
  for (std::size_t j = 0; j < shapes.size(); ++j) {
    const auto size = static_cast<float>(sizes[j + 1]);
    if (!(size > 0)) continue;
    V3f d;
    for (int k = 0; k < 3; ++k) {
      d[k] = static_cast<float>(shapes[j].direction[k]) * light[k];
    }
    const auto exponent = static_cast<float>(shapes[j].exponent);
    for (std::size_t v = 0; v < stride; v += L::count) {
      typename L::Floats x;
      typename L::Floats y;
      typename L::Floats z;
      L::load(&samples.view[0][v], x);
      L::load(&samples.view[1][v], y);
      L::load(&samples.view[2][v], z);
      typename L::Floats log;
      typename L::Floats power;
      L::log_and_power(x * d.x + y * d.y + z * d.z, exponent, log, power);
      typename L::Floats sum;
      L::load(to + v, sum);
      L::store(sum + size * power, to + v);
    }
  }
}

SELVEDGE_THREE_BODIES(add_lobes,
                      (const TexelSamples& samples, const V3f& light, std::span<const LobeShape> shapes,
                       std::span<const double> sizes, float* to),
                      (samples, light, shapes, sizes, to))

}  // namespace

LightSums light_sums(const TexelSamples& samples, int channel, std::span<const LobeShape> shapes,
                     std::span<const double> sizes, std::span<const double> table) {
  const std::size_t stride = samples.stride();
  const std::vector<float>& radiance = samples.radiance[channel];
  LightSums sums{std::vector<double>(samples.light_count, 0), std::vector<double>(samples.light_count, 0)};
  static const auto lobe_values = add_lobes_for_this_processor();
  std::vector<float> model(stride);
  for (std::size_t index = 0; index < samples.lights.size(); ++index) {
    const V3f& light = samples.lights[index];
    lobe_values(samples, light, shapes, sizes, model.data());
    double square = 0;
    double cross = 0;
    for (std::size_t v = 0; v < samples.views; ++v) {
      const double g = table[v] * static_cast<double>(light.z * model[v]);
      square += samples.weight[v] * g * g;
      cross += samples.weight[v] * g * static_cast<double>(radiance[index * stride + v]);
    }
    sums.square[samples.light_index[index]] = square;
    sums.cross[samples.light_index[index]] = cross;
  }
  return sums;
}

}  // namespace selvedge
