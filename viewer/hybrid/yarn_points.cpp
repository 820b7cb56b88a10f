#include "viewer/hybrid/yarn_points.h"

#include "viewer/hybrid/yarn_surface.h"

namespace selvedge {
namespace {

V3f direction_of(const LaneDirections& d, std::size_t lane) { return {d.x[lane], d.y[lane], d.z[lane]}; }

/// Collects points of pixels, and shades as many as are traced together.
class PointShader {
 public:
  PointShader(const LaneFrames& frames, std::span<const LaneLight> lights, LaneShading& sum)
      : frames_(frames), lights_(lights), sum_(sum) {}

  void use(const Fabric& fabric) {
    if (fabric_ == &fabric) return;
    shade();
    fabric_ = &fabric;
  }

  /// A point of the pixel `lane`.
  void add(std::size_t lane, const V2f& uv, float weight) {
    uv_.set(count_, V3f(uv.x, uv.y, 0));
    view_.set(count_, direction_of(frames_.view, lane));
    pixel_[count_] = lane;
    weight_[count_] = weight;
    if (++count_ == yarn_lanes) shade();
  }

  /// Shades the remaining points.
  void shade() {
    if (count_ == 0) return;
    const Yarns& yarns = *fabric_->levels.front().yarns();
    const std::uint32_t met =
        yarns.trace(V2d(0, 0), uv_, fabric_->reference_height, view_, (1U << count_) - 1, hits_);
    std::uint32_t seen = 0;
    for (std::size_t i = 0; i < count_; ++i) {
      if ((met >> i & 1) == 0) continue;
      sum_.alpha[pixel_[i]] += weight_[i];
      if (view_.z[i] > 0) seen |= 1U << i;
    }
    if (seen != 0) light(yarns, seen);
    count_ = 0;
  }

 private:
  void light(const Yarns& yarns, std::uint32_t seen) {
    find_surface(yarns, hits_, seen, surface_);
    for (const LaneLight& light : lights_) {
      alignas(64) std::array<float, yarn_lanes> share{};
      std::uint32_t shines = 0;
      for (std::size_t i = 0; i < count_; ++i) {
        const std::size_t lane = pixel_[i];
        direction_.set(i, direction_of(light.direction, lane));
        share[i] = light.share[lane] * weight_[i];
        shines |= static_cast<std::uint32_t>(direction_.z[i] > 0 && light.share[lane] > 0) << i;
      }
      shines &= seen;
      if (shines == 0) continue;
      reflect(surface_, direction_, view_, reflection_);
      const std::uint32_t facing = reflection_.facing & shines;
      const std::uint32_t lit =
          facing == 0 ? 0 : facing & ~yarns.occluded(surface_.leave, direction_, facing);
      for (std::size_t i = 0; i < count_; ++i) {
        if ((shines >> i & 1) == 0) continue;
        V3f f = reflection_.indirect.at(i);
        if ((lit >> i & 1) != 0) f += reflection_.direct.at(i);
        const V3f radiance = f * light.irradiance * share[i];
        sum_.red[pixel_[i]] += radiance.x;
        sum_.green[pixel_[i]] += radiance.y;
        sum_.blue[pixel_[i]] += radiance.z;
      }
    }
  }

  const LaneFrames& frames_;
  std::span<const LaneLight> lights_;
  LaneShading& sum_;
  const Fabric* fabric_ = nullptr;
  std::size_t count_ = 0;
  YarnLanes uv_;
  YarnLanes view_;
  YarnLanes direction_;  ///< to a light
  std::array<std::size_t, yarn_lanes> pixel_{};
  std::array<float, yarn_lanes> weight_{};
  YarnHits hits_;
  YarnSurface surface_;
  YarnReflection reflection_;
};

}  // namespace

void add_yarn(const ShadingScene& scene, const PixelBlock& block, const LaneFrames& frames,
              std::span<const LaneLight> lights, LaneShading& sum) {
  const int n = scene.points;
  PointShader points(frames, lights, sum);
  for (std::size_t lane = 0; lane < block.count; ++lane) {
    if (!(block.yarn[lane] > 0)) continue;
    points.use(*scene.fabrics[scene.materials[block.surface[lane]].fabric].fabric);
    const float weight = block.yarn[lane] / static_cast<float>(n * n);
    for (int i = 0; i < n * n; ++i) {
      const int row = i / n;
      const float right = (static_cast<float>(i % n) + 0.5F) / static_cast<float>(n) - 0.5F;
      const float up = (static_cast<float>(row) + 0.5F) / static_cast<float>(n) - 0.5F;
      points.add(lane, block.uv(lane) + block.uv_right(lane) * right + block.uv_up(lane) * up, weight);
    }
  }
  points.shade();
}

}  // namespace selvedge
