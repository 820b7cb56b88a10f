#include "apps/selvedge-view/series.h"

#include <fmt/format.h>

#include <cctype>
#include <filesystem>
#include <set>

#include "format/base/guard.h"

namespace selvedge {
namespace {

namespace fs = std::filesystem;

/// Whether `mark` was there.
bool replace_all(std::string& text, const std::string& mark, const std::string& value) {
  bool found = false;
  for (std::size_t at = 0; (at = text.find(mark, at)) != std::string::npos; at += value.size()) {
    text.replace(at, mark.size(), value);
    found = true;
  }
  return found;
}

/// Replaces %d and %04d. Whether there was one.
bool replace_number(std::string& text, int number) {
  const std::size_t at = text.find('%');
  if (at == std::string::npos) return false;
  std::size_t end = at + 1;
  int digits = 0;
  const bool has_digits = text[end] == '0' && std::isdigit(static_cast<unsigned char>(text[end + 1])) != 0;
  if (has_digits) {
    digits = text[end + 1] - '0';
    end += 2;
  }
  if (text[end] != 'd') return false;
  text.replace(at, end + 1 - at, fmt::format("{:0{}}", number, digits));
  return true;
}

}  // namespace

std::string file_safe(const std::string& name) {
  std::string safe = name;
  for (char& c : safe) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 0x80 && std::isalnum(byte) == 0 && c != '.' && c != '_' && c != '-') c = '-';
  }
  if (safe.empty() || safe.front() == '.') safe.insert(0, "-");
  return safe;
}

std::vector<std::string> file_safe(const std::vector<std::string>& names) {
  std::vector<std::string> safe;
  std::set<std::string> taken;
  for (const std::string& name : names) {
    const std::string stem = file_safe(name);
    std::string one = stem;
    const auto key = [](std::string text) {
      for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
      return text;
    };
    for (int number = 2; !taken.insert(key(one)).second; ++number) one = fmt::format("{}-{}", stem, number);
    safe.push_back(one);
  }
  return safe;
}

std::string series_path(const std::string& pattern, const SeriesPlace& place) {
  std::string path = pattern;
  if (!place.variant.empty()) replace_all(path, "{variant}", place.variant);
  if (place.frame.empty()) return path;
  const bool is_numbered = replace_number(path, place.number);
  if (replace_all(path, "{frame}", place.frame) || is_numbered) return path;
  const std::size_t dot = path.find_last_of('.');
  return fmt::format("{}-{}{}", path.substr(0, dot), place.frame, path.substr(dot));
}

SeriesFiles::~SeriesFiles() {
  files_.clear();
  std::error_code ignored;  // folders that are not empty stay
  for (; !folders_.empty(); folders_.pop_back()) fs::remove(folders_.back(), ignored);
}

const AtomicFile& SeriesFiles::add(const std::string& path) {
  std::vector<fs::path> missing;
  std::error_code error;
  for (fs::path folder = fs::path(path).parent_path(); !folder.empty() && !fs::exists(folder, error);
       folder = folder.parent_path())
    missing.push_back(folder);
  for (; !missing.empty(); missing.pop_back()) {
    const fs::path& folder = missing.back();
    if (!fs::create_directory(folder, error))
      throw Failure{{Code::file_unwritable, folder.string(), "", "the folder cannot be made"}};
    folders_.push_back(folder.string());
  }
  return files_.emplace_back(value_or_throw(AtomicFile::create(path)));
}

Result<void> SeriesFiles::commit() { return commit_all(std::move(files_)); }

}  // namespace selvedge
