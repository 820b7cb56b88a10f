// Rows of charts and of written knitting instructions in one grammar, and their repeat (spec/chart.md):
//
//   Row 1 (RS): K1, *p2, k2; rep from * to last st, k1.
//   Row 2 and all WS rows: K the knits and p the purls.
#pragma once

#include <cctype>
#include <cstddef>
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "converter/stitch/knit.h"
#include "converter/stitch/text_fault.h"

namespace selvedge {

/// Without blanks at its ends; empty: ends the row above it.
struct TextLine {
  int number = 0;
  std::string text;
};

struct ReadRow {
  int number = 0;
  int line = 0;
  std::vector<ChartStitch> stitches;  ///< as seen from the face
};

/// Whether a line begins a row: "1:", "Row 1 (RS):", "Rows 2 and 4".
bool begins_row(const std::string& line);

/// Whether rows are of a chart, from left to right as seen from the face unless they state a side: all are
/// called by their numbers alone, or any has the letters of yarns in brackets. Else they are worked in turn.
bool is_chart(const std::vector<TextLine>& lines);

/// The index of a yarn by its name ("A", "MC"). Ends reading at names that are not known.
using FindYarn = std::function<std::size_t(const std::string& name, int line)>;

/// One repeat, from the lowest row up; stitches at its edges are left out, with a remark. `letters`: of the
/// yarns of the head. Ends reading (refuse_line()) at words that are not known, several repeats in a row,
/// rows that do not fit each other, take more or fewer stitches than they make, or are missing, and rows of a
/// shaped piece. `alone`: each row of a chart by itself; one that cannot be read has no stitches.
std::vector<ReadRow> read_rows(const std::vector<TextLine>& lines, const std::string& letters,
                               const FindYarn& find_yarn, std::vector<std::string>& remarks,
                               bool alone = false);

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
