#include "fitter/lobes/light_sums.h"

#include "fitter/lobes/lobe_values.h"

namespace selvedge {

LightSums light_sums(const TexelSamples& samples, int channel, std::span<const std::uint32_t> lights,
                     std::span<const LobeShape> shapes, std::span<const double> sizes,
                     std::span<const double> table) {
  const std::size_t stride = samples.stride();
  const std::vector<float>& radiance = samples.radiance[channel];
  LightSums sums{std::vector<double>(samples.all_lights, 0), std::vector<double>(samples.all_lights, 0)};
  std::vector<float> model(stride);
  for (const std::uint32_t index : lights) {
    const V3f& light = samples.lights[index];
    lobe_values(samples, index, shapes, sizes, model.data());
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
