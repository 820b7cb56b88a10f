// A small cloth, the sampler, that has stitches of every kind of a large chart or draft, and a map that makes
// the large cloth of them (format/fabric/yarn_map.h).
//
// A kind is a stitch with its 8 neighbours and the yarns that its row carries; a crossing with the sides of
// its 8 neighbours and the yarns of three columns and rows.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "converter/stitch/knit.h"
#include "converter/stitch/weave.h"
#include "format/fabric/yarn_map.h"

namespace selvedge {

/// A periodic cloth as numbers.
struct StitchGrid {
  V2i size{0, 0};  ///< columns and rows
  std::vector<std::uint8_t>
      cells;  ///< [row][column], the lowest row first: an index into `stitches`, or whether the warp is over
  std::vector<std::uint8_t> rows;     ///< a bit for each yarn of the row; of a weave, the kind of the weft
  std::vector<std::uint8_t> columns;  ///< of a weave, the kind of the warp
  bool is_woven = false;
  std::vector<ChartStitch> stitches;  ///< of a knit, each once
  /// Albedos of the stitches of a knit; of the kinds of weft, and of warp.
  std::array<std::vector<V3f>, 2> colours;
  std::size_t count() const { return cells.size(); }
};

/// Stitches shown by stitches with the same 8 neighbours; with the same 4, above, below and beside them; and
/// with the same beside them alone (of a crossing: the sides of 4 and its own yarns).
enum class KindMatch { eight, four, row };
inline constexpr std::size_t kind_match_count = 3;

struct Arrangement {
  StitchGrid sampler;
  YarnMap map;
  int kind_count = 0;                            ///< of the cloth
  int missing_kinds = 0;                         ///< of these, in the sampler
  std::array<int, kind_match_count> stitches{};  ///< of the cloth, by KindMatch
  /// PSNR of a picture of one pixel a stitch beside a cloth of all kinds, of white 1; max_decibels if no
  /// colour differs. Estimated (spec/chart.md, "Large charts").
  double decibels = 0;
};

/// How many stitches are made: by the size of the cloth (all of up to 800; of more half, at most 784, or
/// 1,600 crossings), a number at most, as few as all kinds need or as an accuracy does, or all.
struct KindLimit {
  enum class By { size, stitches, exact, accuracy, none } by = By::none;
  int stitches = 0;     ///< by size: in place of 800 and 784, and half of the crossings; 0: these
  double decibels = 0;  ///< by accuracy: Arrangement::decibels, at least
};
inline constexpr double max_decibels = 99;

/// Empty where stitches are others than knit and purl.
std::optional<StitchGrid> grid_of(const KnitChart& chart);
/// Empty where yarns are not evenly spaced, or of too many kinds.
std::optional<StitchGrid> grid_of(const Weave& weave);

/// Empty where fewer stitches than the cloth's do not serve. Takes about a second; deterministic.
std::optional<Arrangement> arrange(const StitchGrid& cloth, const KindLimit& limit);

/// Stitches of a knit that differ from the next one in their row, or in side from the one above, of all.
double stitch_changes(const StitchGrid& grid);
/// Yarns that each row of a knit carries, the lowest first; empty of a weave.
std::vector<int> yarns_of_rows(const StitchGrid& grid);

/// The stitches or crossings of a sampler in place of the cloth's.
void take_sampler(const StitchGrid& sampler, KnitChart& chart);
void take_sampler(const StitchGrid& cloth, const StitchGrid& sampler, Weave& weave);

}  // namespace selvedge
