#include "fitter/light_sums.h"

#include "format/powers.h"

namespace selvedge {

LightSums light_sums(const TexelSamples& samples, int channel, std::span<const std::uint32_t> lights,
                     std::span<const LobeShape> shapes, std::span<const double> sizes,
                     std::span<const double> table) {
  using L = Lanes<4>;
  const std::size_t stride = samples.stride();
  const std::vector<float>& radiance = samples.radiance[static_cast<std::size_t>(channel)];
  LightSums sums{std::vector<double>(samples.all_lights, 0), std::vector<double>(samples.all_lights, 0)};
  std::vector<float> model(stride);
  for (const std::uint32_t index : lights) {
    const V3f& light = samples.lights[index];
    std::fill(model.begin(), model.end(), static_cast<float>(sizes[0]));
    for (std::size_t j = 0; j < shapes.size(); ++j) {
      const auto size = static_cast<float>(sizes[j + 1]);
      if (!(size > 0)) continue;
      V3f d;
      for (int k = 0; k < 3; ++k) {
        d[k] = static_cast<float>(shapes[j].direction[static_cast<std::size_t>(k)]) * light[k];
      }
      const auto exponent = static_cast<float>(shapes[j].exponent);
      for (std::size_t v = 0; v < stride; v += L::count) {
        L::Floats x;
        L::Floats y;
        L::Floats z;
        L::load(&samples.view[0][v], x);
        L::load(&samples.view[1][v], y);
        L::load(&samples.view[2][v], z);
        L::Floats log;
        L::Floats power;
        L::log_and_power(x * d.x + y * d.y + z * d.z, exponent, log, power);
        L::Floats sum;
        L::load(&model[v], sum);
        L::store(sum + size * power, &model[v]);
      }
    }
    double square = 0;
    double cross = 0;
    for (std::size_t v = 0; v < samples.views; ++v) {
      const double g = table[v] * static_cast<double>(light.z * model[v]);
      square += samples.weight[v] * g * g;
      cross += samples.weight[v] * g * static_cast<double>(radiance[index * stride + v]);
    }
    sums.square[samples.light_of[index]] = square;
    sums.cross[samples.light_of[index]] = cross;
  }
  return sums;
}

}  // namespace selvedge
