#include "format/gltf/obj.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>

#include "format/base/atomic_file.h"
#include "format/base/printable.h"
#include "format/base/words.h"
#include "format/gltf/memory.h"
#include "format/gltf/mesh_corners.h"
#include "format/gltf/uri.h"

namespace selvedge {
namespace {

/// A byte of text with its share of the lines and values that are read from it.
constexpr std::uint64_t obj_price = 24;
constexpr std::uint64_t mtl_price = 64;
/// The lines of an OBJ text.
struct ObjLines : MeshCorners {
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
    std::vector<MeshCorner> face;
    for (std::size_t i = 1; i < words.size(); ++i) {
      const auto corner = corner_of(words[i], number);
      if (!corner) return tl::unexpected(corner.error());
      face.push_back(*corner);
    }
    const bool has_uvs =
        std::all_of(face.begin(), face.end(), [](const MeshCorner& corner) { return corner.uv >= 0; });
    if (!has_uvs) {
      for (MeshCorner& corner : face) corner.uv = -1;
    }
    const auto [part, is_new] = lines.parts.try_emplace({material_, has_uvs});
    if (is_new && !account_.take(values_of_part, memory_price::json_value))
      return tl::unexpected(
          beyond_memory(file_, fmt::format("line {}", number), "materials", account_.limit()));
    std::vector<MeshCorner>& corners = part->second;
    for (std::size_t i = 2; i < face.size(); ++i) {
      for (const std::size_t k : {std::size_t{0}, i - 1, i}) corners.push_back(face[k]);
    }
    return {};
  }

  /// vertex, vertex/texture, vertex//normal or vertex/texture/normal.
  Result<MeshCorner> corner_of(std::string_view word, int number) const {
    const std::size_t slash = std::min(word.find('/'), word.size());
    const std::size_t second = std::min(word.find('/', slash + 1), word.size());
    MeshCorner corner;
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

  GltfDocument document = document_of_mesh(path, limits);
  MaterialReader materials(document);
  for (const std::string& name : lines.material_files) {
    if (auto ok = materials.read(name, limits, account); !ok) {
      Error error = ok.error();
      error.file = path;
      return tl::unexpected(error);
    }
  }
  append_parts(document, lines, [&](const std::string& name) { return materials.use(name); });
  for (Json& material : document.json["materials"]) drop_empty(material);
  document.taken = limits.memory - account.left();
  return document;
}

}  // namespace selvedge
