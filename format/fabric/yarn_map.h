// The arrangement of a repeat that is larger than its yarn's: each of its stitches shows one of the stitches
// that the yarn has (spec/fabric.md, "Map").
//
// Stitches are the knit's stitches or the weave's crossings: equal cells of the plane, columns along growing
// x (u), rows along falling y (v grows), from (0, 0) at u = v = 0 on. A fabric with a map has one texel for
// each stitch of its yarn.
#pragma once

#include <cstdint>
#include <vector>

#include "format/base/vec.h"

namespace selvedge {

struct YarnMap {
  V2i kinds{1, 1};  ///< columns and rows of stitches in the yarn's own repeat
  V2i size{0, 0};   ///< columns and rows of the cloth's repeat; 0: no map
  /// [row][column] of the cloth's repeat: row * kinds.x + column of a stitch of the yarn.
  std::vector<std::uint16_t> shown;
  /// The row of stitches that each curve makes, or the column of curves along v (repeat_offset.x is 0); the
  /// stitches along it end where it crosses their borders, and have a node there.
  std::vector<std::int32_t> lines;
  bool empty() const { return size.x == 0; }
  /// The stitch of the yarn at a stitch of the cloth, of any repeat; rows of both counted upwards (y) from v
  /// = 0.
  V2i shown_upwards(const V2i& stitch) const {
    const int at = shown_at({stitch.x, -1 - stitch.y});
    return {at % kinds.x, kinds.y - 1 - at / kinds.x};
  }
  /// `shown` at a column and row of any repeat.
  int shown_at(const V2i& stitch) const {
    const V2i at = within(stitch, size);
    return shown[std::size_t{1} * at.y * size.x + at.x];
  }
  /// A stitch of any repeat, in the first one.
  static V2i within(const V2i& stitch, const V2i& count) {
    const auto one = [](int i, int n) { return i >= 0 && i < n ? i : (i % n + n) % n; };
    return {one(stitch.x, count.x), one(stitch.y, count.y)};
  }
  /// The yarn's own repeat, of a cloth with this repeat, mm.
  V2f yarn_period(const V2f& repeat) const { return empty() ? repeat : repeat * V2f(kinds) / V2f(size); }
  bool operator==(const YarnMap&) const = default;
};

/// Columns and rows of stitches of a map that count as a repeat for images and variation.
inline constexpr int map_tile_stitches = 64;
inline constexpr int max_map_stitches = 1 << 20;  ///< of a cloth's repeat
inline constexpr int max_stitch_kinds = 1 << 16;

}  // namespace selvedge
