// Weaving drafts in the Weaving Information File format (WIF 1.1, 1997) -> weaves. What is read and how:
// spec/wif.md.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "converter/stitch/parameters.h"
#include "converter/stitch/weave.h"
#include "format/base/error.h"

namespace selvedge {

/// Largest text that is read, bytes.
constexpr std::size_t max_wif_text = 16U << 20U;

/// Most yarns of a draft each way, most crossings of all, and most of its smallest repeat.
constexpr int max_wif_threads = 16384;
constexpr std::size_t max_wif_drawdown = 1U << 24U;
constexpr std::size_t max_wif_crossings = 4096;

struct WifDraft {
  std::string title;
  Weave weave;           ///< the smallest repeat; radii are half of the thickness that the draft states
  int warp_threads = 0;  ///< of the whole draft
  int weft_threads = 0;
  std::vector<std::string> remarks;  ///< what was chosen or left out, one line each
};

/// The smallest repeat of a draft: the fewest yarns each way of which the whole draft is made of, at least
/// two times over; an incomplete repeat at the end is left out. Refuses (stitch_invalid, place: section and
/// key) what is missing, unreadable, out of range or contradicts itself, and repeats of more crossings than
/// the limit with the texels that they would need.
Result<WifDraft> read_wif(std::string_view text, const std::string& file);

/// Texels that a weave needs: 4 to the narrowest yarn each way.
V2i texels_for(const Weave& weave);

}  // namespace selvedge
