// Shadows of yarn on itself: depth grids of lamps over a cell. Images whose lamps shine from nearly the same
// direction share one, and so do the images of one patch from frame to frame.
#pragma once

#include <atomic>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <vector>

#include "format/cells/splat.h"

namespace selvedge {

struct ShadowDetail {
  float texel_width = 0;  ///< width of a texel at right angles to the light, mm; rounded to quarters of an
                          ///< octave, and at most the radius of the thinnest ply, or half of it with hairs
  float max_piece_texels = 1;  ///< longest piece of a ply, texels
  float ray_width_texels = 0;  ///< SplatView::ray_width, texels
  bool has_hairs = true;
  auto operator<=>(const ShadowDetail&) const = default;
};

/// A grid of a cell in tiles, each made when it is first looked up. For any number of threads.
class CellShadow {
 public:
  /// `made_bytes` counts the bytes of tiles. Both must outlive the object.
  CellShadow(const CellYarn& yarn, const SplatView& light, const V2i& texels, float max_piece_mm,
             std::atomic<std::size_t>& made_bytes);
  CellShadow(const CellShadow&) = delete;
  CellShadow& operator=(const CellShadow&) = delete;
  ~CellShadow();
  V2f slope() const { return light_.slope; }  ///< of the light for which the grid was made
  V2i texels() const { return texels_; }      ///< of the cell
  V2i tile_texels() const { return tile_texels_; }
  V2i tiles() const { return tiles_; }
  /// Texels from one row of a tile to the next. Behind the last row and column of a tile is one of the next
  /// tile; of a cell in one tile, columns alone.
  int stride() const { return stride_; }
  int rows() const { return tile_texels_.y + (tiles_ == V2i(1, 1) ? 0 : 1); }
  /// Depths of tile (i, j), number j tiles().x + i; [row][column].
  const float* depths(std::size_t tile) const {
    const DepthGrid* const grid = made_[tile].load(std::memory_order_acquire);
    return (grid != nullptr ? grid : make(tile))->z.data();
  }
  float texel_width = 0;  ///< width, mm; less than asked for in a small grid
  std::size_t bytes() const;
  std::size_t max_bytes() const;  ///< with all tiles

 private:
  CellSize tile_size(std::size_t tile) const;
  const DepthGrid* make(std::size_t tile) const;
  const CellYarn& yarn_;
  SplatView light_;
  V2i texels_, tile_texels_, tiles_;
  int stride_ = 0;
  float max_piece_mm_;
  std::atomic<std::size_t>& made_bytes_;
  mutable std::vector<std::atomic<const DepthGrid*>> made_;
};

/// The grids of one side of a fabric. For any number of threads, but for set_memory().
class CellShadows {
 public:
  explicit CellShadows(const CellYarn& yarn);
  /// Bound, in bytes, on grids that nobody holds, but for the last one; 64 MiB without a call.
  void set_memory(std::size_t max_bytes) { max_bytes_ = max_bytes; }
  /// The grid of a unit direction with z > 0, rounded so that no point's shadow moves by more than a quarter
  /// of a texel. It does not depend on earlier calls.
  std::shared_ptr<const CellShadow> cast(const V3f& direction, ShadowDetail detail);
  std::size_t bytes() const;

 private:
  struct Key {
    ShadowDetail detail;
    std::int32_t x = 0, y = 0;
    auto operator<=>(const Key&) const = default;
  };
  using Grids = std::map<Key, std::shared_ptr<CellShadow>>;
  std::shared_ptr<const CellShadow> find(const Key& key);
  void keep(const Key& key, std::shared_ptr<CellShadow> shadow);

  const CellYarn& yarn_;
  float relief_;          ///< height of the yarn, mm
  float radius_ = 1e30F;  ///< of the thinnest ply, mm
  std::mutex mutex_;
  std::size_t max_bytes_ = std::size_t{64} << 20;
  /// The latest that were asked for, half of the bytes; then these are the older ones, which are forgotten.
  Grids latest_, older_;
  std::atomic<std::size_t> latest_bytes_ = 0;  ///< of the latest, and of tiles made since
};

}  // namespace selvedge
