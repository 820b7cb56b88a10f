// Lines, words and numbers of mesh files that are texts.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "format/base/error.h"
#include "format/base/vec.h"

namespace selvedge {

using Words = std::vector<std::string_view>;

/// The words of a line, separated by blanks, tabs and the like.
void split_words(std::string_view line, Words& words);

/// Calls use(words, number) for each line that has words, numbers counted from 1, until it gives back an
/// error.
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

/// From the second word of a line to its end.
std::string_view rest_of(const Words& words);

/// False where the whole word is no number; beyond double: infinite or 0.
bool to_number(std::string_view word, double& value);

/// The numbers from words[first] on. Refuses fewer than three (file_damaged) and positions that are not
/// finite in single precision (mesh_not_finite); `number` is the line's.
Result<V3d> position_at(const Words& words, std::size_t first, const std::string& file, int number);

}  // namespace selvedge
