#include "viewer/hybrid/deep_pixels.h"

#include <algorithm>

namespace selvedge {

bool DeepPixels::has_depth_layer(int side, int round) const {
  return std::any_of(pixels_.begin(), pixels_.end(), [&](const Pixel& p) { return p.counts[side] > round; });
}

void DeepPixels::add_depth_layer(int side, int round, const DrawnSide& drawn) {
  for (std::uint32_t number = 0; number < pixels_.size(); ++number) {
    const Pixel& p = pixels_[number];
    const float depth = drawn.visible.depth[p.index_in_band];
    if (p.counts[side] <= round || !(depth < 1)) continue;
    const std::uint32_t triangle = drawn.triangle_list[drawn.visible.triangles[p.index_in_band]];
    hits_.push_back({p.index_in_band, depth, static_cast<TriangleSide>(2 * triangle + side), number,
                     static_cast<std::uint32_t>(pbr_.size())});
    pbr_.push_back(drawn.pbr_at(p.index_in_band));
  }
}

DeepLayers DeepPixels::sorted_layers() {
  DeepLayers result = sort_by_pixel(pixels_.size(), hits_);
  result.pbr = std::move(pbr_);
  return result;
}

DeepLayers sort_by_pixel(std::size_t pixels, std::span<const DeepHit> hits) {
  // A counting sort by pixels, of which each has few hits.
  DeepLayers result;
  result.starts.assign(pixels + 1, 0);
  result.hits.resize(hits.size());
  for (const DeepHit& hit : hits) ++result.starts[hit.deep_pixel + 1];
  for (std::size_t i = 1; i < result.starts.size(); ++i) result.starts[i] += result.starts[i - 1];
  std::vector<std::uint32_t> next(result.starts);
  for (const DeepHit& hit : hits) result.hits[next[hit.deep_pixel]++] = hit;
  for (std::size_t i = 0; i < result.pixels(); ++i) {
    std::sort(result.hits.begin() + result.starts[i], result.hits.begin() + result.starts[i + 1],
              [](const DeepHit& a, const DeepHit& b) {
                return a.depth != b.depth ? a.depth < b.depth : a.surface < b.surface;
              });
  }
  return result;
}

}  // namespace selvedge
