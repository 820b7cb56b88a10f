// Values as people type them on a command line.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace selvedge {

/// Numbers separated by `separator`, from `least` to `most` of them, all finite; nothing where the text is
/// not that.
std::optional<std::vector<double>> parse_numbers(const std::string& text, char separator, std::size_t least,
                                                 std::size_t most);

/// Whether a file's name has that ending (".png", lower case), in upper or lower case, and something before
/// it.
bool has_ending(std::string path, std::string_view ending);

/// As one word of a line for a shell: in single quotes where it has more than letters, digits and _./:=,+-@%.
std::string shell_word(const std::string& text);

}  // namespace selvedge
