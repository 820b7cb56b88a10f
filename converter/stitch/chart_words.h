// Words of a row of a knitting chart or of written instructions (chart_rows.h).
#pragma once

#include <cctype>
#include <cstddef>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "converter/stitch/chart_rows.h"
#include "converter/stitch/text_fault.h"

namespace selvedge {

using Words = std::set<std::string_view>;

/// A word or a mark; semicolons and full stops are commas.
struct Token {
  std::string word;  ///< as it is read, without its count
  std::string text;  ///< as it is written
  int count = 0;     ///< "k2", "k 2"; 0: none, -1: out of range
  int line = 0;
};
using Tokens = std::vector<Token>;

inline bool is_letter(const std::string& word) {
  return word.size() == 1 && std::isalpha(static_cast<unsigned char>(word[0])) != 0;
}
inline bool is_word_at(const Tokens& tokens, std::size_t i, const Words& words) {
  return i < tokens.size() && words.contains(tokens[i].word);
}

/// "3" or "3rd".
std::optional<int> number_of(const Token& token);

/// Why a word that patterns use says too little, and what says it; empty: any other word.
std::string_view advice_for(const std::string& word);

/// The words of a line. Cables that are spelled out have their names: "2/2lc".
Tokens tokens_of(const TextLine& line);

}  // namespace selvedge
