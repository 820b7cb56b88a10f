#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdlib>

#include "format/base/guard.h"
#include "format/base/option_text.h"
#include "format/mesh/mesh_file.h"

namespace selvedge {
namespace {

using Words = std::vector<std::string_view>;

/// Splits a line at white space.
void split_words(std::string_view line, Words& words) {
  constexpr std::string_view blanks = " \t\r\v\f";
  words.clear();
  for (std::size_t end = 0;;) {
    const std::size_t begin = line.find_first_not_of(blanks, end);
    if (begin == std::string_view::npos) return;
    end = std::min(line.find_first_of(blanks, begin), line.size());
    words.push_back(line.substr(begin, end - begin));
  }
}

/// The text without byte order mark and comments, line ends as \n, continued lines joined; empty lines after
/// them keep the line numbers.
std::string plain_text(std::string_view text) {
  if (text.starts_with("\xef\xbb\xbf")) text.remove_prefix(3);
  std::string plain;
  std::string pending_ends;  // line ends of continued lines
  bool comment = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    char c = text[i];
    if (c == '\r' && i + 1 < text.size() && text[i + 1] == '\n') continue;
    if (c == '\r') c = '\n';
    if (c == '\n' && plain.ends_with('\\') && !comment) {
      plain.back() = ' ';
      pending_ends += '\n';
      continue;
    }
    if (c == '#') comment = true;
    if (c == '\n') {
      comment = false;
      plain += pending_ends;
      pending_ends.clear();
    }
    if (!comment) plain += c;
  }
  return plain + pending_ends;
}

/// Calls use(words, number) for each line that is not blank, where `number` counts from 1.
template <class Use>
void for_each_line(std::string_view given, const Use& use) {
  const std::string plain = plain_text(given);
  std::string_view text = plain;
  Words words;
  for (int number = 1; !text.empty(); ++number) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    split_words(text.substr(0, end), words);
    text.remove_prefix(std::min(end + 1, text.size()));
    if (!words.empty()) use(words, number);
  }
}

/// The line from a word on.
std::string rest_of(const Words& words, std::size_t first = 1) {
  if (words.size() <= first) return {};
  return {words[first].data(), words.back().data() + words.back().size()};
}

/// The three numbers from words[first] on, or nothing.
std::optional<V3d> numbers_at(const Words& words, std::size_t first) {
  V3d numbers;
  if (words.size() < first + 3) return std::nullopt;
  for (std::size_t i = 0; i < 3; ++i)
    if (!parse_number(words[first + i], numbers[static_cast<int>(i)])) return std::nullopt;
  return numbers;
}

class ObjReader {
 public:
  explicit ObjReader(const std::string& file) : file_(file) {}

  void read_line(const Words& words, int number) {
    line_ = number;
    if (words[0] == "v") read_vertex(words);
    if (words[0] == "vt") read_uv(words);
    if (words[0] == "f") read_face(words);
    if (words[0] == "vn") mesh.normals.push_back(numbers_at(words, 1).value_or(V3d(0, 0, 0)));
    if (words[0] == "usemtl") use_material(rest_of(words));
    if (words[0] == "mtllib") mesh.material_files.push_back(rest_of(words));
  }

  MeshFile mesh;

 private:
  void read_vertex(const Words& words) {
    // x y z, with a weight, a colour or both.
    if (words.size() == 6) refuse("a vertex with 5 numbers");
    const std::optional<V3d> position = numbers_at(words, 1);
    if (!position) refuse("a vertex needs three numbers");
    const V3f single(*position);
    if (!std::isfinite(single.x) || !std::isfinite(single.y) || !std::isfinite(single.z))
      refuse("a vertex is NaN, infinite or beyond a float", Code::mesh_not_finite);
    mesh.positions.push_back(*position + V3d(0, 0, 0));  // -0 and 0 become the same bits
    std::vector<V3f>& colours = mesh.colours.values;
    const std::optional<V3d> colour = numbers_at(words, words.size() == 8 ? 5 : 4);
    if (colour || !colours.empty()) colours.resize(mesh.positions.size(), V3f(-1));
    if (colour) colours.back() = V3f(*colour);
  }

  void read_uv(const Words& words) {
    V2d uv(0, 0);
    for (std::size_t i = 1; i < std::min<std::size_t>(words.size(), 3); ++i) {
      double& value = uv[static_cast<int>(i) - 1];
      if (!parse_number(words[i], value) || !std::isfinite(static_cast<float>(value)))
        refuse("texture coordinates that are not finite numbers");
    }
    mesh.uvs.emplace_back(static_cast<float>(uv.x), static_cast<float>(1 - uv.y));
  }

  void read_face(const Words& words) {
    if (words.size() < 4) refuse("a face needs three corners");
    for (std::size_t i = 1; i < words.size(); ++i) {
      const std::optional<MeshCorner> corner = corner_of(words[i]);
      if (!corner) refuse(fmt::format("\"{}\" names no vertex before it", words[i]));
      mesh.corners.push_back(*corner);
    }
    if (mesh.materials.empty()) use_material("");
    mesh.face_ends.push_back(mesh.corners.size());
    mesh.face_materials.push_back(material_);
  }

