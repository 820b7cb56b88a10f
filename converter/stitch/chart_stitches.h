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
constexpr const char* stitch_names =
    "k, p, k tbl, p tbl, yo, m1l, m1r, k2tog, ssk, p2tog, ssp, k3tog, sssk, cdd, sk2p, sl wyif, sl wyib, "
    "tuck, and cables of 2 to 8 stitches, c4f, c4b, t3f, t3b, 2/1 lc, 2/1 rpc, ...";
constexpr const char* shaped_piece =
    "is of a shaped piece: keep the rows of its stitch pattern alone, whose number of stitches stays";

constexpr const char* one_repeat = "cut the chart to one repeat, or to a part";

/// Wider cables are drawn well, but do not come to rest at the full thickness of a usual yarn.
constexpr int max_cable = 8;

/// A stitch, or a cable of several, as seen from the face.
struct StitchItem {
  int makes = 1;   ///< stitches of its row
  int takes = 1;   ///< loops of the row below
  ChartStitch as;  ///< `through` counts from the first loop that it takes
  int front = 0;   ///< of a cable: stitches in front, which go to the left or to the right; 0: no cable
  bool left = false;
  bool purls_front = false;
  bool purls_back = false;
  int shown = 0;  ///< 1: knit or purl as the loop below it shows; -1: the other
};

[[noreturn]] void refuse_line(int line, std::string message);

/// A number from 1 to `max` in digits alone.
std::optional<int> count_in(std::string_view digits, int max);

/// The stitch of a name in lower case, without blanks: "k", "ktbl", "slwyif", "2/1rpc".
std::optional<StitchItem> stitch_named(std::string_view name);

/// A stitch, or a group of parts, some times.
struct Part {
  StitchItem item;
  std::vector<Part> group;
  int count = 1;
  bool open = false;  ///< as often as the row has room
  int left = -1;      ///< stitches that an open one leaves; -1: not stated
};
using Parts = std::vector<Part>;

/// Gives all stitches of a part a yarn.
void give_yarn(Part& part, std::size_t yarn);

/// A row as it is written.
struct WrittenRow {
  int number = 0;
  int line = 0;
  char side = 0;  ///< 'f': a chart's, from left to right; 'r', 'w': worked on that side; 'o': in rounds
  Parts parts{};
  std::vector<std::size_t> yarns{};  ///< "[A3 B]": of each stitch, or one of all; empty: of the parts
  int takes = 0;                     ///< loops without the part that is repeated
  int per_repeat = 0;                ///< of that part; 0: none is

  bool fits(int width) const {
    return per_repeat == 0 ? width == takes : width >= takes && (width - takes) % per_repeat == 0;
  }
  std::string counts() const {
    if (per_repeat == 0) return fmt::format("row {} takes {} stitches", number, takes);
    return fmt::format("row {} takes a multiple of {} stitches plus {}", number, per_repeat,
                       takes % per_repeat);
  }

  /// Counts its stitches. Refuses several repeats, one that leaves others than it says, and a row that takes
  /// more or fewer stitches than it makes.
  void check();

  /// From left to right, as seen from the face, of a width that it fits. `below`: the row below it; empty:
  /// none.
  std::vector<ChartStitch> stitches(int width, const std::vector<ChartStitch>& below) const;
};

/// A repeat has no first loop: shifts the loops that a row takes so that they move the fewest columns.
void straighten(std::vector<ChartStitch>& row);

}  // namespace selvedge
