#include "tests/spec/spec_text.h"

#include <regex>
#include <sstream>
#include <stdexcept>

#include "tests/format/files.h"

namespace selvedge::test {

std::string source_text(const std::string& path) {
  std::string text = bytes_of(std::string(SELVEDGE_SOURCE_DIR) + "/" + path);
  if (text.empty()) throw std::runtime_error(path + " is missing or empty");
  return text;
}

std::string page(const std::string& name) { return source_text("spec/" + name); }

std::vector<std::string> split(const std::string& text, char separator) {
  std::vector<std::string> parts;
  std::istringstream in(text);
  for (std::string part; std::getline(in, part, separator);) parts.push_back(part);
  return parts;
}

std::vector<std::string> code_blocks(const std::string& text, const std::string& language) {
  std::vector<std::string> blocks;
  bool inside = false;
  bool wanted = false;
  for (const std::string& line : split(text, '\n')) {
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

std::vector<std::vector<std::string>> rows_of(const std::string& text, const std::string& first,
                                              std::size_t columns) {
  std::vector<std::vector<std::string>> rows;
  for (const std::string& line : split(text, '\n')) {
    if (!line.starts_with("| " + first + " |")) continue;
    std::vector<std::string> cells = split(line.substr(1), '|');
    if (cells.size() == columns) rows.push_back(std::move(cells));
  }
  return rows;
}

std::vector<double> numbers_of(const std::string& list) {
  std::vector<double> numbers;
  for (const std::string& item : split(list, ',')) numbers.push_back(std::stod(item));
  return numbers;
}

bool names(const std::string& text, const std::string& name) {
  return text.find("`" + name + "`") != std::string::npos;
}

std::vector<std::vector<std::string>> matches(const std::string& text, const std::string& pattern) {
  const std::regex regex(pattern);
  std::vector<std::vector<std::string>> found;
  for (auto i = std::sregex_iterator(text.begin(), text.end(), regex); i != std::sregex_iterator(); ++i)
    found.emplace_back(std::next(i->begin()), i->end());
  return found;
}

std::string replaced(const std::string& text, const std::string& pattern, const std::string& with) {
  return std::regex_replace(text, std::regex(pattern), with);
}

}  // namespace selvedge::test
