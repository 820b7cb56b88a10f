#include "converter/mesh/exact_points.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

namespace selvedge {
namespace {

/// So many times its own size away, a mesh has lost six bits of its coordinates.
constexpr double far = 64;

/// Three numbers of a text in double; false where there are fewer.
bool read_point(const std::string& text, V3d& point) {
  const char* at = text.c_str();
  for (int i = 0; i < 3; ++i) {
    char* end = nullptr;
    point[i] = std::strtod(at, &end);
    if (end == at) return false;
    at = end;
  }
  return true;
}

/// Calls `take(first word, what follows it)` for every line.
template <class Take>
void for_lines(std::string_view text, const Take& take) {
  constexpr std::string_view blanks = " \t\r\v\f";
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    const std::string_view whole = line;
    line.remove_prefix(std::min(line.find_first_not_of(blanks), line.size()));
    const std::size_t space = std::min(line.find_first_of(blanks), line.size());
    take(line.substr(0, space), line.substr(space), whole);
  }
}

}  // namespace

bool lies_far(const V3d& low, const V3d& high) {
  double size = 0;
  double distance = 0;
  for (int i = 0; i < 3; ++i) {
    size = std::max(size, high[i] - low[i]);
    distance = std::max({distance, std::abs(low[i]), std::abs(high[i])});
  }
  return distance > far * size && std::isfinite(distance);
}

std::vector<V3d> obj_points(std::string_view plain) {
  std::vector<V3d> points;
  for_lines(plain, [&](std::string_view keyword, std::string_view rest, std::string_view) {
    V3d point;
    if (keyword == "v" && read_point(std::string(rest), point)) points.push_back(point);
  });
  return points;
}

std::vector<V3d> off_points(const std::string& text) {
  std::istringstream lines(text);
  std::string line;
  const auto next = [&] {
    while (std::getline(lines, line)) {
      const std::size_t begin = line.find_first_not_of(" \t\r");
      if (begin != std::string::npos && line[begin] != '#') return true;
    }
    return false;
  };
  if (!next()) return {};
  std::istringstream header(line);
  std::string keyword;
  std::size_t count = 0;
  header >> keyword;
  if (!keyword.ends_with("OFF") || keyword.find_first_of("4n") != std::string::npos ||
      line.find("BINARY") != std::string::npos) {
    return {};
  }
  while (!(header >> count)) {
    if (!next()) return {};
    header = std::istringstream(line);
  }
  std::vector<V3d> points;
  V3d point;
  while (points.size() < count && next() && read_point(line, point)) points.push_back(point);
  return points;
}

std::string stl_near_origin(const std::string& text, V3d& origin) {
  V3d low(std::numeric_limits<double>::max());
  V3d high(std::numeric_limits<double>::lowest());
  V3d point;
  for_lines(text, [&](std::string_view keyword, std::string_view rest, std::string_view) {
    if (keyword != "vertex" || !read_point(std::string(rest), point)) return;
    for (int i = 0; i < 3; ++i) {
      low[i] = std::min(low[i], point[i]);
      high[i] = std::max(high[i], point[i]);
    }
  });
  origin = V3d(0, 0, 0);
  if (high.x < low.x || !lies_far(low, high)) return text;
  origin = low;
  std::string moved;
  for_lines(text, [&](std::string_view keyword, std::string_view rest, std::string_view line) {
    if (keyword == "vertex" && read_point(std::string(rest), point)) {
      const V3d p = point - origin;
      moved += fmt::format("vertex {} {} {}\n", p.x, p.y, p.z);
    } else {
      moved.append(line).append("\n");
    }
  });
  return moved;
}

void sharpen(std::vector<V3d>& positions, const std::vector<V3d>& points) {
  if (points.size() != positions.size()) return;
  constexpr double rounding = 2 * static_cast<double>(std::numeric_limits<float>::epsilon());
  for (std::size_t p = 0; p < points.size(); ++p) {
    for (int i = 0; i < 3; ++i) {
      if (std::abs(points[p][i] - positions[p][i]) > rounding * std::abs(points[p][i]) + 1e-37) return;
    }
  }
  positions = points;
}

}  // namespace selvedge
