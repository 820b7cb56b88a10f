// Shadows of yarn on itself: depth grids of lamps over a cell. Images of a whole cell whose lamps shine from
// nearly the same direction share one, and so do the images of one patch from frame to frame.
#pragma once

#include <compare>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <vector>

#include "format/cells/splat.h"
#include "format/fabric/yarn_sky.h"

namespace selvedge {

struct ShadowDetail {
  float texel_width = 0;  ///< width of a texel at right angles to the light, mm; rounded to quarters of an
                          ///< octave, and at most the radius of the thinnest ply, or half of it with hairs
  float max_piece_texels = 1;  ///< longest piece of a ply, texels
  float ray_width_texels = 0;  ///< SplatView::ray_width, texels
  bool has_hairs = true;
  auto operator<=>(const ShadowDetail&) const = default;
};

/// Depths of a cell, or of a window in it, along the rays of a lamp.
struct CellShadow {
  V2f slope{0, 0};    ///< of the light for which the grid was made
  float bias_mm = 0;  ///< along the normal, by which looked-up points leave the yarn
  DepthGrid grid;
  std::size_t bytes() const { return grid.z.size() * sizeof(float); }
};

/// Points of an image's window in a cell.
struct ShadedWindow {
  const CellSize& size;  ///< of the image
  V2f slope{0, 0};       ///< ray_slope() of its view
  V2f heights{0, 0};     ///< of the lowest and the highest, mm
};

/// The grids of one side of a fabric. For any number of threads, but for set_memory().
class CellShadows {
 public:
  explicit CellShadows(const CellYarn& yarn);
  /// Bound, in bytes, on grids that nobody holds, but for the last one; 64 MiB without a call.
  void set_memory(std::size_t max_bytes) { max_bytes_ = max_bytes; }
  /// The grid of a whole cell, of a unit direction with z > 0, rounded so that no point's shadow moves by
  /// more than about a texel. It does not depend on earlier calls.
  std::shared_ptr<const CellShadow> cast(const V3f& direction, ShadowDetail detail);
  /// The grid of what an image shows: nobody shares it.
  std::shared_ptr<const CellShadow> cast(const V3f& direction, ShadowDetail detail,
                                         const ShadedWindow& window) const;
  /// Casts light from all around upon a large cell, by grids that nobody keeps: sky_transfer().
  LightCaster sky_caster() const;
  std::size_t bytes() const;

 private:
  struct Key {
    ShadowDetail detail;
    std::int32_t x = 0, y = 0;
    auto operator<=>(const Key&) const = default;
  };
  using Grids = std::map<Key, std::shared_ptr<const CellShadow>>;
  std::shared_ptr<const CellShadow> find(const Key& key);
  void keep(const Key& key, std::shared_ptr<const CellShadow> shadow);
  float fit(ShadowDetail& detail) const;
  std::shared_ptr<CellShadow> made(const V2f& slope, const ShadowDetail& detail, CellSize size) const;

  const CellYarn& yarn_;
  float relief_;          ///< height of the yarn, mm
  float radius_ = 1e30F;  ///< of the thinnest ply, mm
  std::mutex mutex_;
  std::size_t max_bytes_ = std::size_t{64} << 20;
  /// The latest that were asked for, half of the bytes; then these are the older ones, which are forgotten.
  Grids latest_, older_;
  std::size_t latest_bytes_ = 0;  ///< of the latest
};

}  // namespace selvedge
