#include "fitter/solve/texel_samples.h"

#include <algorithm>
#include <cmath>

namespace selvedge {

TexelSamples gather_texel(const float* alpha, const V3f* radiance, const TexelDirections& directions,
                          const V3f& normal, const V3f& tangent) {
  const V3d n(normal);
  const V3d t(tangent);
  const V3d b = n.cross(t);
  const auto into_frame = [&](const V3f& d) { return V3f(V3d(V3d(d).dot(t), V3d(d).dot(b), V3d(d).dot(n))); };

  TexelSamples out;
  out.view_count = directions.views.size();
  out.grid = directions.grid;
  const std::size_t stride =
      (out.view_count + TexelSamples::lanes - 1) / TexelSamples::lanes * TexelSamples::lanes;
  out.view_weights.assign(stride, 0);
  for (auto& axis : out.view_xyz) axis.assign(stride, 0);
  for (std::size_t v = 0; v < out.view_count; ++v) {
    const V3f view = into_frame(directions.views[v]);
    for (std::size_t axis = 0; axis < 3; ++axis) out.view_xyz[axis][v] = view[static_cast<int>(axis)];
    out.view_weights[v] = static_cast<double>(alpha[v]);
  }

  const std::size_t all = directions.lights.size();
  for (std::size_t l = 0; l < all; ++l) {
    const V3f light = into_frame(directions.lights[l]);
    if (!(light.z > 0)) continue;
    out.light_index.push_back(static_cast<std::uint32_t>(l));
    out.lights.push_back(light);
  }
  for (std::size_t c = 0; c < 3; ++c) {
    const int channel = static_cast<int>(c);
    float largest = 0;
    for (std::size_t v = 0; v < out.view_count; ++v) {
      if (!(alpha[v] > 0)) continue;
      for (const std::uint32_t l : out.light_index)
        largest = std::max(largest, radiance[v * all + l][channel]);
    }
    // Denormal numbers are not scaled.
    if (largest > 1e-37F) out.scale[c] = std::exp2(std::ilogb(largest) + 1);
    out.radiance[c].assign(out.lights.size() * stride, 0);
    for (std::size_t i = 0; i < out.lights.size(); ++i) {
      for (std::size_t v = 0; v < out.view_count; ++v) {
        if (!(alpha[v] > 0)) continue;
        out.radiance[c][i * stride + v] = static_cast<float>(
            static_cast<double>(radiance[v * all + out.light_index[i]][channel]) / out.scale[c]);
      }
    }
  }
  return out;
}

}  // namespace selvedge
