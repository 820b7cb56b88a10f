#include "viewer/hybrid/yarn_points.h"

#include <algorithm>
#include <climits>
#include <cmath>
#include <numbers>
#include <numeric>
#include <optional>

#include "viewer/hybrid/curved_cloth.h"
#include "viewer/hybrid/yarn_samples.h"

namespace selvedge {
namespace {

/// Corners whose radiance differs by less, as a share of what white sends back, show the same.
constexpr float same_light = 4.0F / 255;
/// More than so much, and an edge may lie between.
constexpr float smooth_light = 24.0F / 255;
/// Neighbours of one surface agree about their common corner to this share of a pixel.
constexpr float same_place = 0.1F;

V3f direction_of(const LaneDirections& d, std::size_t lane) { return {d.x[lane], d.y[lane], d.z[lane]}; }

constexpr std::uint32_t none = ~0U;

/// Width of a pixel across the view, from its change of place, mm: of the ellipse on the plane, the shorter
/// axis.
float spacing_of(const V2f& right, const V2f& up) {
  const float e = right.x * right.x + up.x * up.x;
  const float f = right.x * right.y + up.x * up.y;
  const float g = right.y * right.y + up.y * up.y;
  const float long2 = 0.5F * (e + g) + std::sqrt(0.25F * (e - g) * (e - g) + f * f);
  return std::abs(right.x * up.y - right.y * up.x) / std::sqrt(std::max(long2, 1e-30F));
}

/// Of the front of the cloth at a pixel, along the view; 0 where the material shows nothing behind the yarn.
float curvature_at(const ShadingScene& scene, const ShadedBlock& block, std::size_t lane, const V2f& period) {
  const PixelPlaces& of = block.places;
  if (scene.mesh == nullptr || !scene.materials[of.surface[lane]].keeps_opacity) return 0;
  const V3f view = direction_of(block.frames.view, lane);
  const float level = std::hypot(view.x, view.y);
  if (!(level > 0)) return 0;
  CurvedTriangle triangle;
  for (std::size_t k = 0; k < 3; ++k) {
    const auto& [normal_u, tangent_v] =
        scene.mesh->attributes[scene.mesh->triangles[of.triangle[lane]].corners[k]];
    triangle.uv[k] = {normal_u[3], tangent_v[3]};
    triangle.normals[k] = {normal_u[0], normal_u[1], normal_u[2]};
  }
  const V2f across = V2f(view.x, view.y) / level;
  const V3f along =
      direction_of(block.frames.tangent, lane) * across.x + direction_of(block.frames.up, lane) * across.y;
  return curvature_along(triangle, period, across, along, direction_of(of.normal, lane).length());
}

YarnPixels pixels_of(const ShadingScene& scene, std::span<const ShadedBlock> blocks,
                     const PackedFabric& fabric) {
  YarnPixels result;
  const Yarns& yarns = *fabric.fabric->levels.front().yarns();
  const V2f period = yarns.period();
  const float plane = fabric.fabric->reference_height;
  const auto points = static_cast<float>(scene.points);
  for (const Light& light : scene.lights) result.irradiance.push_back(light.irradiance);
  for (std::uint32_t b = 0; b < blocks.size(); ++b) {
    const PixelPlaces& of = blocks[b].places;
    for (std::uint32_t lane = 0; of.shows_yarn && lane < of.count; ++lane) {
      if (!(of.yarn[lane] > 0) || seen_fabric(scene, of, lane) != &fabric) continue;
      const V3f view = direction_of(blocks[b].frames.view, lane);
      const float depth =
          grazing_depth(view, curvature_at(scene, blocks[b], lane, period), plane - yarns.inside().low);
      result.pixels.push_back({b, lane, V2i(of.x[lane], of.y[lane]), of.uv(lane), of.uv_right(lane),
                               of.uv_up(lane), view, depth, of.surface[lane], of.side[lane],
                               spacing_of(of.uv_right(lane) * period, of.uv_up(lane) * period) / points});
      for (const LaneLight& light : blocks[b].lights)
        result.lights.push_back({direction_of(light.direction, lane), light.share[lane]});
      if (scene.around == nullptr) continue;
      SmoothLight& around = result.around.emplace_back();
      for (std::size_t k = 0; k < smooth_functions; ++k) {
        const LaneColours& factor = blocks[b].around.factors[k];
        around.factors[k] = {factor[0][lane], factor[1][lane], factor[2][lane]};
      }
    }
  }
  return result;
}

/// Shades the yarn of one side of a fabric.
class PixelShader {
 public:
  PixelShader(const ShadingScene& scene, std::span<ShadedBlock> blocks, const PackedFabric& packed)
      : points_(scene.points), blocks_(blocks), of_(pixels_of(scene, blocks, packed)), shader_(packed, of_) {
    const V2i texels = packed.fabric->texels();
    texels_ = static_cast<float>(texels.x) * static_cast<float>(texels.y);
    coarse_pixel_ = 0.2F * packed.largest_yarn_pixel;
    V3f sum(0, 0, 0);
    for (const V3f& irradiance : of_.irradiance) sum += irradiance;
    white_ = std::max({sum.x, sum.y, sum.z}) * std::numbers::inv_pi_v<float>;
    if (scene.around != nullptr) {
      const V3f& mean = scene.around->factors[0];
      white_ += std::max({mean.x, mean.y, mean.z});
    }
  }

