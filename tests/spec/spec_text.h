// The pages of spec/, and what the tests take out of them: code blocks and table rows.
#pragma once

#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/format/files.h"

namespace selvedge::test {

inline std::string source_text(const std::string& path) {
  std::string text = bytes_of(std::string(SELVEDGE_SOURCE_DIR) + "/" + path);
  if (text.empty()) throw std::runtime_error(path + " is missing or empty");
  return text;
}

/// A page of spec/ by its name, such as "fabric.md".
inline std::string page(const std::string& name) { return source_text("spec/" + name); }

inline std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

/// The contents of all fenced blocks of one language, in order.
inline std::vector<std::string> code_blocks(const std::string& text, const std::string& language) {
  std::vector<std::string> blocks;
  bool inside = false;
  bool wanted = false;
  for (const std::string& line : lines_of(text)) {
    if (line.starts_with("```")) {
      inside = !inside;
      wanted = inside && line == "```" + language;
      if (wanted) blocks.emplace_back();
    } else if (wanted) {
      blocks.back() += line + "\n";
    }
  }
  return blocks;
}

/// The cells of all table rows whose first cell is `first`, with `columns` columns.
inline std::vector<std::vector<std::string>> rows_of(const std::string& text, const std::string& first,
                                                     std::size_t columns) {
  std::vector<std::vector<std::string>> rows;
  for (const std::string& line : lines_of(text)) {
    if (!line.starts_with("| " + first + " |")) continue;
    std::vector<std::string> cells;
    std::istringstream in(line.substr(1));
    for (std::string cell; std::getline(in, cell, '|');) cells.push_back(cell);
    if (cells.size() == columns) rows.push_back(cells);
  }
  return rows;
}

/// The numbers of a list such as "0.5, 1, 2".
inline std::vector<double> numbers_of(const std::string& list) {
  std::vector<double> numbers;
  std::istringstream in(list);
  for (std::string item; std::getline(in, item, ',');) numbers.push_back(std::stod(item));
  return numbers;
}

/// Whether the text names something as code: between backquotes.
inline bool names(const std::string& text, const std::string& name) {
  return text.find("`" + name + "`") != std::string::npos;
}

}  // namespace selvedge::test
