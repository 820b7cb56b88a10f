#include "fitter/view_table.h"

#include <algorithm>
#include <cmath>

namespace selvedge {

std::vector<double> fit_view_table(const TexelSamples& samples, int channel,
                                   const std::vector<double>& parameters, int lobes,
                                   const ViewTableOptions& options) {
  const std::size_t views = samples.weight.size();
  const std::vector<float> sums = lobe_sums(samples, parameters, lobes);
  const std::vector<float>& radiance = samples.radiance[static_cast<std::size_t>(channel)];
  std::vector<double> cross(views, 0);
  std::vector<double> square(views, 0);
  double total = 0;
  double weight = 0;
  for (std::size_t v = 0; v < views; ++v) {
    for (std::size_t i = samples.first[v]; i < samples.first[v + 1]; ++i) {
      const double g = static_cast<double>(samples.cosine[i] * sums[i]);
      cross[v] += samples.weight[v] * g * static_cast<double>(radiance[i]);
      square[v] += samples.weight[v] * g * g;
    }
    total += square[v];
    weight += samples.weight[v];
  }
  const double damping = weight > 0 ? options.damping * total / weight : 0;
  std::vector<double> table(views, 1);
  for (std::size_t v = 0; v < views; ++v) {
    const double denominator = square[v] + damping;
    if (denominator > 0) table[v] = std::clamp((cross[v] + damping) / denominator, 0.0, options.largest);
  }
  return table;
}

void normalise(const TexelSamples& samples, std::vector<double>& table, std::vector<double>& parameters,
               int lobes) {
  double sum = 0;
  double weight = 0;
  for (std::size_t v = 0; v < table.size(); ++v) {
    sum += samples.weight[v] * table[v];
    weight += samples.weight[v];
  }
  if (!(sum > 0)) return;
  const double mean = sum / weight;
  for (double& t : table) t /= mean;
  parameters[0] *= mean;
  for (int j = 0; j < lobes; ++j) {
    double* lobe = &parameters[static_cast<std::size_t>(1 + 4 * j)];
    const double c = std::pow(mean, 1 / lobe[3]);
    for (int k = 0; k < 3; ++k) lobe[k] *= c;
  }
}

}  // namespace selvedge
