// The table of a sweep over speed and accuracy: limits that choose from it, and its page.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "apps/common/report.h"
#include "format/base/vec.h"

namespace selvedge {

/// The figures of a row, by their members.
namespace figures {
inline constexpr const char* bytes = "bytes";         ///< of the fabric file
inline constexpr const char* seconds = "seconds";     ///< to mesh, bake and fit, by the clock
inline constexpr const char* work = "workSeconds";    ///< the same, summed over cores
inline constexpr const char* held_out = "heldOutDb";  ///< PSNR of directions that no fit has used
inline constexpr const char* frame = "frameMs";       ///< of a picture, summed over cores
inline constexpr const char* picture = "pictureDb";   ///< PSNR of the picture beside the traced stitch
}  // namespace figures

/// Limits of a choice; all that are set have to be met.
struct TradeLimits {
  std::optional<std::uint64_t> bytes;  ///< at most
  std::optional<double> picture;       ///< dB, at least
  std::optional<double> seconds;       ///< to make, at most
  bool any() const { return bytes || picture || seconds; }
};

/// The row that meets the limits: with a limit of quality the one that is made fastest, else the one with the
/// best picture. Null if none does.
const Json* chosen_row(const Json& rows, const TradeLimits& limits);

/// Rows as CSV (RFC 4180) with the members of the first as columns, and back: text that is a number becomes
/// one.
std::string csv_of(const Json& rows);
/// `name` is the file in messages. OPTION_OUT_OF_RANGE where it is no such table.
Result<Json> rows_of(const std::string& csv, const std::string& name);

/// Cost and quality of each: true for those that no other beats (no other has less cost and at least the
/// quality, or the same cost and more quality). Points that are not finite are not on the front.
std::vector<bool> pareto_front(const std::vector<V2d>& points);

/// A page with plots and the rows; it needs no file beside it. `pictures[i]` is the PNG of row i, `truth`
/// the PNG of the traced stitch or empty.
std::string trade_page(const std::string& title, const Json& rows, const std::vector<std::string>& pictures,
                       const std::string& truth);

}  // namespace selvedge