  void shade() {
    if (of_.pixels.empty()) return;
    std::vector<std::uint32_t> apart;
    if (is_coarse()) {
      apart.resize(of_.pixels.size());
      std::iota(apart.begin(), apart.end(), 0U);
      look_closer(apart);
      return;
    }
    place_corners();
    shader_.look(samples_);
    for (std::uint32_t i = 0; i < of_.pixels.size(); ++i) {
      if (const auto mean = mean_of_corners(i)) {
        YarnSample sample = samples_[i];
        sample.radiance = *mean;
        add(sample, i, 1);
      } else {
        apart.push_back(i);
      }
    }
    look_closer(apart);
  }

 private:
  /// Whether pixels are so large that corners of most of them differ, and cost more than they save.
  bool is_coarse() const {
    const YarnPixel& pixel = of_.pixels.front();
    const float area = std::abs(pixel.right.x * pixel.up.y - pixel.right.y * pixel.up.x) * texels_;
    return points_ <= 2 && area > coarse_pixel_ * coarse_pixel_;
  }

  /// A pixel's corners: its own is the lower left one; the others belong to its neighbours, if these are of
  /// the same surface.
  void place_corners() {
    V2i low(INT_MAX, INT_MAX);
    V2i high(0, 0);
    const std::vector<YarnPixel>& pixels = of_.pixels;
    for (const YarnPixel& pixel : pixels) {
      const V2i& at = pixel.position;
      low = {std::min(low.x, at.x), std::min(low.y, at.y)};
      high = {std::max(high.x, at.x), std::max(high.y, at.y)};
    }
    const int width = high.x - low.x + 2;
    std::vector<std::uint32_t> numbers(static_cast<std::size_t>(width) * (high.y - low.y + 2), none);
    const auto slot = [&](const V2i& at) {
      return static_cast<std::size_t>(at.y - low.y) * width + (at.x - low.x);
    };
    samples_.reserve(pixels.size() * 5 / 4);
    for (std::uint32_t i = 0; i < pixels.size(); ++i) {
      numbers[slot(pixels[i].position)] = i;
      samples_.push_back({pixels[i].place(-0.5F, -0.5F), i});
    }
    corners_.resize(pixels.size());
    before_.assign(pixels.size(), {none, none});
    for (std::uint32_t i = 0; i < pixels.size(); ++i) {
      corners_[i][0] = i;
      for (std::uint32_t k = 1; k < 4; ++k) {
        const V2i step(static_cast<int>(k % 2), static_cast<int>(k / 2));
        const std::uint32_t owner = numbers[slot(pixels[i].position + step)];
        const V2f wanted =
            pixels[i].place(static_cast<float>(step.x) - 0.5F, static_cast<float>(step.y) - 0.5F);
        const bool shared = owner != none && is_shared(pixels[i], pixels[owner], wanted - samples_[owner].uv);
        corners_[i][k] = shared ? owner : static_cast<std::uint32_t>(samples_.size());
        if (!shared) samples_.push_back({wanted, i});
        if (shared && k < 3) before_[owner][k - 1] = i;
      }
    }
  }

  /// Whether corners of neighbours, so far apart, are the same.
  static bool is_shared(const YarnPixel& a, const YarnPixel& b, V2f apart) {
    if (a.surface != b.surface || a.side != b.side) return false;
    // Without whole repeats.
    for (int axis = 0; axis < 2; ++axis)
      apart[axis] -= apart[axis] > 0.5F ? 1.0F : apart[axis] < -0.5F ? -1.0F : 0.0F;
    return apart.length2() < same_place * same_place * (a.right.length2() + a.up.length2());
  }

