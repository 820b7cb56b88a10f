#include "format/samples/pool.h"

#include <algorithm>

#include "format/base/parallel.h"
#include "format/fabric/fabric.h"

namespace selvedge {

std::vector<std::vector<Overlap>> texel_overlaps(int fine, int coarse) {
  std::vector<std::vector<Overlap>> result(coarse);
  // In units of 1 / coarse of a fine texel all borders are integers, so that overlaps are exact.
  for (int c = 0; c < coarse; ++c) {
    const std::int64_t begin = std::int64_t{c} * fine;
    const std::int64_t end = begin + fine;
    for (std::int64_t f = begin / coarse; f * coarse < end; ++f) {
      const std::int64_t shared = std::min(end, (f + 1) * coarse) - std::max(begin, f * coarse);
      result[c].push_back({static_cast<int>(f), static_cast<double>(shared) / static_cast<double>(fine)});
    }
  }
  return result;
}

SampleLevel pool(const SampleLevel& fine) {
  SampleLevel coarse{.width = level_size(fine.width, 1),
                     .height = level_size(fine.height, 1),
                     .views = fine.views,
                     .lights = fine.lights};
  const std::size_t texels = coarse.texels();
  const std::size_t views = fine.views;
  const std::size_t lights = fine.lights;
  coarse.alpha.assign(texels * views, 0);
  coarse.normal_sum.assign(texels, V3f(0, 0, 0));
  coarse.radiance.assign(texels * views * lights, V3f(0, 0, 0));
  const auto columns = texel_overlaps(fine.width, coarse.width);
  const auto rows = texel_overlaps(fine.height, coarse.height);
  parallel_for(0, coarse.texels(), [&](std::size_t texel) {
    std::vector<V3d> sum(lights);
    V3d normal(0, 0, 0);
    for (std::size_t view = 0; view < views; ++view) {
      double weight = 0;
      std::ranges::fill(sum, V3d(0, 0, 0));
      for (const Overlap& row : rows[texel / coarse.width]) {
        for (const Overlap& column : columns[texel % coarse.width]) {
          const std::size_t from = row.fine * fine.width + column.fine;
          // Sums of visible normals are already weighted by opacity.
          if (view == 0) normal += V3d(fine.normal_sum[from]) * (row.fraction * column.fraction);
          const double w =
              row.fraction * column.fraction * static_cast<double>(fine.alpha[from * views + view]);
          if (w == 0) continue;
          weight += w;
          const V3f* in = &fine.radiance[(from * views + view) * lights];
          for (std::size_t l = 0; l < lights; ++l) sum[l] += V3d(in[l]) * w;
        }
      }
      coarse.alpha[texel * views + view] = static_cast<float>(std::min(weight, 1.0));
      if (weight == 0) continue;
      V3f* out = &coarse.radiance[(texel * views + view) * lights];
      for (std::size_t l = 0; l < lights; ++l) out[l] = V3f(sum[l] / weight);
    }
    coarse.normal_sum[texel] = V3f(normal);
  });
  return coarse;
}

std::vector<V3d> pool_image(const std::vector<V3d>& values, int width, int height) {
  const int coarse_width = level_size(width, 1);
  const int coarse_height = level_size(height, 1);
  const auto columns = texel_overlaps(width, coarse_width);
  const auto rows = texel_overlaps(height, coarse_height);
  std::vector<V3d> result;
  for (const auto& row : rows) {
    for (const auto& column : columns) {
      V3d sum(0, 0, 0);
      for (const Overlap& r : row)
        for (const Overlap& c : column) sum += values[r.fine * width + c.fine] * (r.fraction * c.fraction);
      result.push_back(sum);
    }
  }
  return result;
}

}  // namespace selvedge
