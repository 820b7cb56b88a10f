// Stitches of charts and of written instructions by their names, and rows of them (chart_rows.h).
#pragma once

#include <fmt/format.h>

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "converter/stitch/knit.h"
#include "converter/stitch/text_fault.h"

namespace selvedge {

/// Known stitches, for messages.
constexpr const char* known_stitches_text =
    "k, p, k tbl, p tbl, yo, m1l, m1r, k2tog, ssk, p2tog, ssp, k3tog, sssk, cdd, sk2p, sl wyif, sl wyib, "
    "tuck, and cables of 2 to 8 stitches, c4f, c4b, t3f, t3b, 2/1 lc, 2/1 rpc, ...";
constexpr const char* shaped_piece_message =
    "is of a shaped piece: keep the rows of its stitch pattern alone, whose number of stitches stays";

constexpr const char* cut_to_repeat_advice = "cut the chart to one repeat, or to a part";

/// Wider cables are drawn well, but do not come to rest at the full thickness of a usual yarn.
constexpr int max_cable = 8;

/// A stitch, or a cable of several, as seen from the face.
struct StitchItem {
  int made_stitches = 1;     ///< stitches of its row
  int taken_loops = 1;       ///< loops of the row below
  ChartStitch chart_stitch;  ///< `through` counts from the first loop that it takes
  int front_stitches = 0;    ///< of a cable: stitches in front, which go left or right; 0: no cable
  bool front_goes_left = false;
  bool purls_front = false;
  bool purls_back = false;
  int like_below = 0;  ///< 1: knit or purl as the loop below it shows; -1: the other
};

[[noreturn]] void refuse_line(int line, std::string message);

/// A number from 1 to `max` in digits alone.
std::optional<int> parse_count(std::string_view digits, int max);

/// The stitch of a name in lower case, without blanks: "k", "ktbl", "slwyif", "2/1rpc".
std::optional<StitchItem> find_stitch_item(std::string_view name);

/// A stitch or cable by its name, as seen from the face: "k2tog"; "2/1rpc", of three columns.
struct NamedStitch {
  std::string name;  ///< empty: it has none
  int columns = 1;
};

/// A row by names that find_stitch_item() knows.
std::vector<NamedStitch> name_stitches(const std::vector<ChartStitch>& row);

/// A stitch, or a group of parts, some times.
struct RowPart {
  StitchItem item;
  std::vector<RowPart> group;
  int count = 1;
  bool fills_row = false;  ///< as often as the row has room
  int stitches_left = -1;  ///< stitches that an open one leaves; -1: not stated
};
using RowParts = std::vector<RowPart>;

/// Gives all stitches of a part a yarn.
void set_part_yarn(RowPart& part, std::size_t yarn);

/// A row as it is written.
struct WrittenRow {
  int number = 0;
  int line = 0;
  char side = 0;   ///< 'f': a chart's, from left to right; 'r', 'w': worked on that side; 'o': in rounds
  char plain = 0;  ///< 's', 'r', 'g': in stockinette, reversed, or garter stitch, whatever its side
  RowParts parts{};
  std::vector<std::size_t> yarns{};  ///< "[A3 B]": of each stitch, or one of all; empty: of the parts
  int fixed_loops = 0;               ///< loops without the part that is repeated
  int loops_per_repeat = 0;          ///< of that part; 0: none is

  bool fits_width(int width) const {
    return loops_per_repeat == 0 ? width == fixed_loops
                                 : width >= fixed_loops && (width - fixed_loops) % loops_per_repeat == 0;
  }
  std::string taken_stitches_text() const {
    if (loops_per_repeat == 0) return fmt::format("row {} takes {} stitches", number, fixed_loops);
    return fmt::format("row {} takes a multiple of {} stitches plus {}", number, loops_per_repeat,
                       fixed_loops % loops_per_repeat);
  }

  /// Counts its stitches. Refuses several repeats, one that leaves others than it says, and a row that takes
  /// more or fewer stitches than it makes.
  void count_stitches();

  /// From left to right, as seen from the face, of a width that it fits. `below`: the row below it; empty:
  /// none.
  std::vector<ChartStitch> stitches(int width, const std::vector<ChartStitch>& below) const;
};

/// A repeat has no first loop: shifts the loops that a row takes so that they move the fewest columns.
void minimise_column_shifts(std::vector<ChartStitch>& row);

}  // namespace selvedge
