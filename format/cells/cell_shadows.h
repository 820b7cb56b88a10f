// Shadows of yarn on itself: depth grids of lamps over a cell. Images whose lamps shine from nearly the same
// direction share one, and so do the images of one patch from frame to frame.
#pragma once

#include <compare>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>

#include "format/cells/splat.h"

namespace selvedge {

struct ShadowDetail {
  float texel = 0;  ///< width of a texel at right angles to the light, mm; rounded to quarters of an octave
  float piece = 1;  ///< longest piece of a ply, texels
  float width = 0;  ///< SplatView::width, texels
  bool hairs = true;
  auto operator<=>(const ShadowDetail&) const = default;
};

struct CellShadow {
  DepthGrid grid;
  V2f slope{0, 0};  ///< of the light for which the grid was made
  float texel = 0;  ///< width, mm; less than asked for in a small grid
};

/// The grids of one side of a fabric. For any number of threads, but for trim().
class CellShadows {
 public:
  explicit CellShadows(const CellYarn& yarn);
  /// The grid of a unit direction with z > 0, rounded so that no point's shadow moves by more than a quarter
  /// of a texel. It does not depend on earlier calls, and lives until trim().
  const CellShadow& cast(const V3f& direction, ShadowDetail detail);
  /// If all grids have more bytes, forgets the ones that were not asked for since the last call.
  void trim(std::size_t most_bytes);

 private:
  struct Key {
    ShadowDetail detail;
    std::int32_t x = 0, y = 0;
    auto operator<=>(const Key&) const = default;
  };
  struct Kept {
    std::unique_ptr<const CellShadow> shadow;
    std::uint64_t used = 0;
  };
  const CellYarn& yarn_;
  float relief_;  ///< height of the yarn, mm
  std::mutex mutex_;
  std::map<Key, Kept> kept_;
  std::size_t bytes_ = 0;
  std::uint64_t call_ = 0;  ///< of trim()
};

}  // namespace selvedge
