#include <algorithm>
#include <filesystem>

#include "format/web/host.h"

#pragma clang diagnostic ignored "-Winline-namespace-reopened-noninline"
namespace std::__2::filesystem {
size_t path::root_length() const {
  const bool has_drive = text_.size() > 2 && isalpha(text_[0]) != 0 && text_[1] == ':' && text_[2] == '/';
  return has_drive ? 3 : std::min(text_.find_first_not_of('/'), text_.size());
}
size_t path::name_start() const {
  const size_t slash = text_.rfind('/');
  return std::max(slash == std::string::npos ? 0 : slash + 1, root_length());
}
size_t path::dot() const {
  const std::string name = filename().text_;
  const size_t at = name.rfind('.');
  return at == 0 || name == ".." ? std::string::npos : at;
}

path path::parent_path() const {
  if (name_start() <= root_length()) return text_.substr(0, root_length());
  const size_t end = text_.find_last_not_of('/', name_start() - 1);
  return text_.substr(0, std::max(end + 1, root_length()));
}

path& path::operator/=(const path& other) {
  if (other.is_absolute()) return *this = other;
  if (!text_.empty() && text_.back() != '/') text_ += '/';
  text_ += other.text_;
  return *this;
}

vector<std::string> path::parts() const {
  vector<std::string> all;
  if (root_length() > 0) all.push_back(root_length() == 3 ? text_.substr(0, 3) : "/");
  for (size_t at = root_length(); at < text_.size();) {
    const size_t end = std::min(text_.find('/', at), text_.size());
    all.push_back(text_.substr(at, end - at));
    at = std::min(text_.find_first_not_of('/', end), text_.size());
    if (at == text_.size() && end < at) all.emplace_back();
  }
  return all;
}
path::iterator path::begin() const {
  const vector<std::string> all = parts();
  return {{all.begin(), all.end()}, 0};
}
path::iterator path::end() const { return {{}, parts().size()}; }

path path::lexically_normal() const {
  vector<std::string> all;
  const vector<std::string> given = parts();
  for (const std::string& part : given) {
    const bool can_leave = !all.empty() && all.back() != "..";
    if (part == "." || part.empty() || (part == ".." && can_leave && all.back().back() == '/')) continue;
    if (part == ".." && can_leave)
      all.pop_back();
    else
      all.push_back(part);
  }
  path normal;
  for (const std::string& part : all) normal /= part;
  const bool is_folder =
      !given.empty() && (given.back().empty() || given.back() == "." || given.back() == "..");
  if (is_folder && !all.empty() && all.back() != ".." && normal.text_.back() != '/') normal.text_ += '/';
  return normal.empty() && !empty() ? path(".") : normal;
}

path path::lexically_relative(const path& base) const {
  const vector<std::string> to = parts();
  const vector<std::string> from = base.parts();
  if (is_absolute() != base.is_absolute() || (is_absolute() && to.front() != from.front())) return {};
  const auto [a, b] = std::ranges::mismatch(to, from);
  if (a == to.end() && b == from.end()) return ".";
  ptrdiff_t up = 0;
  for (auto at = b; at != from.end(); ++at) up += *at == ".." ? -1 : *at == "." || at->empty() ? 0 : 1;
  if (up < 0) return {};
  if (up == 0 && (a == to.end() || a->empty())) return ".";
  path relative;
  for (; up > 0; --up) relative /= "..";
  for (auto at = a; at != to.end(); ++at) relative /= *at;
  return relative;
}

path path::lexically_proximate(const path& base) const {
  return lexically_relative(base).empty() ? *this : lexically_relative(base);
}

path working_folder = "/";

file_status status(const path& file, error_code& fault) {
  fault.clear();
  const double size = selvedge::host_size(file.native().data(), file.native().size());
  return size >= 0                        ? file_type::regular
         : size == selvedge::host_missing ? file_type::not_found
         : size == selvedge::host_folder  ? file_type::directory
                                          : file_type::unknown;
}
uintmax_t file_size(const path& file, error_code& fault) {
  fault.clear();
  const double size = selvedge::host_size(file.native().data(), file.native().size());
  if (size >= 0) return static_cast<uintmax_t>(size);
  fault = make_error_code(errc::no_such_file_or_directory);
  return static_cast<uintmax_t>(-1);
}
void remove_all(const path& folder, error_code&) {
  selvedge::host_drop(folder.native().data(), folder.native().size());
}
bool equivalent(const path& a, const path& b, error_code& fault) {
  return exists(a, fault) && exists(b, fault) && weakly_canonical(a, fault) == weakly_canonical(b, fault);
}

void directory_iterator::add(const path& folder, error_code& fault) {
  if (!is_directory(folder, fault)) {
    fault = make_error_code(errc::no_such_file_or_directory);
    return;
  }
  selvedge::host_list(folder.native().data(), folder.native().size());
  const std::string names = selvedge::host_input();
  for (size_t at = 0, end = 0; (end = names.find('\0', at)) != std::string::npos; at = end + 1)
    entries_.emplace_back(folder / names.substr(at, end - at));
}
directory_iterator::directory_iterator(const path& folder, error_code& fault) { add(folder, fault); }
void recursive_directory_iterator::increment(error_code& fault) {
  const path last = entries_.back().path();
  entries_.pop_back();
  if (is_directory(last, fault)) add(last, fault);
}

}  // namespace std::__2::filesystem
