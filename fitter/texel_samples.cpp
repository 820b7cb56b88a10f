#include "fitter/texel_samples.h"

#include "fitter/powers.h"

namespace selvedge {

TexelSamples gather_texel(const SampleLevel& level, int texel, const std::vector<V3f>& views,
                          const std::vector<V3f>& lights, const V3f& normal, const V3f& tangent) {
  const V3d n(normal);
  const V3d t(tangent);
  const V3d b = n.cross(t);
  const auto into_frame = [&](const V3f& d) { return V3d(V3d(d).dot(t), V3d(d).dot(b), V3d(d).dot(n)); };
  std::vector<V3d> local_lights;
  for (const V3f& light : lights) local_lights.push_back(into_frame(light));

  TexelSamples out;
  const std::array arrays{&out.x,           &out.y,           &out.z,          &out.cosine,
                          &out.radiance[0], &out.radiance[1], &out.radiance[2]};
  for (auto* values : arrays) values->reserve(views.size() * lights.size() + TexelSamples::lanes);
  for (std::size_t v = 0; v < views.size(); ++v) {
    out.first.push_back(out.size());
    const std::size_t entry = static_cast<std::size_t>(texel) * views.size() + v;
    const double weight = static_cast<double>(level.alpha[entry]);
    out.weight.push_back(weight);
    if (weight == 0) continue;
    const V3d view = into_frame(views[v]);
    for (std::size_t l = 0; l < lights.size(); ++l) {
      const V3f& radiance = level.radiance[entry * lights.size() + l];
      const V3d& light = local_lights[l];
      if (!(light.z > 0)) {
        out.unreachable += weight * V3d(radiance).length2();
        continue;
      }
      out.x.push_back(static_cast<float>(light.x * view.x));
      out.y.push_back(static_cast<float>(light.y * view.y));
      out.z.push_back(static_cast<float>(light.z * view.z));
      out.cosine.push_back(static_cast<float>(light.z));
      for (std::size_t c = 0; c < 3; ++c) out.radiance[c].push_back(radiance[static_cast<int>(c)]);
    }
  }
  out.first.push_back(out.size());
  const std::size_t padded =
      (out.size() + TexelSamples::lanes - 1) / TexelSamples::lanes * TexelSamples::lanes;
  for (auto* values : arrays) values->resize(padded, 0);
  return out;
}

void LobeTerms::compute(const TexelSamples& samples, const double* lobe) {
  base.resize(samples.size());
  logarithm.resize(samples.size());
  power.resize(samples.size());
  const auto cx = static_cast<float>(lobe[0]);
  const auto cy = static_cast<float>(lobe[1]);
  const auto cz = static_cast<float>(lobe[2]);
  for (std::size_t i = 0; i < base.size(); ++i) {
    base[i] = cx * samples.x[i] + cy * samples.y[i] + cz * samples.z[i];
  }
  powers(base.data(), static_cast<float>(lobe[3]), logarithm.data(), power.data(), base.size());
}

std::vector<float> lobe_sums(const TexelSamples& samples, const std::vector<double>& parameters, int lobes) {
  std::vector<float> sums(samples.size(), static_cast<float>(parameters[0]));
  LobeTerms terms;
  for (int j = 0; j < lobes; ++j) {
    terms.compute(samples, &parameters[static_cast<std::size_t>(1 + 4 * j)]);
    for (std::size_t i = 0; i < sums.size(); ++i) sums[i] += terms.power[i];
  }
  return sums;
}

}  // namespace selvedge
