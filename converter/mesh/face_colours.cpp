#include "converter/mesh/face_colours.h"

#include <array>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <sstream>
#include <string_view>

namespace selvedge {
namespace {

/// The first word of a line and the rest without blanks around it.
std::pair<std::string, std::string> words_of(const std::string& line) {
  std::istringstream in(line);
  std::string keyword;
  std::string rest;
  in >> keyword;
  std::getline(in >> std::ws, rest);
  rest.erase(rest.find_last_not_of(" \t\r") + 1);
  return {keyword, rest};
}

/// Whether a line of an OFF file says nothing.
bool is_blank(const std::string& line) {
  const std::size_t first = line.find_first_not_of(" \t\r");
  return first == std::string::npos || line[first] == '#';
}

}  // namespace

std::string plain_obj(std::string_view text) {
  if (text.starts_with("\xef\xbb\xbf")) text.remove_prefix(3);
  std::string plain;
  std::string owed;  // line ends of continued lines
  bool comment = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    char c = text[i];
    const bool pair = c == '\r' && i + 1 < text.size() && text[i + 1] == '\n';
    if (pair) continue;
    if (c == '\r') c = '\n';
    if (c == '\n' && plain.ends_with('\\') && !comment) {
      plain.back() = ' ';
      owed += '\n';
      continue;
    }
    if (c == '#') comment = true;
    if (c == '\n') {
      comment = false;
      plain += owed;
      owed.clear();
    }
    if (!comment) plain += c;
  }
  return plain + owed;
}

std::vector<std::string> material_files(const std::string& bytes) {
  std::vector<std::string> files;
  std::istringstream lines(plain_obj(bytes));
  for (std::string line; std::getline(lines, line);) {
    const auto [keyword, rest] = words_of(line);
    if (keyword == "mtllib") files.push_back(rest);
  }
  return files;
}

void read_materials(const std::string& text, MaterialColours& colours) {
  std::istringstream lines(plain_obj(text));
  std::string name;
  for (std::string line; std::getline(lines, line);) {
    const auto [keyword, rest] = words_of(line);
    if (keyword == "newmtl") name = rest;
    V3f colour;
    if (keyword != "Kd" || !(std::istringstream(rest) >> colour.x >> colour.y >> colour.z)) continue;
    if (colour.x >= 0 && colour.y >= 0 && colour.z >= 0) colours[name] = colour;
  }
}

std::vector<V3f> obj_face_colours(const std::string& plain, const MaterialColours& materials) {
  std::vector<V3f> colours;
  V3f current(-1);
  bool any = false;
  std::istringstream lines(plain);
  for (std::string line; std::getline(lines, line);) {
    const auto [keyword, rest] = words_of(line);
    if (keyword == "usemtl") {
      const auto found = materials.find(rest);
      current = found == materials.end() ? V3f(-1) : found->second;
      any = any || found != materials.end();
    }
    if (keyword == "f") colours.push_back(current);
  }
  return any ? colours : std::vector<V3f>();
}

std::string off_without_face_colours(const std::string& text, RawMesh& colours) {
  std::istringstream lines(text);
  std::string plain;
  std::string line;
  while (std::getline(lines, line) && is_blank(line)) plain += line + "\n";
  std::istringstream header(line);
  std::string keyword;
  std::size_t vertices = 0;
  std::size_t faces = 0;
  header >> keyword;
  if (!keyword.ends_with("OFF") || line.find("BINARY") != std::string::npos) return text;
  plain += line + "\n";
  while (!(header >> vertices >> faces)) {
    if (!std::getline(lines, line)) return text;
    plain += line + "\n";
    if (!is_blank(line)) header = std::istringstream(line);
  }
  for (std::size_t left = vertices; left > 0;) {
    if (!std::getline(lines, line)) return text;
    plain += line + "\n";
    if (!is_blank(line)) --left;
  }
  bool any = false;
  while (colours.face_colours.size() < faces) {
    if (!std::getline(lines, line)) return text;
    if (is_blank(line)) continue;
    std::istringstream words(line);
    std::size_t corners = 0;
    std::string word;
    if (!(words >> corners)) return text;
    plain += std::to_string(corners);
    for (; corners > 0; --corners) {
      if (!(words >> word)) return text;
      plain += " " + word;
    }
    plain += "\n";
    std::vector<std::string> rest;
    while (words >> word && word.front() != '#') rest.push_back(word);
    V3f colour(-1);
    if (rest.size() >= 3) {  // a single number is an index into a table that only some programs have
      colours.face_colours_8bit = rest[0].find_first_of(".eE") == std::string::npos;
      for (unsigned i = 0; i < 3; ++i) {
        colour[i] = std::strtof(rest[i].c_str(), nullptr) / (colours.face_colours_8bit ? 255.0F : 1.0F);
      }
      any = true;
    }
    colours.face_colours.push_back(colour);
  }
  return any ? plain : text;
}

std::vector<V3f> stl_face_colours(const std::string& bytes) {
  constexpr std::size_t stl_header = 84;
  constexpr std::size_t stl_triangle = 50;
  const std::size_t triangles = (bytes.size() - stl_header) / stl_triangle;
  const bool magics = std::string_view(bytes).substr(0, 80).find("COLOR=") != std::string_view::npos;
  std::vector<V3f> colours;
  bool any = false;
  for (std::size_t t = 0; t < triangles; ++t) {
    std::array<std::array<float, 3>, 3> corner{};
    std::memcpy(&corner, bytes.data() + stl_header + t * stl_triangle + 12, sizeof corner);
    // OpenMesh leaves these out.
    if (corner[0] == corner[1] || corner[1] == corner[2] || corner[2] == corner[0]) continue;
    std::uint16_t bits = 0;
    std::memcpy(&bits, bytes.data() + stl_header + t * stl_triangle + 48, 2);
    const V3f first_to_last(static_cast<float>(bits & 31), static_cast<float>(bits >> 5 & 31),
                            static_cast<float>(bits >> 10 & 31));
    const bool coloured = (bits >> 15 == 1) != magics;
    any = any || coloured;
    const V3f& c = first_to_last;
    colours.push_back(coloured ? (magics ? c : V3f(c.z, c.y, c.x)) / 31.0F : V3f(-1));
  }
  return any ? colours : std::vector<V3f>();
}

}  // namespace selvedge
