#include "format/gltf/obj.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <unordered_map>

#include "format/base/atomic_file.h"
#include "format/base/printable.h"
#include "format/base/words.h"
#include "format/gltf/edit.h"
#include "format/gltf/memory.h"
#include "format/gltf/uri.h"

namespace selvedge {
namespace {

/// What a corner of a face names; negative: nothing.
struct Corner {
  int position = -1;
  int uv = -1;
  int normal = -1;
  bool operator==(const Corner&) const = default;
};

struct CornerHash {
  std::size_t operator()(const Corner& c) const {
    const auto word = [](int i) { return static_cast<std::uint64_t>(static_cast<std::uint32_t>(i)); };
    return (word(c.position) << 32 ^ word(c.uv) << 12 ^ word(c.normal)) * 0x9E3779B97F4A7C15U;
  }
};

/// A corner with its share of the maps and buffers that are made of it.
constexpr std::uint64_t corner_price = 128;
/// A byte of text with its share of the lines and values that are read from it.
constexpr std::uint64_t obj_price = 24;
constexpr std::uint64_t mtl_price = 64;
/// JSON values of a primitive with its accessors, views and material.
constexpr std::uint64_t values_of_part = 128;

/// A primitive: the triangles of one material, with or without texture coordinates.
struct Part {
  std::string material;
  bool has_uvs = false;
  bool operator<(const Part& other) const {
    return std::tie(material, has_uvs) < std::tie(other.material, other.has_uvs);
  }
};

/// The lines of an OBJ text.
struct ObjLines {
  std::vector<V3d> positions;
  std::vector<V3f> normals;
  std::vector<V2f> uvs;
  std::map<Part, std::vector<Corner>> parts;  ///< three corners a triangle
  std::vector<std::string> material_files;
};

class ObjReader {
 public:
  ObjReader(const std::string& file, MemoryAccount& account) : file_(file), account_(account) {}

  Result<void> read_line(const Words& words, int number) {
    if (words[0] == "v") {
      const auto position = position_at(words, 1, file_, number);
      if (!position) return tl::unexpected(position.error());
      lines.positions.push_back(*position);
    } else if (words[0] == "vn") {
      const auto normal = position_at(words, 1, file_, number);
      lines.normals.push_back(normal && normal->length() > 0 ? V3f(normal->normalized()) : V3f(0, 0, 1));
    } else if (words[0] == "vt") {
      return read_uv(words, number);
    } else if (words[0] == "f") {
      return read_face(words, number);
    } else if (words[0] == "usemtl") {
      material_ = rest_of(words);
    } else if (words[0] == "mtllib") {
      lines.material_files.emplace_back(rest_of(words));
    }
    return {};
  }

  ObjLines lines;

 private:
  Result<void> read_uv(const Words& words, int number) {
    V2d uv(0, 0);
    for (int i = 0; i < 2 && static_cast<std::size_t>(i) + 1 < words.size(); ++i) {
      if (!to_number(words[static_cast<std::size_t>(i) + 1], uv[i]) ||
          !std::isfinite(static_cast<float>(uv[i])))
        return damaged(number, "texture coordinates that are no numbers");
    }
    lines.uvs.emplace_back(static_cast<float>(uv.x), static_cast<float>(1 - uv.y));
    return {};
  }

  Result<void> read_face(const Words& words, int number) {
    if (words.size() < 4) return damaged(number, "a face needs three corners");
    if (!account_.take(3 * (words.size() - 3), corner_price))
      return tl::unexpected(beyond_memory(file_, fmt::format("line {}", number), "faces", account_.limit()));
    std::vector<Corner> face;
    for (std::size_t i = 1; i < words.size(); ++i) {
      const auto corner = corner_of(words[i], number);
      if (!corner) return tl::unexpected(corner.error());
      face.push_back(*corner);
    }
    const bool has_uvs =
        std::all_of(face.begin(), face.end(), [](const Corner& corner) { return corner.uv >= 0; });
    if (!has_uvs) {
      for (Corner& corner : face) corner.uv = -1;
    }
    const auto [part, is_new] = lines.parts.try_emplace({material_, has_uvs});
    if (is_new && !account_.take(values_of_part, memory_price::json_value))
      return tl::unexpected(
          beyond_memory(file_, fmt::format("line {}", number), "materials", account_.limit()));
    std::vector<Corner>& corners = part->second;
    for (std::size_t i = 2; i < face.size(); ++i) {
      for (const std::size_t k : {std::size_t{0}, i - 1, i}) corners.push_back(face[k]);
    }
    return {};
  }

  /// vertex, vertex/texture, vertex//normal or vertex/texture/normal.
  Result<Corner> corner_of(std::string_view word, int number) const {
    const std::size_t slash = std::min(word.find('/'), word.size());
    const std::size_t second = std::min(word.find('/', slash + 1), word.size());
    Corner corner;
    const auto read = [](std::string_view part, std::size_t count, int& index) {
      return to_obj_index(part, count, index) && index >= 0 && static_cast<std::size_t>(index) < count;
    };
    bool sound = read(word.substr(0, slash), lines.positions.size(), corner.position);
    if (slash + 1 < second)
      sound = read(word.substr(slash + 1, second - slash - 1), lines.uvs.size(), corner.uv) && sound;
    if (second < word.size())
      sound = read(word.substr(second + 1), lines.normals.size(), corner.normal) && sound;
    if (!sound) return damaged(number, fmt::format("\"{}\" names no vertex before it", word));
    return corner;
  }

