#include "format/cells/cell_shadows.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace selvedge {
namespace {

constexpr int max_side = 512;       ///< of a grid
constexpr int max_sky_side = 2048;  ///< of one that nobody keeps
/// Largest shift of a shadow by the rounding of its direction, texels; and the largest step, also of large
/// cells, whose grids are dear: it costs 0.1 dB.
constexpr float max_moved = 1;
constexpr float largest_step = 0.1F;
constexpr float largest_step_of_large = 0.2F;
/// Texels, and least fraction of the repeat, of at most so many radii of the thinnest ply, by which points
/// leave the yarn before they are looked up.
constexpr float shadow_bias = 0.7F;
constexpr float min_bias = 0.003F;
constexpr float max_bias_radii = 32;
/// Slope of the rays of an image's own grid: lower light, of which little is left, passes over far more yarn.
constexpr float max_own_slope = 8;
/// Pieces of such a grid are longer than asked for: it costs 0.1 dB, and saves half of its time.
constexpr float own_piece_length = 2;
/// Hairs that cast shadows in large cells are thinner than pixels ask for: their noise is seen.
constexpr float hair_width_of_asked = 0.3F;

/// Texels along a length, as much longer where light is slanted.
float texels_of(float length, float slope, float width) {
  return length / (width * std::sqrt(1 + slope * slope));
}

}  // namespace

CellShadows::CellShadows(const CellYarn& yarn) : yarn_(yarn) {
  const Yarns::Geometry inside = yarn.yarns().geometry();
  relief_ = std::max(inside.max_z - inside.min_z, 1e-9F);
  for (const YarnCurve& curve : yarn.yarns().data().curves)
    radius_ = std::min(radius_, ply_or_yarn_radius(curve));
}

std::size_t CellShadows::bytes() const {
  std::size_t sum = 0;
  for (const Grids* grids : {&latest_, &older_})
    for (const auto& [key, shadow] : *grids) sum += shadow->bytes();
  return sum;
}

/// Counts a grid that it finds as asked for.
std::shared_ptr<const CellShadow> CellShadows::find(const Key& key) {
  if (const auto found = latest_.find(key); found != latest_.end()) return found->second;
  auto node = older_.extract(key);
  if (node.empty()) return nullptr;
  keep(key, node.mapped());
  return node.mapped();
}

void CellShadows::keep(const Key& key, std::shared_ptr<const CellShadow> shadow) {
  if (latest_bytes_ + shadow->bytes() > max_bytes_ / 2) {
    older_ = std::exchange(latest_, {});
    latest_bytes_ = 0;
  }
  latest_bytes_ += shadow->bytes();
  latest_.emplace(key, std::move(shadow));
}

/// Bounds texels by the yarn, and rounds their width. Returns the width that was asked for of large cells,
/// which are as coarse as in images where pixels do not resolve them; else 0.
float CellShadows::fit(ShadowDetail& detail) const {
  const auto rounded_width = [](float width, float steps) {
    return std::exp2(std::round(steps * std::log2(std::clamp(width, 1e-12F, 1e12F))) / steps);
  };
  const float asked = yarn_.has_large_cell() ? rounded_width(detail.texel_width, 1) : 0;
  // Points leave the yarn by a fraction of a texel before they are looked up: light would pass under thin
  // plies.
  detail.texel_width =
      rounded_width(std::min(detail.texel_width, radius_ * (detail.has_hairs ? 0.5F : 1.0F)), 4);
  if (asked > detail.texel_width) {
    detail.max_piece_texels *= asked / detail.texel_width;
    detail.ray_width_texels *= std::max(1.0F, hair_width_of_asked * asked / detail.texel_width);
  }
  return asked;
}

/// Sets the texels of a cell.
std::shared_ptr<CellShadow> CellShadows::made(const V2f& slope, const ShadowDetail& detail,
                                              CellSize size) const {
  auto shadow = std::make_shared<CellShadow>();
  shadow->slope = slope;
  const V2f period = image_period(yarn_, size);
  float widest = 0;
  for (int axis = 0; axis < 2; ++axis)
    widest = std::max(widest, period[axis] / (static_cast<float>(size.repeat_samples[axis]) *
                                              std::sqrt(1 + slope[axis] * slope[axis])));
  // A small grid has smaller texels than asked for.
  const V2f& repeat = yarn_.yarns().period();
  shadow->bias_mm =
      shadow_bias * std::max(std::min(detail.texel_width, widest),
                             min_bias * std::min({repeat.x, repeat.y, max_bias_radii * radius_}));
  shadow->grid.resize(size, false);
  splat(yarn_, yarn_.pieces(detail.max_piece_texels * detail.texel_width),
        {slope, detail.ray_width_texels * detail.texel_width, detail.has_hairs}, shadow->grid);
  return shadow;
}

