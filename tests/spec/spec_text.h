// The pages of spec/, and what the tests take out of them: code blocks, table rows, matches of patterns.
#pragma once

#include <string>
#include <vector>

namespace selvedge::test {

/// A file of the sources by its path from their root; throws where it is missing or empty.
std::string source_text(const std::string& path);

/// A page of spec/ by its name, such as "fabric.md".
std::string page(const std::string& name);

/// The contents of all fenced blocks of one language, in order.
std::vector<std::string> code_blocks(const std::string& text, const std::string& language);

/// The cells of all table rows whose first cell is `first`, with `columns` columns.
std::vector<std::vector<std::string>> rows_of(const std::string& text, const std::string& first,
                                              std::size_t columns);

/// The parts of a text between the separators, a last empty one left out.
std::vector<std::string> split(const std::string& text, char separator);

/// The numbers of a list such as "0.5, 1, 2".
std::vector<double> numbers_of(const std::string& list);

/// Whether the text names something as code: between backquotes.
bool names(const std::string& text, const std::string& name);

/// The groups of every match of a regular expression (ECMAScript's).
std::vector<std::vector<std::string>> matches(const std::string& text, const std::string& pattern);

/// The text with every match replaced; $1 is the first group.
std::string replaced(const std::string& text, const std::string& pattern, const std::string& with);

}  // namespace selvedge::test
