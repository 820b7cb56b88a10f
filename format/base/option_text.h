// Parsing and quoting of values on a command line.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace selvedge {

/// `min_count` to `max_count` finite numbers, separated by `separator`; nothing if the text is anything else.
std::optional<std::vector<double>> parse_numbers(const std::string& text, char separator,
                                                 std::size_t min_count, std::size_t max_count);

/// Parts between the separators, trimmed: one at least, which may be empty.
std::vector<std::string> parts_of(std::string_view text, char separator);

/// Without spaces and tabs at both ends.
std::string trimmed(std::string_view text);

/// With the letters A to Z as a to z.
std::string lower_case(std::string text);

/// Whether a file's name is longer than `ending` (".png", lower case) and ends in it, in either case.
bool has_ending(std::string path, std::string_view ending);

/// The text as one word for a shell: in single quotes unless it has only letters, digits and _./:=,+-@%.
std::string shell_word(const std::string& text);

}  // namespace selvedge
