// Splits the text of mesh files into lines, words and numbers; the rules of OBJ files that their two readers
// share.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "format/base/error.h"
#include "format/base/vec.h"

namespace selvedge {

using Words = std::vector<std::string_view>;

/// Splits a line at white space.
void split_words(std::string_view line, Words& words);

/// Calls use(words, number) for each line that is not blank, where `number` counts from 1, until an error.
template <class Use>
Result<void> for_each_line(std::string_view text, const Use& use) {
  Words words;
  for (int number = 1; !text.empty(); ++number) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    split_words(text.substr(0, end), words);
    text.remove_prefix(std::min(end + 1, text.size()));
    if (words.empty()) continue;
    if (auto ok = use(words, number); !ok) return ok;
  }
  return {};
}

/// The line from its second word on, or from another.
std::string_view rest_of(const Words& words, std::size_t first = 1);

/// False unless the whole word is a number. Numbers out of range become infinite or 0.
bool to_number(std::string_view word, double& value);

/// The three numbers from words[first] on. Refuses fewer than three (file_damaged) and positions that are not
/// finite in single precision (mesh_not_finite); `number` is the line's.
Result<V3d> position_at(const Words& words, std::size_t first, const std::string& file, int number);

/// An OBJ or MTL text without byte order mark and comments, line ends as \n, continued lines joined; empty
/// lines after them keep the line numbers.
std::string obj_text(std::string_view text);

/// Index from 0 of what a corner of a face names, of which `count` have been read: OBJ counts from 1, or
/// backwards from -1; negative where there is none. False if the word is not a number.
bool to_obj_index(std::string_view word, std::size_t count, int& index);

}  // namespace selvedge
