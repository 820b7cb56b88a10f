#include "converter/measured/table.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <map>
#include <numbers>
#include <optional>
#include <regex>
#include <sstream>
#include <tuple>

#include "format/base/atomic_file.h"
#include "format/base/option_text.h"

namespace selvedge {
namespace {

namespace fs = std::filesystem;

constexpr std::array<const char*, 8> columns{"file",   "light_x", "light_y", "light_z",
                                             "view_x", "view_y",  "view_z",  "exposure"};

std::vector<std::string> fields_of(std::string line) {
  std::erase(line, '\r');
  std::vector<std::string> fields;
  std::istringstream text(line + ",");
  for (std::string field; std::getline(text, field, ',');) {
    const auto first = field.find_first_not_of(" \t");
    const auto last = field.find_last_not_of(" \t");
    fields.push_back(first == std::string::npos ? "" : field.substr(first, last - first + 1));
  }
  return fields;
}

/// Why a direction cannot be used, or its unit vector.
tl::expected<V3f, std::string> front_direction(const V3d& d, const char* what) {
  const double length = d.length();
  if (!(std::isfinite(length) && length > 0))
    return tl::unexpected(fmt::format("the direction of the {} has no length", what));
  const V3d unit = d / length;
  // As spec/samples.md has it of stored pairs, with room for the rounding of angles.
  if (!(unit.z > 1e-3)) return tl::unexpected(fmt::format("the {} lies at or below the horizon", what));
  return V3f(unit);
}

/// One line of a table, whose columns `place` has.
tl::expected<MeasuredPicture, std::string> picture_from(const std::vector<std::string>& fields,
                                                        const std::vector<std::size_t>& column,
                                                        const fs::path& folder) {
  std::array<double, columns.size()> number{};
  number.back() = 1;
  std::string file;
  for (std::size_t i = 0; i < fields.size(); ++i) {
    if (column[i] == 0) {
      file = fields[i];
      continue;
    }
    const auto parsed = parse_numbers(fields[i], ',', 1, 1);
    if (!parsed) return tl::unexpected(fmt::format("{} is no number: {}", columns[column[i]], fields[i]));
    number[column[i]] = parsed->front();
  }
  if (file.empty()) return tl::unexpected<std::string>("no file is named");
  if (!(number.back() > 0)) return tl::unexpected<std::string>("exposure is not above 0");
  const auto light = front_direction({number[1], number[2], number[3]}, "light");
  if (!light) return tl::unexpected(light.error());
  const auto view = front_direction({number[4], number[5], number[6]}, "view");
  if (!view) return tl::unexpected(view.error());
  return MeasuredPicture{(folder / file).string(), {*light, *view}, number.back(), 0};
}

Result<std::vector<MeasuredPicture>> read_table(const std::string& path) {
  const auto text = read_file(path, std::uintmax_t{1} << 26U);
  if (!text) return tl::unexpected(text.error());
  const auto refuse = [&](int line, std::string why) {
    return fail(Code::samples_malformed, path, fmt::format("line {}", line), std::move(why));
  };
  std::istringstream lines(text->starts_with("\xef\xbb\xbf") ? text->substr(3) : *text);
  std::vector<MeasuredPicture> pictures;
  std::vector<std::size_t> column;  // of each field: index into `columns`
  std::string line;
  for (int number = 1; std::getline(lines, line); ++number) {
    if (line.find_first_not_of(" \t\r") == std::string::npos || line.front() == '#') continue;
    const auto fields = fields_of(line);
    if (column.empty()) {
      for (const std::string& name : fields) {
        const auto found = std::find(columns.begin(), columns.end(), name);
        if (found == columns.end()) return refuse(number, "no column has the name " + name);
        column.push_back(found - columns.begin());
      }
      for (std::size_t c = 0; c < columns.size(); ++c) {
        const auto count = std::count(column.begin(), column.end(), c);
        if (count > 1 || (count == 0 && c + 1 < columns.size()))
          return refuse(number, fmt::format("{} columns have the name {}", count, columns[c]));
      }
      continue;
    }
    if (fields.size() != column.size())
      return refuse(number, fmt::format("{} fields; the first line has {}", fields.size(), column.size()));
    auto picture = picture_from(fields, column, fs::path(path).parent_path());
    if (!picture) return refuse(number, picture.error());
    picture->line = number;
    pictures.push_back(std::move(*picture));
  }
  if (column.empty()) return refuse(1, "there are no names of columns");
  return pictures;
}

/// The angle that follows `name` in a file's name, degrees.
std::optional<double> angle_in(const std::string& file, const char* name) {
  std::smatch match;
  const std::regex pattern(std::string("(^|[^A-Za-z])") + name + R"((\d+(\.\d+)?))");
  if (!std::regex_search(file, match, pattern)) return std::nullopt;
  return std::stod(match[2]) * std::numbers::pi / 180;
}

Result<std::vector<MeasuredPicture>> read_names(const std::string& path) {
  std::vector<fs::path> files;
  std::error_code fault;
  for (fs::recursive_directory_iterator i(path, fault), end; !fault && i != end; i.increment(fault))
    if (i->is_regular_file()) files.push_back(i->path());
  if (fault) return fail(Code::file_unreadable, path, {}, fault.message());
  std::sort(files.begin(), files.end());
  std::vector<MeasuredPicture> pictures;
  for (const fs::path& file : files) {
    const std::string name = file.filename().string();
    std::array<std::optional<double>, 4> angle;
    constexpr std::array<const char*, 4> names{"tl", "pl", "tv", "pv"};
    for (std::size_t i = 0; i < names.size(); ++i) angle[i] = angle_in(name, names[i]);
    if (!std::all_of(angle.begin(), angle.end(), [](const auto& a) { return a.has_value(); })) continue;
    const auto direction = [](double polar, double azimuth) {
      return V3d(std::sin(polar) * std::cos(azimuth), std::sin(polar) * std::sin(azimuth), std::cos(polar));
    };
    MeasuredPicture picture{file.string(), {}, 1, 0};
    const auto light = front_direction(direction(*angle[0], *angle[1]), "light");
    const auto view = front_direction(direction(*angle[2], *angle[3]), "view");
    if (!light || !view)
      return fail(Code::samples_malformed, picture.file, {}, light ? view.error() : light.error());
    picture.pair = {*light, *view};
    pictures.push_back(std::move(picture));
  }
  if (pictures.empty())
    return fail(Code::samples_malformed, path, {},
                "no file has a name with angles, as tl000_pl000_tv000_pv000.png");
  return pictures;
}

}  // namespace

Result<std::vector<MeasuredPicture>> read_picture_table(const std::string& path) {
  std::error_code fault;
  auto pictures = fs::is_directory(path, fault) ? read_names(path) : read_table(path);
  if (!pictures) return pictures;
  const auto place_of = [](const MeasuredPicture& p) {
    return p.line > 0 ? fmt::format("line {}", p.line) : p.file;
  };
  std::map<std::tuple<float, float, float, float, float, float>, const MeasuredPicture*> seen;
  for (const MeasuredPicture& p : *pictures) {
    if (!fs::exists(p.file, fault))
      return fail(Code::samples_malformed, path, place_of(p), p.file + " does not exist");
    const V3f& l = p.pair.light;
    const V3f& v = p.pair.view;
    const auto [other, is_new] = seen.try_emplace({l.x, l.y, l.z, v.x, v.y, v.z}, &p);
    if (!is_new)
      return fail(Code::samples_malformed, path, place_of(p),
                  fmt::format("has the directions of {}", place_of(*other->second)));
  }
  if (std::ssize(*pictures) < min_pictures)
    return fail(Code::samples_malformed, path, {},
                fmt::format("{} pictures; at least {} are needed", pictures->size(), min_pictures));
  return pictures;
}

}  // namespace selvedge
