#include "format/cells/cell_shadows.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace selvedge {
namespace {

constexpr int max_side = 512;  ///< of a grid
/// Sides of tiles, of larger grids.
constexpr int tile_side = 128;
constexpr int max_untiled = 192 * 192;  ///< texels
/// Largest shift of a shadow by the rounding of its direction, texels; and the largest step, also of large
/// cells, whose grids are dear: it costs 0.1 dB.
constexpr float max_moved = 1;
constexpr float largest_step = 0.1F;
constexpr float largest_step_of_large = 0.2F;
/// Hairs that cast shadows in large cells are thinner than pixels ask for: their noise is seen.
constexpr float hair_width_of_asked = 0.3F;

std::size_t bytes_of(const DepthGrid& grid) { return grid.z.size() * sizeof(float); }

}  // namespace

CellShadow::CellShadow(const CellYarn& yarn, const SplatView& light, const V2i& texels, float max_piece_mm,
                       std::atomic<std::size_t>& made_bytes)
    : yarn_(yarn),
      light_(light),
      texels_(texels),
      tile_texels_(texels.x * texels.y <= max_untiled
                       ? texels
                       : V2i(std::min(texels.x, tile_side), std::min(texels.y, tile_side))),
      tiles_((texels.x - 1) / tile_texels_.x + 1, (texels.y - 1) / tile_texels_.y + 1),
      max_piece_mm_(max_piece_mm),
      made_bytes_(made_bytes),
      made_(static_cast<std::size_t>(tiles_.x) * tiles_.y) {
  stride_ = stride_of(tile_size(0).rendered_samples().x);
}

CellShadow::~CellShadow() {
  for (const std::atomic<const DepthGrid*>& grid : made_) delete grid.load();
}

std::size_t CellShadow::bytes() const {
  std::size_t sum = 0;
  for (const std::atomic<const DepthGrid*>& grid : made_)
    if (const DepthGrid* const made = grid.load()) sum += bytes_of(*made);
  return sum;
}

std::size_t CellShadow::max_bytes() const {
  return made_.size() * static_cast<std::size_t>(stride_ * rows()) * sizeof(float);
}

CellSize CellShadow::tile_size(std::size_t tile) const {
  CellSize size{.repeat_samples = texels_};
  if (tiles_ == V2i(1, 1)) return size;
  const auto number = static_cast<int>(tile);
  size.window_origin = V2i(number % tiles_.x, number / tiles_.x) * tile_texels_;
  size.window_samples = tile_texels_ + V2i(1);
  return size;
}

const DepthGrid* CellShadow::make(std::size_t tile) const {
  auto grid = std::make_unique<DepthGrid>();
  grid->resize(tile_size(tile), false);
  splat(yarn_, yarn_.pieces(max_piece_mm_), light_, *grid);
  // Another thread may be faster, with the same result.
  const DepthGrid* made = nullptr;
  if (!made_[tile].compare_exchange_strong(made, grid.get(), std::memory_order_acq_rel)) return made;
  made_bytes_ += bytes_of(*grid);
  return grid.release();
}

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

void CellShadows::keep(const Key& key, std::shared_ptr<CellShadow> shadow) {
  // Its other tiles may follow.
  if (latest_bytes_ + shadow->max_bytes() > max_bytes_ / 2) {
    older_ = std::exchange(latest_, {});
    latest_bytes_ = 0;
  }
  latest_bytes_ += shadow->bytes();
  latest_.emplace(key, std::move(shadow));
}

std::shared_ptr<const CellShadow> CellShadows::cast(const V3f& direction, ShadowDetail detail) {
  const auto rounded_width = [](float width, float steps) {
    return std::exp2(std::round(steps * std::log2(std::clamp(width, 1e-12F, 1e12F))) / steps);
  };
  const float asked = yarn_.has_large_cell() ? rounded_width(detail.texel_width, 1) : 0;
  // Points leave the yarn by a fraction of a texel before they are looked up: light would pass under thin
  // plies.
  detail.texel_width =
      rounded_width(std::min(detail.texel_width, radius_ * (detail.has_hairs ? 0.5F : 1.0F)), 4);
  // Large cells are as coarse as in images where pixels do not resolve them.
  if (asked > detail.texel_width) {
    detail.max_piece_texels *= asked / detail.texel_width;
    detail.ray_width_texels *= std::max(1.0F, hair_width_of_asked * asked / detail.texel_width);
  }
  const float moved = max_moved * std::max(detail.texel_width, asked / 2);
  // The arguments of the hyperbolic sines that are its slopes: texels are as much longer where light is
  // slanted.
  const float step =
      std::min(2 * moved / relief_, yarn_.has_large_cell() ? largest_step_of_large : largest_step);
  const V2f slope = ray_slope(direction);
  const auto rounded = [&](float s) { return static_cast<std::int32_t>(std::lround(std::asinh(s) / step)); };
  const Key key{detail, rounded(slope.x), rounded(slope.y)};
  const std::scoped_lock lock(mutex_);
  if (auto found = find(key)) return found;
  const V2f rounded_slope(std::sinh(static_cast<float>(key.x) * step),
                          std::sinh(static_cast<float>(key.y) * step));
  const V2f period = yarn_.yarns().period();
  const auto texels = [&](float length, float along) {
    const float count = length / (detail.texel_width * std::sqrt(1 + along * along));
    return static_cast<int>(
        std::clamp(count + 0.5F, static_cast<float>(min_cell_texels), static_cast<float>(max_side)));
  };
  const V2i count(texels(period.x, rounded_slope.x), texels(period.y, rounded_slope.y));
  // A small grid has smaller texels than asked for.
  const auto width = [](float length, float along, int number) {
    return length / (static_cast<float>(number) * std::sqrt(1 + along * along));
  };
  auto made = std::make_shared<CellShadow>(
      yarn_, SplatView{rounded_slope, detail.ray_width_texels * detail.texel_width, detail.has_hairs}, count,
      detail.max_piece_texels * detail.texel_width, latest_bytes_);
  made->texel_width = std::min(detail.texel_width, std::max(width(period.x, rounded_slope.x, count.x),
                                                            width(period.y, rounded_slope.y, count.y)));
  keep(key, made);
  return made;
}

}  // namespace selvedge
