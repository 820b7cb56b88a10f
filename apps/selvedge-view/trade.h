// The table of what frames of the three qualities cost and are worth, and its page.
#pragma once

#include <string>
#include <vector>

#include "apps/common/report.h"

namespace selvedge {

/// Adds `front` to rows with `pixels`, `quality`, `bytes`, `movingMs`, `movingDb` and `restDb`: whether no
/// other row with as many pixels has at most the bytes and at least both dB, and one of the three better.
void mark_front(Json& rows);

/// "On the front, where none has fewer bytes and more dB: draft at 120, 30; paper nowhere."
std::string front_words(const Json& rows);

/// The rows for a terminal.
std::string trade_text(const Json& rows);

/// A PNG file and its words.
struct TradePicture {
  std::string words;
  std::vector<std::uint8_t> png;
};
/// A page that needs no file beside it. Four pictures have a line; the first of every seven has two.
std::string trade_page(const std::string& title, const std::string& words, const Json& rows,
                       const std::vector<TradePicture>& pictures);

}  // namespace selvedge