std::shared_ptr<const CellShadow> CellShadows::cast(const V3f& direction, ShadowDetail detail) {
  const float asked = fit(detail);
  const float moved = max_moved * std::max(detail.texel_width, asked / 2);
  // The arguments of the hyperbolic sines that are its slopes: texels are as much longer where light is
  // slanted.
  const float step =
      std::min(2 * moved / relief_, yarn_.has_large_cell() ? largest_step_of_large : largest_step);
  const V2f slope = ray_slope(direction);
  const auto rounded = [&](float s) { return static_cast<std::int32_t>(std::lround(std::asinh(s) / step)); };
  const Key key{detail, rounded(slope.x), rounded(slope.y)};
  {
    const std::scoped_lock lock(mutex_);
    if (auto found = find(key)) return found;
  }
  const V2f rounded_slope(std::sinh(static_cast<float>(key.x) * step),
                          std::sinh(static_cast<float>(key.y) * step));
  CellSize size;
  for (int axis = 0; axis < 2; ++axis)
    size.repeat_samples[axis] = static_cast<int>(
        std::clamp(texels_of(yarn_.yarns().period()[axis], rounded_slope[axis], detail.texel_width) + 0.5F,
                   static_cast<float>(min_cell_texels), static_cast<float>(max_side)));
  auto shadow = made(rounded_slope, detail, size);
  const std::scoped_lock lock(mutex_);
  // Another thread may have been faster, with the same result.
  if (auto found = find(key)) return found;
  keep(key, shadow);
  return shadow;
}

std::shared_ptr<const CellShadow> CellShadows::cast(const V3f& direction, ShadowDetail detail,
                                                    const ShadedWindow& window) const {
  fit(detail);
  detail.max_piece_texels *= own_piece_length;
  const CellSize& image = window.size;
  V2f slope = ray_slope(direction);
  if (slope.length() > max_own_slope) slope *= max_own_slope / slope.length();
  const V2f period = image_period(yarn_, image);
  CellSize size{.shows_map = image.shows_map, .first_stitch = image.first_stitch};
  for (int axis = 0; axis < 2; ++axis) {
    // A point above the plane lies on the rays of both.
    const auto beside = [&](float height) {
      return (window.slope[axis] - slope[axis]) * (height - yarn_.reference_height());
    };
    const auto [low, high] = std::minmax({beside(window.heights.x), beside(window.heights.y)});
    const float sample = period[axis] / static_cast<float>(image.repeat_samples[axis]);
    const float begin = static_cast<float>(image.unwrapped_origin()[axis]) * sample + low;
    const float length = static_cast<float>(image.window_samples[axis]) * sample + high - low;
    const float count = texels_of(length, slope[axis], detail.texel_width);
    const float texel =
        length / std::clamp(count, static_cast<float>(min_cell_texels), static_cast<float>(max_side));
    const int texels = std::max(static_cast<int>(period[axis] / texel), 2 * min_cell_texels);
    const float per_mm = static_cast<float>(texels) / period[axis];
    // Points leave the yarn before they are looked up.
    const int first = static_cast<int>(std::floor(begin * per_mm)) - 2;
    const int all = static_cast<int>(std::ceil(length * per_mm)) + 5;
    size.repeat_samples[axis] = texels;
    size.window_origin[axis] = (first % texels + texels) % texels;
    size.window_samples[axis] = std::min(all, texels);
  }
  return made(slope, detail, size);
}

LightCaster CellShadows::sky_caster() const {
  // Light from all around is smooth: pieces and hairs are coarse.
  const ShadowDetail detail{radius_, 6, 1, true};
  return [this, detail](const V3f& light) -> LightAtPoint {
    const V2f slope = ray_slope(light);
    const V2f period = yarn_.yarns().period();
    CellSize size;
    for (int axis = 0; axis < 2; ++axis)
      size.repeat_samples[axis] =
          std::clamp(static_cast<int>(texels_of(period[axis], slope[axis], detail.texel_width)),
                     min_cell_texels, max_sky_side);
    return [shadow = made(slope, detail, size), period,
            plane = yarn_.reference_height()](const StationPoint& point) {
      const V3f at = point.position + point.normal * shadow->bias_mm;
      const DepthGrid& grid = shadow->grid;
      V2i texel;
      for (int axis = 0; axis < 2; ++axis) {
        const float place = (at[axis] - shadow->slope[axis] * (at.z - plane)) / period[axis];
        texel[axis] = static_cast<int>((place - std::floor(place)) * static_cast<float>(grid.period[axis])) %
                      grid.period[axis];
      }
      return grid.z[static_cast<std::size_t>(texel.y) * grid.stride + texel.x] > at.z ? 0.0F : 1.0F;
    };
  };
}

}  // namespace selvedge