  tl::unexpected<Error> damaged(int number, std::string why) const {
    return fail(Code::file_damaged, file_, fmt::format("line {}", number), std::move(why));
  }

  const std::string& file_;
  MemoryAccount& account_;
  std::string material_;
};

/// Sums of the faces' normals by area, at each position.
std::vector<V3d> mean_normals(const ObjLines& lines) {
  std::vector<V3d> sums(lines.positions.size(), V3d(0, 0, 0));
  for (const auto& [part, corners] : lines.parts) {
    for (std::size_t t = 0; t < corners.size(); t += 3) {
      const V3d& a = lines.positions[corners[t].position];
      const V3d normal =
          (lines.positions[corners[t + 1].position] - a).cross(lines.positions[corners[t + 2].position] - a);
      for (std::size_t k = 0; k < 3; ++k) sums[corners[t + k].position] += normal;
    }
  }
  return sums;
}

/// Appends the vertices of a part and returns the primitive, without its material.
Json primitive_of(GltfDocument& document, const ObjLines& lines, const std::vector<V3d>& sums, bool has_uvs,
                  const std::vector<Corner>& corners) {
  std::unordered_map<Corner, std::uint32_t, CornerHash> index_of_corner;
  std::vector<float> positions;
  std::vector<float> normals;
  std::vector<float> uvs;
  std::vector<std::uint32_t> indices;
  for (const Corner& corner : corners) {
    const auto [entry, is_new] =
        index_of_corner.try_emplace(corner, static_cast<std::uint32_t>(index_of_corner.size()));
    indices.push_back(entry->second);
    if (!is_new) continue;
    const V3f position(lines.positions[corner.position]);
    const V3d& sum = sums[corner.position];
    const V3f normal = corner.normal >= 0  ? lines.normals[corner.normal]
                       : sum.length2() > 0 ? V3f(sum.normalized())
                                           : V3f(0, 0, 1);
    positions.insert(positions.end(), {position.x, position.y, position.z});
    normals.insert(normals.end(), {normal.x, normal.y, normal.z});
    if (has_uvs) uvs.insert(uvs.end(), {lines.uvs[corner.uv].x, lines.uvs[corner.uv].y});
  }
  Json attributes{{"POSITION", append_float_accessor(document, positions, 3, true)},
                  {"NORMAL", append_float_accessor(document, normals, 3, false)}};
  if (has_uvs) attributes["TEXCOORD_0"] = append_float_accessor(document, uvs, 2, false);
  return {{"attributes", attributes}, {"indices", append_index_accessor(document, indices)}};
}

/// Materials of MTL files, as glTF has them, by name.
class MaterialReader {
 public:
  explicit MaterialReader(GltfDocument& document) : document_(document) {}

  /// `name` as the OBJ file gives it. A file that is not there is passed over.
  Result<void> read(const std::string& name, const GltfLimits& limits, MemoryAccount& account) {
    const auto path = path_of(name, "mtllib");
    if (!path) return tl::unexpected(path.error());
    const auto text = read_file(*path, std::min(limits.file_bytes, limits.memory));
    if (!text) return {};
    if (!account.take(text->size(), mtl_price))
      return tl::unexpected(beyond_memory(*path, "", "its text", limits.memory));
    return for_each_line(obj_text(*text), [&](const Words& words, int) { return read_line(words); });
  }

  /// Index of the document's material of this name.
  int use(const std::string& name) {
    const auto [entry, is_new] = used_.try_emplace(name, static_cast<int>(used_.size()));
    if (is_new) {
      Json material = materials_.contains(name) ? materials_.at(name) : Json::object();
      material["name"] = name.empty() ? "cloth" : as_utf8(name);  // JSON strings are UTF-8
      material["doubleSided"] = true;
      material["pbrMetallicRoughness"]["metallicFactor"] = 0;
      document_.json["materials"].push_back(material);
    }
    return entry->second;
  }

 private:
  /// MTL has heights alone, but Blender and others name normal maps there.
  static bool is_normal_map(const Words& words) {
    std::string name(words.back());
    for (char& c : name) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    return (words[0] == "map_Bump" || words[0] == "map_bump" || words[0] == "bump") &&
           name.find("normal") != std::string::npos;
  }

