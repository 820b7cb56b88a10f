#include "converter/dress/uv_scale.h"

#include <Imath/ImathMatrix.h>

#include <algorithm>
#include <cmath>

namespace selvedge {
namespace {

struct Sample {
  double length;
  double weight;
};

double median(std::vector<Sample>& samples) {
  std::sort(samples.begin(), samples.end(),
            [](const Sample& a, const Sample& b) { return a.length < b.length; });
  double total = 0;
  for (const Sample& sample : samples) total += sample.weight;
  double sum = 0;
  for (const Sample& sample : samples) {
    sum += sample.weight;
    if (sum >= total / 2) return sample.length;
  }
  return 0;
}

struct Samples {
  std::vector<Sample> u;
  std::vector<Sample> v;
};

Samples measure(const ScenePrimitive& primitive, const M44d& world, int tex_coord) {
  Samples samples;
  const std::vector<V2d>& uvs = primitive.tex_coords[tex_coord];
  if (uvs.empty()) return samples;
  for (std::size_t t = 0; t + 2 < primitive.indices.size(); t += 3) {
    const std::size_t a = primitive.indices[t];
    const std::size_t b = primitive.indices[t + 1];
    const std::size_t c = primitive.indices[t + 2];
    const V3d origin = V3d(primitive.positions[a]) * world;
    const V3d e1 = V3d(primitive.positions[b]) * world - origin;
    const V3d e2 = V3d(primitive.positions[c]) * world - origin;
    const V2d d1 = uvs[b] - uvs[a];
    const V2d d2 = uvs[c] - uvs[a];
    const double determinant = d1.x * d2.y - d1.y * d2.x;
    const double area = e1.cross(e2).length();
    const double u = (e1 * d2.y - e2 * d1.y).length() / std::abs(determinant);
    const double v = (e2 * d1.x - e1 * d2.x).length() / std::abs(determinant);
    if (!(area > 0) || !std::isfinite(u) || !std::isfinite(v)) continue;
    samples.u.push_back({u, area});
    samples.v.push_back({v, area});
  }
  return samples;
}

}  // namespace

UvSize measure_uv(const Scene& scene, const std::set<int>& chosen, int tex_coord) {
  UvSize size;
  Samples all;
  for (const SceneInstance& instance : scene.instances) {
    if (!chosen.contains(instance.primitive)) continue;
    Samples samples = measure(scene.primitives[instance.primitive], instance.world, tex_coord);
    if (samples.u.empty()) continue;
    all.u.insert(all.u.end(), samples.u.begin(), samples.u.end());
    all.v.insert(all.v.end(), samples.v.begin(), samples.v.end());
    const V2d medians(median(samples.u), median(samples.v));
    for (int c = 0; c < 2; ++c) {
      size.smallest[c] = size.primitives == 0 ? medians[c] : std::min(size.smallest[c], medians[c]);
      size.largest[c] = size.primitives == 0 ? medians[c] : std::max(size.largest[c], medians[c]);
    }
    ++size.primitives;
  }
  size.metres = V2d(median(all.u), median(all.v));
  return size;
}

}  // namespace selvedge
