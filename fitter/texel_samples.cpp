#include "fitter/texel_samples.h"

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
  out.samples.reserve(views.size() * lights.size());
  for (std::size_t v = 0; v < views.size(); ++v) {
    out.first.push_back(out.samples.size());
    const std::size_t entry = static_cast<std::size_t>(texel) * views.size() + v;
    const double weight = static_cast<double>(level.alpha[entry]);
    out.weight.push_back(weight);
    if (weight == 0) continue;
    const V3d view = into_frame(views[v]);
    for (std::size_t l = 0; l < lights.size(); ++l) {
      const V3d radiance(level.radiance[entry * lights.size() + l]);
      const V3d& light = local_lights[l];
      if (light.z > 0) {
        out.samples.push_back({light * view, light.z, radiance});
      } else {
        out.unreachable += weight * radiance.length2();
      }
    }
  }
  out.first.push_back(out.samples.size());
  return out;
}

}  // namespace selvedge