  static bool same_yarn(const YarnSample& a, const YarnSample& b) {
    return a.lit == b.lit && std::abs(a.segment - b.segment) <= 1;
  }

  /// The mean of what the pixel's points would have, if its corners show one yarn in one light. Where the
  /// light changes, the corners beside them have to show how it bends.
  std::optional<V3f> mean_of_corners(std::uint32_t i) const {
    const auto at = [&](std::uint32_t pixel, std::size_t k) -> const YarnSample& {
      return samples_[corners_[pixel][k]];
    };
    V3f low = samples_[i].radiance;
    V3f high = low;
    V3f mean(0, 0, 0);
    for (std::size_t k = 0; k < 4; ++k) {
      if (!same_yarn(at(i, k), samples_[i])) return std::nullopt;
      const V3f& radiance = at(i, k).radiance;
      mean += radiance * 0.25F;
      low = {std::min(low.x, radiance.x), std::min(low.y, radiance.y), std::min(low.z, radiance.z)};
      high = {std::max(high.x, radiance.x), std::max(high.y, radiance.y), std::max(high.z, radiance.z)};
    }
    const V3f range = high - low;
    const float most = std::max({range.x, range.y, range.z});
    if (most <= same_light * white_) return mean;
    if (most > smooth_light * white_) return std::nullopt;
    V3f bend(0, 0, 0);
    for (std::size_t axis = 0; axis < 2; ++axis) {
      const std::size_t next = axis + 1;   // the corner that lies one pixel along the axis
      const std::size_t other = 2 - axis;  // and one across it
      const std::uint32_t before = before_[i][axis];
      const std::uint32_t after = corners_[i][next];
      if (before == none || after >= of_.pixels.size()) return std::nullopt;
      for (const YarnSample* s : {&at(before, 0), &at(before, other), &at(after, next), &at(after, 3)}) {
        if (!same_yarn(*s, samples_[i])) return std::nullopt;
        bend += s->radiance * 0.25F;
      }
      bend -= mean;
    }
    // Means of a parabola: over the corners, and over n points a side.
    mean -= bend * (0.125F - (1 - 1 / static_cast<float>(points_ * points_)) / 24);
    return V3f(std::max(mean.x, 0.0F), std::max(mean.y, 0.0F), std::max(mean.z, 0.0F));
  }

  void add(const YarnSample& sample, std::uint32_t pixel, float weight) {
    if (sample.segment == no_segment) return;
    const YarnPixel& of = of_.pixels[pixel];
    ShadedBlock& block = blocks_[of.block];
    weight *= block.places.yarn[of.lane];
    block.light.alpha[of.lane] += weight;
    block.light.red[of.lane] += sample.radiance.x * weight;
    block.light.green[of.lane] += sample.radiance.y * weight;
    block.light.blue[of.lane] += sample.radiance.z * weight;
  }

  void look_closer(std::span<const std::uint32_t> pixels) {
    const int n = points_;
    samples_.clear();
    for (const std::uint32_t i : pixels) {
      for (int k = 0; k < n * n; ++k) {
        const int row = k / n;
        const float right = (static_cast<float>(k % n) + 0.5F) / static_cast<float>(n) - 0.5F;
        const float up = (static_cast<float>(row) + 0.5F) / static_cast<float>(n) - 0.5F;
        samples_.push_back({of_.pixels[i].place(right, up), i});
      }
    }
    shader_.look(samples_);
    for (const YarnSample& sample : samples_) add(sample, sample.pixel, 1 / static_cast<float>(n * n));
  }

  int points_;
  std::span<ShadedBlock> blocks_;
  YarnPixels of_;
  SampleShader shader_;
  float texels_ = 0;                 ///< of a repeat
  float coarse_pixel_ = 0;           ///< width, texels
  float white_ = 0;                  ///< radiance of white that faces all lights
  std::vector<YarnSample> samples_;  ///< at first pixel i's own corner is the i-th
  std::vector<std::array<std::uint32_t, 4>> corners_;
  std::vector<std::array<std::uint32_t, 2>> before_;  ///< the neighbours on the left and below
};

}  // namespace

void add_yarn(const ShadingScene& scene, std::span<ShadedBlock> blocks) {
  for (const PackedFabric& fabric : scene.fabrics) {
    if (!(fabric.largest_yarn_pixel > 0)) continue;
    PixelShader(scene, blocks, fabric).shade();
    if (fabric.turned) PixelShader(scene, blocks, *fabric.turned).shade();
  }
}

}  // namespace selvedge
