// Converts weaving drafts in the Weaving Information File format (WIF 1.1, 1997) to weaves (spec/wif.md).
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "converter/stitch/parameters.h"
#include "converter/stitch/weave.h"
#include "format/base/error.h"

namespace selvedge {

/// Largest text that is read, bytes.
constexpr std::size_t max_wif_bytes = 16U << 20U;

/// Limits of a draft: yarns each way, and crossings.
constexpr int max_wif_threads = 16384;
constexpr std::size_t max_wif_drawdown = 1U << 24U;

struct WifDraft {
  std::string title;
  Weave weave;           ///< the smallest repeat; radii are half of the draft's thickness
  int warp_threads = 0;  ///< of the whole draft
  int weft_threads = 0;
  std::vector<std::string> remarks;  ///< choices and omissions, one line each
};

/// Larger drafts are edited as text.
constexpr int max_cell_side = 128;

/// Whether a text begins with the section WIF, behind comments and empty lines.
bool is_wif(std::string_view text);

/// Reads the smallest repeat of a draft: the fewest yarns each way that the whole draft repeats at least
/// twice; an incomplete repeat at the end is dropped. Refuses (stitch_invalid, place: section and key) values
/// that are missing, unreadable, out of range or contradictory.
/// `cells` (text_cells.h): what could be read of the draft, also where it refuses.
Result<WifDraft> read_wif(std::string_view text, const std::string& file,
                          nlohmann::ordered_json* cells = nullptr);

}  // namespace selvedge