  Result<void> read_line(const Words& words) {
    if (words[0] == "newmtl") current_ = &(materials_[std::string(rest_of(words))] = Json::object());
    if (current_ == nullptr) return {};
    Json& material = *current_;
    Json& base = material["pbrMetallicRoughness"];
    if (words[0] == "Kd" || words[0] == "Ke") {
      Json colour = Json::array();
      for (std::size_t i = 1; i < 4; ++i) {
        double value = 1;
        if (i < words.size() && to_number(words[i], value) && !(value >= 0)) value = 0;
        colour.push_back(std::clamp(value, 0.0, 1.0));
      }
      if (words[0] == "Ke") {
        material["emissiveFactor"] = colour;
      } else {
        colour.push_back(1);
        base["baseColorFactor"] = colour;
      }
    } else if (words[0] == "map_Kd") {
      return set_picture(words, base["baseColorTexture"]);
    } else if (words[0] == "map_Ke") {
      if (auto ok = set_picture(words, material["emissiveTexture"]); !ok) return ok;
      // A texture alone shows nothing, as the factor of glTF is 0 by default.
      if (!material["emissiveTexture"].is_null() && !material.contains("emissiveFactor"))
        material["emissiveFactor"] = Json::array({1, 1, 1});
    } else if (words[0] == "norm" || is_normal_map(words)) {
      return set_picture(words, material["normalTexture"]);
    } else if (words[0] == "map_d") {
      material["alphaMode"] = "MASK";  // of the picture that has the colour, too, where it is one
    }
    return {};
  }

  /// Points `texture` at the picture of a line, behind its options: -s 1 1 1, -clamp on.
  Result<void> set_picture(const Words& words, Json& texture) {
    std::size_t first = 1;
    double number = 0;
    while (first < words.size() && words[first].starts_with('-')) {
      ++first;
      while (first + 1 < words.size() &&
             (to_number(words[first], number) || words[first] == "on" || words[first] == "off"))
        ++first;
    }
    const std::string name(rest_of(words, first));
    const auto path = path_of(name, "materials");
    if (!path) return tl::unexpected(path.error());
    std::error_code ignored;
    if (path->empty() || !std::filesystem::is_regular_file(*path, ignored)) return {};
    const std::string uri = relative_uri(*path, document_.folder);
    const auto [entry, is_new] = pictures_.try_emplace(uri, static_cast<int>(pictures_.size()));
    if (is_new) {
      document_.json["images"].push_back({{"uri", uri}});
      document_.json["textures"].push_back({{"source", entry->second}});
    }
    texture = {{"index", entry->second}};
    return {};
  }

  /// Of a file that the text names; other systems' separators and roots are understood.
  Result<std::string> path_of(std::string name, const std::string& place) const {
    std::replace(name.begin(), name.end(), '\\', '/');
    if (name.starts_with('/') || name.find(':') != std::string::npos) name = name.substr(name.rfind('/') + 1);
    if (name.empty() || document_.other_files == OtherFiles::none) return std::string();
    const std::string path = (std::filesystem::path(document_.folder) / name).string();
    return resolve_uri(document_, relative_uri(path, document_.folder), place);
  }

  GltfDocument& document_;
  std::map<std::string, Json> materials_;
  Json* current_ = nullptr;
  std::map<std::string, int> used_, pictures_;
};

/// Takes out what no picture was found for, which glTF does not allow to be empty.
void drop_empty(Json& material) {
  for (const char* member : {"emissiveTexture", "normalTexture"}) {
    if (material.contains(member) && material[member].is_null()) material.erase(member);
  }
  Json& base = material["pbrMetallicRoughness"];
  if (base.contains("baseColorTexture") && base["baseColorTexture"].is_null()) base.erase("baseColorTexture");
}

}  // namespace

Result<GltfDocument> load_obj(std::string_view text, const std::string& path, const GltfLimits& limits) {
  MemoryAccount account(limits.memory);
  if (!account.take(text.size(), obj_price))
    return tl::unexpected(beyond_memory(path, "", "its text", limits.memory));
  ObjReader reader(path, account);
  const auto read_line = [&](const Words& words, int number) { return reader.read_line(words, number); };
  if (auto ok = for_each_line(obj_text(text), read_line); !ok) return tl::unexpected(ok.error());
  const ObjLines& lines = reader.lines;
  if (lines.parts.empty()) return fail(Code::gltf_malformed, path, "", "has no faces");

  GltfDocument document;
  document.file = path;
  document.folder = std::filesystem::path(path).parent_path().string();
  document.other_files = limits.other_files;
  document.json = Json::parse(R"({"asset": {"version": "2.0", "generator": "selvedge"}, "scene": 0,
    "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}], "meshes": [{"primitives": []}]})");
  MaterialReader materials(document);
  for (const std::string& name : lines.material_files) {
    if (auto ok = materials.read(name, limits, account); !ok) {
      Error error = ok.error();
      error.file = path;
      return tl::unexpected(error);
    }
  }
  const std::vector<V3d> sums = mean_normals(lines);
  for (const auto& [part, corners] : lines.parts) {
    Json primitive = primitive_of(document, lines, sums, part.has_uvs, corners);
    primitive["material"] = materials.use(part.material);
    document.json["meshes"][0]["primitives"].push_back(primitive);
  }
  for (Json& material : document.json["materials"]) drop_empty(material);
  document.taken = limits.memory - account.left();
  return document;
}

}  // namespace selvedge
