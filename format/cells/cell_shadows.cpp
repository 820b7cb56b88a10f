#include "format/cells/cell_shadows.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace selvedge {
namespace {

constexpr int max_side = 512;  ///< of a grid
/// Largest shift of a shadow by the rounding of its direction, texels, and the largest step.
constexpr float max_moved = 1;
constexpr float largest_step = 0.1F;

std::size_t bytes_of(const CellShadow& shadow) { return shadow.grid.z.size() * sizeof(float); }

}  // namespace

CellShadows::CellShadows(const CellYarn& yarn) : yarn_(yarn) {
  const Yarns::Geometry inside = yarn.yarns().geometry();
  relief_ = std::max(inside.max_z - inside.min_z, 1e-9F);
  for (const YarnCurve& curve : yarn.yarns().data().curves)
    radius_ = std::min(radius_, ply_or_yarn_radius(curve));
}

/// Counts a grid that it finds as asked for.
std::shared_ptr<const CellShadow> CellShadows::find(const Key& key) {
  if (const auto found = latest_.grids.find(key); found != latest_.grids.end()) return found->second;
  auto node = older_.grids.extract(key);
  if (node.empty()) return nullptr;
  older_.bytes -= bytes_of(*node.mapped());
  keep(key, node.mapped());
  return node.mapped();
}

void CellShadows::keep(const Key& key, std::shared_ptr<CellShadow> shadow) {
  if (latest_.bytes + bytes_of(*shadow) > max_bytes_ / 2) {
    for (auto& [forgotten, grid] : older_.grids)
      if (grid.use_count() == 1) std::swap(unused_, grid->grid);
    older_ = std::exchange(latest_, {});
  }
  latest_.bytes += bytes_of(*shadow);
  latest_.grids.emplace(key, std::move(shadow));
}

std::shared_ptr<const CellShadow> CellShadows::cast(const V3f& direction, ShadowDetail detail) {
  // Points leave the yarn by a fraction of a texel before they are looked up: light would pass under thin
  // plies.
  detail.texel_width = std::min(detail.texel_width, radius_ * (detail.has_hairs ? 0.5F : 1.0F));
  detail.texel_width =
      std::exp2(std::round(4 * std::log2(std::clamp(detail.texel_width, 1e-12F, 1e12F))) / 4);
  // The arguments of the hyperbolic sines that are its slopes: texels are as much longer where light is
  // slanted.
  const float step = std::min(2 * max_moved * detail.texel_width / relief_, largest_step);
  const V2f slope = ray_slope(direction);
  const auto rounded = [&](float s) { return static_cast<std::int32_t>(std::lround(std::asinh(s) / step)); };
  const Key key{detail, rounded(slope.x), rounded(slope.y)};
  std::shared_ptr<CellShadow> made;
  {
    const std::scoped_lock lock(mutex_);
    if (auto found = find(key)) return found;
    made = std::make_shared<CellShadow>(CellShadow{std::exchange(unused_, {})});
  }
  made->slope = {std::sinh(static_cast<float>(key.x) * step), std::sinh(static_cast<float>(key.y) * step)};
  const V2f period = yarn_.yarns().period();
  const auto texels = [&](float length, float along) {
    const float count = length / (detail.texel_width * std::sqrt(1 + along * along));
    return static_cast<int>(
        std::clamp(count + 0.5F, static_cast<float>(min_cell_texels), static_cast<float>(max_side)));
  };
  made->grid.resize(texels(period.x, made->slope.x), texels(period.y, made->slope.y), false);
  // A small grid has smaller texels than asked for.
  const auto width = [](float length, float along, int count) {
    return length / (static_cast<float>(count) * std::sqrt(1 + along * along));
  };
  made->texel_width =
      std::min(detail.texel_width, std::max(width(period.x, made->slope.x, made->grid.width),
                                            width(period.y, made->slope.y, made->grid.height)));
  splat(yarn_, yarn_.pieces(detail.max_piece_texels * detail.texel_width),
        {made->slope, detail.ray_width_texels * detail.texel_width, detail.has_hairs}, made->grid);
  const std::scoped_lock lock(mutex_);
  // Another thread may have been faster, with the same result.
  if (auto found = find(key)) return found;
  keep(key, made);
  return made;
}

}  // namespace selvedge