  /// vertex, vertex/texture, vertex//normal or vertex/texture/normal.
  std::optional<MeshCorner> corner_of(std::string_view word) const {
    const std::size_t slash = std::min(word.find('/'), word.size());
    const std::size_t second = std::min(word.find('/', slash + 1), word.size());
    MeshCorner corner;
    bool sound = read_index(word.substr(0, slash), mesh.positions.size(), corner.position);
    if (slash + 1 < second)
      sound &= read_index(word.substr(slash + 1, second - slash - 1), mesh.uvs.size(), corner.uv);
    if (second < word.size())
      sound &= read_index(word.substr(second + 1), mesh.normals.size(), corner.normal);
    return sound ? std::optional(corner) : std::nullopt;
  }

  /// Reads an index into `count` entries so far: from 1, or backwards from -1.
  static bool read_index(std::string_view word, std::size_t count, int& index) {
    const char* end = word.data() + word.size();
    std::int64_t number = 0;
    if (std::from_chars(word.data(), end, number).ptr != end || number == 0) return false;
    const auto most = static_cast<std::int64_t>(count);
    if (number < -most || number > most) return false;
    index = static_cast<int>(number > 0 ? number - 1 : most + number);
    return true;
  }

  void use_material(const std::string& name) {
    const auto [entry, is_new] = numbers_.try_emplace(name, static_cast<int>(mesh.materials.size()));
    if (is_new) mesh.materials.push_back(name);
    material_ = entry->second;
  }

  [[noreturn]] void refuse(std::string why, Code code = Code::file_damaged) const {
    throw Failure{{code, file_, fmt::format("line {}", line_), std::move(why)}};
  }

  const std::string& file_;
  int line_ = 0;
  int material_ = 0;
  std::map<std::string, int> numbers_;  ///< of materials
};

/// A picture behind its options: -s 1 1 1, -clamp on.
TextureMap picture_of(const Words& words) {
  TextureMap map;
  std::size_t next = 1;
  while (next + 2 < words.size() && words[next].starts_with('-')) {
    const std::string_view option = words[next++];
    const bool is_vector = option == "-s" || option == "-o" || option == "-t";
    V3d values(option == "-s" ? 1.0 : 0.0);
    const std::size_t end = std::min(next + (is_vector ? 3 : option == "-mm" ? 2 : 1), words.size() - 1);
    for (int c = 0; next < end && parse_number(words[next], values[c]); ++c) ++next;
    if (!is_vector && next < end) ++next;  // a word: on, off, a channel
    if (option == "-s") map.scale = V2d(values.x, values.y);
    if (option == "-o") map.offset = V2d(values.x, values.y);
  }
  map.file = rest_of(words, next);
  return map;
}

}  // namespace

bool parse_number(std::string_view word, double& value) {
  if (word.starts_with('+')) word.remove_prefix(1);
  const char* end = word.data() + word.size();
  const auto result = std::from_chars(word.data(), end, value);
  if (result.ec == std::errc::result_out_of_range) value = std::strtod(std::string(word).c_str(), nullptr);
  return result.ec != std::errc::invalid_argument && result.ptr == end;
}

Result<MeshFile> read_obj(std::string_view text, const std::string& file) {
  return catch_failure([&] {
    ObjReader reader(file);
    for_each_line(text, [&](const Words& words, int number) { reader.read_line(words, number); });
    return std::move(reader.mesh);
  });
}

void read_mtl(std::string_view text, std::map<std::string, MtlMaterial>& materials) {
  MtlMaterial* material = nullptr;
  for_each_line(text, [&](const Words& words, int) {
    const std::string key = lower_case(std::string(words[0]));
    if (key == "newmtl") material = &(materials[rest_of(words)] = MtlMaterial());
    if (material == nullptr) return;
    // MTL has heights alone there, but Blender and others name normal maps.
    const bool is_normal_map = (key == "map_bump" || key == "bump") &&
                               lower_case(std::string(words.back())).find("normal") != std::string::npos;
    if (key == "kd" || key == "ke") {
      double grey = 0;
      std::optional<V3d> colour = numbers_at(words, 1);
      if (words.size() == 2 && parse_number(words[1], grey)) colour = V3d(grey);
      for (int c = 0; colour && c < 3; ++c) (*colour)[c] = (*colour)[c] >= 0 ? (*colour)[c] : 0;
      if (colour) (key == "kd" ? material->diffuse : material->emission) = colour;
    } else if (key == "map_kd") {
      material->diffuse_map = picture_of(words);
    } else if (key == "map_ke") {
      material->emission_map = picture_of(words);
    } else if (key == "norm" || is_normal_map) {
      material->normal_map = picture_of(words);
    } else if (key == "map_d") {
      material->mask_file = picture_of(words).file;
    }
  });
  for (auto& [name, read] : materials)
    if (!read.diffuse_map.file.empty() && read.diffuse == V3d(0, 0, 0)) read.diffuse.reset();
}

}  // namespace selvedge
